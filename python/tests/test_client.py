"""The client of protocol 2: Gymnasium's own checker on every kind of space, who is let in, what is refused."""
import subprocess
import time
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env

import consac
from consac import wire
from consac.errors import ConnectionLost, ConsacError, EngineBusy, EngineError, Refused, SpecMismatch
from consac.layout import Layout
from consac.serve import Limits
from program import OUR_ENVIRONMENT, OUR_SERVE

SPACES = {
    "box f32": spaces.Box(-1, 1, (3,), np.float32),
    "box f64 unbounded": spaces.Box(-np.inf, np.inf, (2, 2), np.float64),
    "box u8 image": spaces.Box(0, 255, (6, 5, 3), np.uint8),
    "box i16": spaces.Box(-7, 9, (3,), np.int16),
    "box of no axis": spaces.Box(-1, 1, (), np.float32),
    "discrete": spaces.Discrete(5),
    "discrete from -3": spaces.Discrete(4, start=-3),
    "multi_discrete": spaces.MultiDiscrete([2, 5, 3]),
    "multi_discrete of two axes": spaces.MultiDiscrete([[2, 5], [3, 4]]),
    "multi_binary": spaces.MultiBinary(5),
    "multi_binary of two axes": spaces.MultiBinary([2, 3]),
    "dict": spaces.Dict(b=spaces.Discrete(3), a=spaces.Box(-1, 1, (2,), np.float64)),
    "tuple": spaces.Tuple([spaces.MultiBinary(3), spaces.Box(0, 1, (1,), np.float32)]),
    "nested": spaces.Dict(x=spaces.Tuple([spaces.Discrete(2), spaces.Dict(z=spaces.Box(0, 9, (2,), np.int32), y=spaces.MultiDiscrete([3, 3]))]), a=spaces.MultiBinary(2)),
}


