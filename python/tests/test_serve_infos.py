"""consac.serve and infos that are none, raise, or hold what JSON of a message has no form for."""
import numpy as np
import pytest

from consac.serve import Server
from consac.wire import RESET, STEP, dump_json, load_json
from raw_client import Raw, Result, reset_payload, step_payload
from toy_worlds import Agents, Counter


class Talking(Counter):
    """Its infos are what it is told to say."""

    says, at_reset = None, {}

    def reset(self, **arguments):
        return super().reset(**arguments)[0], self.at_reset

    def step(self, action):
        return *super().step(action)[:4], self.says


class Bursting(dict):
    def __iter__(self):
        raise RuntimeError("burst")

    items = __iter__


def deep(levels):
    value = 0
    for _ in range(levels):
        value = [value]
    return value


def fails_and_goes_on(client, said, ask, why):
    """What is asked fails, is told to both ends, and the session goes on."""
    error = ask()
    assert error["code"] == "ENV_FAILED" and why in error["message"], error
    assert any(why.partition(" (")[0] in line for line in said), said
    client.reset()


@pytest.mark.parametrize("info, why", [([1], "the info is a list, expected a dict"), ("won", "the info is a str, expected a dict"), (Bursting(a=1), "RuntimeError: burst (test_serve_infos.py")],
                         ids=["list", "text", "raises"])
@pytest.mark.parametrize("masks", [False, True])
def test_an_info_that_is_none_is_its_environments_failure(info, why, masks):
    said, env = [], Talking()
    env.at_reset = env.good = {"action_mask": np.ones(3, np.int8)} if masks else {}
    with Server(lambda: env, log=said.append) as server:
        client = Raw(server)
        client.reset()
        env.says = info
        fails_and_goes_on(client, said, lambda: client.error(STEP, step_payload(1, [0])), why)
        env.at_reset = info
        error = client.error(RESET, reset_payload(1))
        assert error["code"] == "ENV_FAILED" and why in error["message"]
        env.at_reset, env.says = env.good, {"a": 1}
        client.reset()
        assert client.step([0]).said["infos"]["a"]["values"] == [1]


def test_an_agents_info_that_is_none_is_its_environments_failure():
    class Crowd(Agents):
        says = None

        def step(self, actions):
            *result, infos = super().step(actions)
            return *result, infos if self.says is None else self.says

    said, env = [], Crowd()
    with Server(lambda: env, log=said.append) as server:
        client = Raw(server)
        client.reset()
        for info, why in (([1], "what it gave as infos is a list, expected a dict"), ({"red_1": [1]}, "the info of red_1 is a list, expected a dict"), ({"blue_0": Bursting(a=1)}, "burst")):
            env.says = info
            fails_and_goes_on(client, said, lambda: client.error(STEP, step_payload(1, [0, 0, 0, 0])), why)
        env.says = {"red_0": {"a": deep(5000)}, "blue_0": {"b": 2}}
        assert client.step([0, 0, 0, 0]).said == {"infos": {"b": {"slots": [2], "values": [2]}}}

    class First(Crowd):
        def reset(self, **arguments):
            return super().reset(**arguments)[0], {"red_0": [1]}

    with pytest.raises(TypeError, match="the info of red_0 is a list"):
        Server(First)


ITSELF: dict = {}
ITSELF["a"] = ITSELF
DOUBLED: list = []
WITHIN = np.empty((), object)
WITHIN[()] = WITHIN
for _ in range(50):
    DOUBLED = [DOUBLED, DOUBLED]


@pytest.mark.parametrize("value, why", [(10**5000, "is a whole number of 16610 bits"), (ITSELF, "is nested over 60 deep"), (deep(5000), "is nested over 60 deep"), (deep(61), "is nested over 60 deep"),
                                        (DOUBLED, "is over 262144 values"), ("\ud800", "is a text with half of a surrogate pair"), ({"\ud800": 1}, "is a text with half of a surrogate pair"),
                                        ({1, 2}, "is a set"), (np.array(1j, np.clongdouble), "is a clongdouble"),
                                        (WITHIN, "is nested too deep")],
                         ids=["huge", "in itself", "deep", "one too deep", "doubled", "surrogate", "surrogate name", "set", "complex", "array in itself"])
def test_what_json_has_no_form_for_is_left_out_of_the_infos(value, why):
    said, env = [], Talking()
    env.at_reset = env.says = {"it": value, "edge": deep(60), "long": np.longdouble(1.5), 7: 1, "7": 2, "most": 2**1000}
    kept = {"edge": {"slots": [0], "values": [deep(60)]}, "long": {"slots": [0], "values": [1.5]}, "7": {"slots": [0], "values": [2]}, "most": {"slots": [0], "values": [2**1000]}}
    with Server(lambda: env, log=said.append) as server:
        client = Raw(server)
        for _ in range(2):
            for frame in (client.ask(RESET, reset_payload(1)), client.ask(STEP, step_payload(1, [0]))):
                assert Result(client, frame).said == {"infos": kept}
                load_json(dump_json({"infos": kept}))
    assert len(said) == 1 and said[0].startswith(f"info 'it' {why}"), said


def test_infos_of_too_many_values_are_left_out():
    said, env = [], Talking()
    env.says = {"a": [0] * 140_000, "b": [0] * 140_000}
    with Server(lambda: env, log=said.append) as server:
        client = Raw(server)
        client.reset()
        assert client.step([0]).said == {}
    assert said == ["the infos are more than JSON of a message may be: a JSON payload of over 262144 values (R7); they are not sent"]
