"""Parameters, statistics and groups of protocol 2 (spec/protocol2.md, sections 14 to 16): our client before our server, and what users of Gymnasium see of them."""
import contextlib
import subprocess
import sys
import time

import gymnasium
import numpy as np
import pytest

import consac
from consac.client import connect
from consac.errors import ConsacError
from consac.extras import Parameter
from consac.serve import Server
from consac.serve.command import parameter_of


class Walk(gymnasium.Env):
    """Walks `speed` a step; an episode has three."""

    observation_space = gymnasium.spaces.Box(-1e6, 1e6, (1,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.at, self.steps, self.speed, self.extra = 0.0, 0, options["speed"], options.get("extra")
        return np.float32([self.at]), {}

    def step(self, action):
        self.at += self.speed
        self.steps += 1
        return np.float32([self.at]), 1.0, False, self.steps == 3, {"walked": self.speed, "extra": self.extra, "odd": "a text"}


SPEED = Parameter("speed", 1.0, 0.0, 10.0, "m in a step")


@contextlib.contextmanager
def walking(envs=1, **options):
    with Server(Walk, envs=envs, parameters=[SPEED], statistics=["walked", "odd"], name="walk-v0", **options) as server:
        yield f"tcp://127.0.0.1:{server.port}"


@pytest.mark.parametrize("shared_memory", [False, True])
@pytest.mark.parametrize("crc", [False, True])
def test_episodes_have_what_was_set_when_they_began(shared_memory, crc):
    with walking(2) as url, connect(url, protocol=2, shared_memory=shared_memory, crc=crc) as connection:
        assert connection.parameters == {"speed": SPEED}
        connection.reset()
        seen = lambda: connection.rows[0].observations[0].ravel().tolist()
        connection.step()
        assert seen() == [1, 1], "the default"
        connection.set_parameters({"speed": [2.0, np.nan]})
        connection.step()
        assert seen() == [2, 2], "of which the episode under way hears nothing"
        connection.step()
        assert seen() == [0, 0] and connection.rows[0].states.tolist() == [30, 30], "the next one has begun"
        connection.step()
        assert seen() == [2, 1] and connection.statistics == {"walked": [2, 1]}
        connection.set_parameters({"speed": 3})
        connection.reset(np.array([False, True]))
        connection.step()
        assert seen() == [4, 3]
        connection.step()
        assert seen() == [0, 6], "once more it has begun by itself"
        connection.step()
        assert seen()[0] == 3


@pytest.mark.parametrize("autoreset", ["next_step", "disabled"])
def test_another_way_to_begin_has_what_was_set_by_then(autoreset):
    with walking() as url, connect(url, protocol=2, autoreset=autoreset) as connection:
        connection.reset()
        for _ in range(3):
            connection.step()
        connection.set_parameters({"speed": 5})
        connection.step() if autoreset == "next_step" else connection.reset()
        connection.step()
        assert connection.rows[0].observations[0].ravel().tolist() == [5]


def test_an_engine_without_parameters_is_sent_none():
    with Server("CartPole-v1", 1) as server, connect(f"tcp://127.0.0.1:{server.port}", protocol=2) as connection:
        connection.set_parameters({})
        connection.reset()
        connection.step()
        with pytest.raises(ConsacError, match="there is no parameter 'gravity'"):
            connection.set_parameters({"gravity": 1.0})


def test_reset_of_gymnasium_takes_parameters_among_its_options():
    with walking() as url, contextlib.closing(consac.make(url)) as env:
        env.reset(options={"parameters": {"speed": 4}, "extra": 7})
        observation, _, _, _, info = env.step(0)
        assert observation.tolist() == [4] and info["extra"] == 7
        env.reset()
        assert env.step(0)[0].tolist() == [4], "it holds until it is set anew"
        env.reset(options={"parameters": {"speed": 2}})
        assert env.step(0)[0].tolist() == [2]


def test_reset_of_a_vector_takes_one_for_each():
    with walking(3) as url, contextlib.closing(consac.make_vec(url)) as envs:
        envs.reset(options={"parameters": {"speed": [1, 2, 3]}})
        assert envs.step(np.zeros(3, int))[0].ravel().tolist() == [1, 2, 3]


@pytest.mark.parametrize("values, why", [
    ({"sped": 1}, "there is no parameter 'sped'; there is 'speed'"),
    ({"speed": 11}, "parameter 'speed' cannot be 11.0; it is 0 to 10"),
    ({"speed": float("inf")}, "parameter 'speed' cannot be inf"),
    ({"speed": [1, 2]}, "parameter 'speed' of shape (2,); it is a number, or one for each of 1 environments")])
def test_what_cannot_be_set_is_named_and_nothing_is_lost(values, why):
    with walking() as url, contextlib.closing(consac.make(url)) as env:
        env.reset()
        with pytest.raises(ConsacError) as error:
            env.reset(options={"parameters": values})
        assert why in str(error.value)
        assert env.step(0)[0].tolist() == [1]


def test_an_engine_without_parameters_says_so():
    with Server(lambda: gymnasium.make("CartPole-v1")) as server, contextlib.closing(consac.make(f"tcp://127.0.0.1:{server.port}")) as env:
        with pytest.raises(ConsacError, match="there is no parameter 'gravity': the engine has none"):
            env.unwrapped.connection.set_parameters({"gravity": 1})
        env.reset(options={"parameters": {"gravity": 1}})  # an option of its own


def test_a_new_session_begins_with_the_defaults_and_one_that_is_taken_up_does_not():
    with walking() as url:
        with connect(url, protocol=2) as connection:
            connection.set_parameters({"speed": 6})
            connection.reset()
            connection._socket.close()
            connection.step()
            connection.reset()
            connection.step()
            assert connection.rows[0].observations[0].item() == 6
        with connect(url, protocol=2) as connection:
            connection.reset()
            connection.step()
            assert connection.rows[0].observations[0].item() == 1


@pytest.mark.parametrize("text, parameter", [("speed=2", Parameter("speed", 2.0)), ("speed=2:-1:3.5", Parameter("speed", 2.0, -1.0, 3.5))])
def test_what_the_command_takes(text, parameter):
    assert parameter_of(text) == parameter


def test_a_server_refuses_what_is_no_parameter():
    for wrong, why in ((Parameter("a", 2.0, 3.0), "not within"), (Parameter("a\n", 2.0), "name"), (Parameter("a", float("nan")), "not within")):
        with pytest.raises(ValueError, match=why):
            Server(Walk, parameters=[wrong])