class Echo(gymnasium.Env):
    """Random observations; tells the action back in its infos."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 30}
    render_mode = "rgb_array"

    def __init__(self, observation, action):
        self.observation_space, self.action_space = observation, action

    def _observe(self):
        self.observation_space.seed(int(self.np_random.integers(1 << 31)))
        return self.observation_space.sample()

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observe(), {"options": str(options)}

    def step(self, action):
        assert action in self.action_space
        return self._observe(), 0.1, False, False, {"flat": np.ravel(spaces.flatten(self.action_space, action)).astype(float).tolist()}

    def render(self):
        return np.arange(4 * 3 * 3, dtype=np.uint8).reshape(4, 3, 3)


# ---- Gymnasium's rules

@pytest.mark.parametrize("shared_memory", [False, True], ids=["tcp", "memory"])
@pytest.mark.parametrize("kind", SPACES)
def test_check_env_and_every_space_arrives_as_it_was(kind, shared_memory, serve_env):
    space = SPACES[kind]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        env = consac.make(serve_env(lambda: Echo(space, space)), protocol=2, render_mode="rgb_array", shared_memory=shared_memory)
        assert env.observation_space == space and env.action_space == space
        check_env(env)
    stock = Echo(space, space)
    observation, info = env.reset(seed=3, options={"a": 1})
    expected, expected_info = stock.reset(seed=3, options={"a": 1})
    assert info == expected_info
    for _ in range(5):
        assert gymnasium.utils.env_checker.data_equivalence(wide(observation), wide(expected), exact=True)
        action = space.sample()
        observation, reward, terminated, truncated, info = env.step(action)
        expected, *_, expected_info = stock.step(action)
        assert info == expected_info
        assert reward == 0.1 and type(reward) is float and terminated is False and truncated is False
    assert (env.render() == stock.render()).all()
    env.close()
    env.close()
    with pytest.raises(ConnectionLost, match="closed"):
        env.reset()


def wide(value):
    """A value whose numbers have one type: a discrete one is an int here and an np.int64 there."""
    if isinstance(value, dict):
        return {key: wide(part) for key, part in value.items()}
    return tuple(map(wide, value)) if isinstance(value, tuple) else value if isinstance(value, np.ndarray) else int(value) if isinstance(value, np.integer) else value


def test_through_gymnasium_make_and_a_step_limit(serve_env):
    url = serve_env("CartPole-v1")
    env = gymnasium.make("consac.env:consac/Remote-v0", url=url, protocol=2)
    env.reset(seed=1)
    assert env.step(0)[4] == {}
    env.close()
    env = consac.make(url, protocol=2, max_episode_steps=3)
    assert env.unwrapped.spec.max_episode_steps == 500
    env.reset(seed=1)
    assert [env.step(step % 2)[3] for step in range(3)] == [False, False, True]
    env.close()


def test_wrong_actions_are_refused_and_the_session_goes_on(serve_env):
    env = consac.make(serve_env("CartPole-v1"), protocol=2)
    with pytest.raises(EngineError, match="BAD_STATE"):
        env.step(0)
    env.reset(seed=1)
    for wrong in (7, -1):
        with pytest.raises(EngineError, match="OUT_OF_RANGE") as told:
            env.step(wrong)
        assert told.value.env == 0 and not told.value.fatal
    for wrong in (0.5, "left", [0, 1], 1 << 40):
        with pytest.raises(ValueError):
            env.step(wrong)
    assert env.step(np.int64(1))[0].shape == (4,)
    env.close()
    env = consac.make(serve_env("Pendulum-v1"), protocol=2)
    env.reset(seed=1)
    for wrong in ([1.0, 2.0], 1.0, ["a"]):
        with pytest.raises(ValueError):
            env.step(wrong)
    with pytest.raises(EngineError, match="NON_FINITE"):
        env.step([np.nan])
    env.step([1])
    env.close()


def test_who_is_let_in(serve_env):
    url = serve_env("CartPole-v1", token="secret")
    with pytest.raises(Refused, match="AUTH_FAILED"):
        consac.make(url, protocol=2)
    consac.make(url, protocol=2, token="secret").close()
    url = serve_env("CartPole-v1", limits=Limits(max_sessions=1))
    env = consac.make(url, protocol=2)
    with pytest.raises(EngineBusy) as told:
        consac.make(url, protocol=2)
    assert told.value.retry_after_s > 0
    env.close()
    with pytest.raises(ConsacError, match="make_vec"):
        consac.make(serve_env("CartPole-v1", 2), protocol=2)


def test_no_final_rows_at_the_very_end_of_a_result():
    layout = Layout.of(spaces.Dict({"far": spaces.Box(0, 1, (3,)), "near": spaces.Box(0, 1, (2,))}))
    assert [view.shape for view in layout.views(memoryview(bytes(64)), 0, 64)] == [(0, 3), (0, 2)]


def test_expected_spaces(serve_env):
    url = serve_env("CartPole-v1")
    env = consac.make(url, protocol=2)
    expect = env.unwrapped.connection.spec["behaviours"]
    env.close()
    consac.make(url, protocol=2, expect=expect).close()
    expect[0]["action"]["n"] = 3
    with pytest.raises(SpecMismatch) as told:
        consac.make(url, protocol=2, expect=expect)
    assert told.value.path == "behaviours/0/action/n"


def test_crc(serve_env):
    env = consac.make(serve_env("CartPole-v1"), protocol=2, crc=True)
    assert env.unwrapped.connection._flags == wire.FLAG_CRC
    env.reset(seed=1)
    env.step(1)
    env.close()


def test_a_server_process(tmp_path):
    port_file = tmp_path / "port"
    with subprocess.Popen([*OUR_SERVE, "CartPole-v1", "--port", "0", "--port-file", port_file, "--no-render"], stdout=subprocess.PIPE, env=OUR_ENVIRONMENT) as process:
        try:
            process.stdout.readline()
            env = consac.make(f"tcp://127.0.0.1:{port_file.read_text().strip()}")
            env.reset(seed=1)
            process.kill()
            process.wait()
            begun = time.monotonic()
            with pytest.raises(ConnectionLost, match="did not come back"):
                for _ in range(3):
                    env.step(1)
            assert time.monotonic() - begun < env.unwrapped.connection.timeout / 2
        finally:
            process.kill()
