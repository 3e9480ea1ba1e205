"""The client of protocol 2: Gymnasium's own checker on every kind of space, and what happens when the engine misbehaves."""
import struct
import subprocess
import sys
import threading
import time
import tracemalloc
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env

import consac
from consac import client, wire
from consac.errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProtocolError, Refused, SpecMismatch
from consac.layout import Layout
from consac.serve import Limits
from program import OUR_ENVIRONMENT, OUR_SERVE
from toy_server import ToyServer
from waiting import ENDS_S, until

ROOT = Path(__file__).resolve().parents[2]
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


# ---- an engine that fails

def play(url, steps=3, **options):
    """Observations and rewards of a few steps."""
    env = consac.make(url, protocol=2, **options)
    try:
        seen = [env.reset(seed=5)[0]]
        for step in range(steps):
            observation, reward, *_ = env.step(step % 2)
            seen += [observation, reward]
        return np.concatenate([np.ravel(part) for part in seen])
    finally:
        env.close()


def cut_at(at, connections):
    def fault(number, sent, data):
        return data[:max(0, at - sent)] if number <= connections and sent + len(data) > at else None
    return fault


def sent_bytes():
    with ToyServer() as server:
        sent = []
        server.fault = lambda number, before, data: sent.append(len(data))
        expected = play(server.url)
        return expected, sent


def test_an_engine_that_dies_at_any_byte():
    _, sent = sent_bytes()
    with ToyServer(keep=False) as server:
        for at in range(sum(sent)):
            server.fault = cut_at(at, 1 << 30)
            with pytest.raises(ConnectionLost):
                play(server.url)
        assert not server.errors


def test_a_connection_that_breaks_at_any_byte_is_taken_up_and_every_step_happens_once():
    expected, sent = sent_bytes()
    handshake = sent[0]
    for at in range(handshake, sum(sent), 3):
        with ToyServer(fault=cut_at(at, 1)) as server:
            assert (play(server.url) == expected).all()
            assert server.steps == 3 and server.connections == 2 and not server.errors


def test_a_step_that_never_arrived_is_carried_out_once():
    expected, _ = sent_bytes()

    def before(server, sock, frame):
        if frame.type == wire.STEP and server.connections < 4:
            raise ConnectionError("lost on the way")
    with ToyServer(before=before) as server:
        assert (play(server.url) == expected).all()
        assert server.steps == 3 and server.connections == 4


@pytest.mark.parametrize("shared_memory", [False, True])
def test_consac_serve_takes_a_session_up(serve_env, shared_memory):
    env = consac.make(serve_env("CartPole-v1"), protocol=2, shared_memory=shared_memory)
    stock = gymnasium.make("CartPole-v1")
    assert (env.reset(seed=1)[0] == stock.reset(seed=1)[0]).all()
    for step in range(9):
        if step % 3 == 1:
            env.unwrapped.connection._socket.shutdown(2)
        assert (env.step(step % 2)[0] == stock.step(step % 2)[0]).all()
    env.close()


def test_a_session_that_is_forgotten_is_lost():
    with ToyServer(keep=False) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        for sock in server.open:
            sock.shutdown(2)
        with pytest.raises(ConnectionLost, match="AUTH_FAILED"):
            env.step(1)
        with pytest.raises(ConnectionLost, match="is closed"):
            env.step(1)


def frame(kind, payload=b"", request=3, **options):
    return wire.pack(wire.Frame(kind, payload, request, **options))


BAD_ANSWERS = {
    "text": (b"busy: later\n" * 8, "BAD_MAGIC"),
    "another magic": (b"\xc0NSD" + bytes(28), "BAD_MAGIC"),
    "reserved bits": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 0, 0, 0, 3, 0, 1), "MALFORMED"),
    "unknown flags": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 4, 0, 0, 3, 0, 0), "MALFORMED"),
    "a length over the limit": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 0, 0xFFFFFFFF, 0, 3, 0, 0), "FRAME_TOO_LARGE"),
    "a length over what RESULT can have": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 0, 32 << 20, 0, 3, 0, 0), "WRONG_SIZE"),
    "an empty RESULT": (frame(wire.RESULT), "WRONG_SIZE"),
    "a RESULT too short": (frame(wire.RESULT, bytes(40)), "WRONG_SIZE"),
    "a RESULT too long": (frame(wire.RESULT, bytes(80)), "WRONG_SIZE"),
    "final rows that are not there": (frame(wire.RESULT, struct.pack("<II", 1, 0) + bytes(40) + b"\x05"), "WRONG_SIZE"),
    "infos that are not there": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48)), "WRONG_SIZE"),
    "infos longer than the frame": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48) + struct.pack("<I", 1 << 30)), "WRONG_SIZE"),
    "infos that are no JSON": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48) + struct.pack("<I", 4) + b"{{{{"), "MALFORMED"),
    "infos of a slot that is not there": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48) + struct.pack("<I", 43) + b'{"infos":{"a":{"slots":[1],"values":[true]}}}'[:43]), "MALFORMED"),
    "an ERROR that is no JSON": (frame(wire.ERROR, b"no"), "MALFORMED"),
    "an ERROR without code": (frame(wire.ERROR, b'{"severity": "connection", "message": "no"}'), "MALFORMED"),
    "an ERROR without message": (frame(wire.ERROR, b'{"code": "CAPACITY", "severity": "connection"}'), "MALFORMED"),
    "an ERROR of a later time": (frame(wire.ERROR, b'{"code": "CAPACITY", "severity": "connection", "message": "no", "retry_after_s": "soon"}'), "MALFORMED"),
    "another request's answer": (frame(wire.RESULT, bytes(49), 99), "UNKNOWN_MESSAGE"),
    "another kind of answer": (frame(wire.SPEC, b"{}"), "MALFORMED"),
    "an unknown type": (frame(77), "UNKNOWN_MESSAGE"),
    "a CRC that is wrong": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 1, 1, 7, 3, 0, 0) + b"x", "CRC_MISMATCH"),
}


@pytest.mark.parametrize("kind", BAD_ANSWERS)
def test_answers_that_are_no_protocol_2(kind):
    data, code = BAD_ANSWERS[kind]

    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(data)
            return True
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        with pytest.raises(ProtocolError) as told:
            env.step(1)
        assert told.value.code == code
        with pytest.raises(ConnectionLost):
            env.step(1)


def test_a_peer_that_is_no_engine():
    with ToyServer(first=b"HTTP/1.1 400 Bad Request\r\n\r\n") as server:
        with pytest.raises(ProtocolError, match="BAD_MAGIC"):
            consac.make(server.url, protocol=2)
    with pytest.raises(ConnectionLost, match="start it first"):
        consac.make(server.url, protocol=2)
    for wrong in ("udp://a:1", "tcp://a", "tcp://:4", "tcp://a:x"):
        with pytest.raises(ConsacError, match="tcp://host:port"):
            consac.make(wrong)


def with_deadline(url, seconds):
    """After its first reset, which takes as long as it takes."""
    env = consac.make(url, protocol=2)
    env.reset()
    env.unwrapped.connection.timeout = seconds
    return env


def test_an_engine_that_is_silent():
    with ToyServer(before=lambda server, sock, frame: frame.type == wire.STEP) as server:
        env = with_deadline(server.url, 0.2)
        begun = time.monotonic()
        with pytest.raises(DeadlineExceeded, match="0.2 s"):
            env.step(1)
        assert 0.2 <= time.monotonic() - begun < 30  # the deadline of others
        with pytest.raises(ConnectionLost, match="is closed"):
            env.step(1)


def test_an_engine_that_drips_is_given_up_too():
    def before(server, sock, got):
        if got.type == wire.STEP:
            for byte in frame(wire.RESULT, bytes(49)):
                sock.sendall(bytes([byte]))
                time.sleep(0.02)
            return True
    with ToyServer(before=before) as server:
        env = with_deadline(server.url, 0.3)
        with pytest.raises(DeadlineExceeded):
            env.step(1)


def test_a_pause_stops_the_deadline():
    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.PAUSED, request=0))
            time.sleep(1.3)
            sock.sendall(frame(wire.RESUMED, request=0) + frame(wire.OPTIONAL | 99, b"news", 0))
    with ToyServer(before=before) as server:
        env = with_deadline(server.url, 1.0)
        assert env.step(1)[1] == 1.0
        env.close()


def test_after_a_pause_the_deadline_goes_on():
    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.PAUSED, request=0))
            resumed.append(time.monotonic() + 1.3)
            time.sleep(1.3)
            sock.sendall(frame(wire.RESUMED, request=0))
            return True
    resumed = []
    with ToyServer(before=before) as server:
        env = with_deadline(server.url, 1.0)
        with pytest.raises(DeadlineExceeded):
            env.step(1)
        assert time.monotonic() > resumed[0]


def test_pings_are_answered_while_waiting_and_between_requests(monkeypatch):
    monkeypatch.setattr(client, "IDLE_TICK_S", 0.02)
    pongs = threading.Semaphore(0)

    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.PING, b"one", 0))
        if got.type == wire.PONG:
            assert got.payload in (b"one", b"two")
            pongs.release()
            return True
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        env.step(1)
        assert pongs.acquire(timeout=ENDS_S)
        data = frame(wire.PING, b"two", 0)
        server.open[0].sendall(data[:20])
        time.sleep(0.1)
        server.open[0].sendall(data[20:])
        assert pongs.acquire(timeout=ENDS_S)
        assert env.step(1)[1] == 2.0
        env.close()
        assert not server.errors


def test_a_peer_that_answers_no_ping_is_gone():
    def before(server, sock, got):
        return server.connections == 1 and got.type in (wire.STEP, wire.PING)
    with ToyServer(before=before, heartbeat_s=0.3) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        begun = time.monotonic()
        assert env.step(1)[1] == 1.0
        assert time.monotonic() - begun < env.unwrapped.connection.timeout / 2 and server.connections == 2 and server.steps == 1
        env.close()


def test_frames_that_come_in_many_pieces():
    space = spaces.Box(0, 255, (300, 300, 3), np.uint8)
    with ToyServer(observation=space) as server:
        first, second = play(server.url), play(server.url)
        assert first.size == 4 * 300 * 300 * 3 + 3 and (first == second).all()


def test_goaway():
    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.GOAWAY, wire.dump_json({"reason": "the level ends", "retry_after_s": 5}), 0))
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        assert env.step(1)[1] == 1.0
        with pytest.raises(ConnectionLost, match="the level ends"):
            env.step(1)


def test_a_connection_that_is_dropped_ends_its_thread(monkeypatch):
    monkeypatch.setattr(client, "IDLE_TICK_S", 0.02)
    with ToyServer() as server:
        before = set(threading.enumerate())
        env = consac.make(server.url, protocol=2)
        thread, = (thread for thread in set(threading.enumerate()) - before if thread.name == "consac-keepalive")
        del env
        thread.join(ENDS_S)
        assert not thread.is_alive()


@pytest.mark.parametrize("change", [{"environments": 0}, {"environments": 1 << 40}, {"environments": "x"}, {"behaviours": []}, {"behaviours": [{}]}, {"autoreset": "never"}, {"behaviours": 3}])
def test_specs_that_cannot_be(change):
    with ToyServer(spec=change) as server:
        with pytest.raises(ConsacError):
            consac.make(server.url, protocol=2)


def box(shape, dtype="F32"):
    return {"type": "box", "shape": shape, "dtype": dtype, "low": 0, "high": 1}


@pytest.mark.parametrize("change", [
    {"behaviours": [{"name": "a", "agents": ["b"], "observation": box([1 << 20, 1 << 20]), "action": box([1])}]},
    {"behaviours": [{"name": f"a{i}", "agents": ["b"], "observation": box([1 << 20]), "action": box([1])} for i in range(100)]},
    {"behaviours": [{"name": "a", "agents": ["b"], "observation": box([1 << 24], "F64"), "action": box([1])}]},
    {"behaviours": [{"name": "a", "agents": ["b"], "observation": {"type": "multi_binary", "n": 1 << 40}, "action": box([1])}]},
    {"environments": 1 << 40, "behaviours": [{"name": "a", "agents": [f"b{i}" for i in range(99)], "observation": box([1]), "action": box([1])}]},
], ids=["one space", "a hundred spaces", "wide numbers", "bits", "environments"])
def test_a_small_spec_makes_no_large_arrays(change):
    tracemalloc.start()
    try:
        with ToyServer(spec=change) as server:
            with pytest.raises(ProtocolError, match="max_frame|at most"):
                consac.make(server.url, protocol=2)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()


def test_a_forgotten_environment_says_bye():
    with ToyServer() as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        del env
        until(lambda: server.log[-1][1] == wire.BYE, "BYE")


def test_an_interrupted_step_is_not_the_end():
    import _thread

    interrupted = threading.Event()

    def before(server, sock, got):
        if got.type == wire.STEP and server.connections == 1:
            _thread.interrupt_main()
            assert interrupted.wait(ENDS_S)  # the step is not over before
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        with pytest.raises(KeyboardInterrupt):
            env.step(1)
        interrupted.set()
        until(lambda: server.steps == 1, "the interrupted step")
        assert env.step(1)[1] == server.steps == 2
        env.close()


def test_rllib(monkeypatch, serve_env):
    import types

    from consac import rllib

    class Recreate(Exception):
        pass

    url = serve_env("CartPole-v1")
    with pytest.raises(ConsacError, match="env_config"):
        rllib.env_creator({})
    env = rllib.env_creator({"urls": [url], "protocol": 2, "max_episode_steps": 9, "shared_memory": False})
    env.reset(seed=1)
    env.step(0)
    monkeypatch.setattr(env.unwrapped.connection, "resume", None)
    env.unwrapped.connection._socket.shutdown(2)
    monkeypatch.setitem(sys.modules, "ray.rllib.utils.error", types.SimpleNamespace(StepFailedRecreateEnvError=Recreate))
    for name in ("ray", "ray.rllib", "ray.rllib.utils"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    with pytest.raises(Recreate, match="went away"):
        env.step(0)


def test_rllib_takes_a_free_engine_or_all_environments_of_one(serve_env):
    from consac import rllib

    full, free = serve_env("CartPole-v1", limits=Limits(max_sessions=1)), serve_env("CartPole-v1")
    first = rllib.env_creator({"urls": [full, free]})
    second = rllib.env_creator({"urls": [full, free]})
    assert [env.unwrapped.connection.url for env in (first, second)] == [full, free]
    with pytest.raises(EngineBusy):
        rllib.env_creator({"url": full})
    url = serve_env("CartPole-v1", envs=3)
    envs = rllib.env_creator({"url": url, "num_envs": 3})
    assert envs.num_envs == 3 and envs.reset(seed=1)[0].shape == (3, 4)
    assert envs.step(np.zeros(3, np.int64))[1].tolist() == [1, 1, 1]
    assert envs.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    with pytest.raises(ConsacError, match="has 3 environments, not 2"):
        rllib.env_creator({"url": url, "num_envs": 2})
    for env in (first, second, envs):
        env.close()


# ---- text protocol 1

def walk(env, steps, seed=None):
    observation, _ = env.reset(seed=seed)
    episodes = 0
    for _ in range(steps):
        assert observation in env.observation_space
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert type(reward) is float and type(terminated) is bool and truncated is False and info == {}
        if terminated:
            episodes += 1
            observation, _ = env.reset()
    return episodes


def test_text_protocol_1_from_plain_python():
    process = subprocess.Popen([sys.executable, "-u", ROOT / "examples/thesis_server.py", "--port", "0", "--steps", "300"], stdout=subprocess.PIPE, text=True)
    try:
        port = process.stdout.readline().split()[-1]
        env = consac.make(f"tcp://127.0.0.1:{port}")
        assert env.observation_space == spaces.Box(0, 40, (2,), np.float32) and env.action_space == spaces.Discrete(3)
        with pytest.warns(UserWarning, match="no seeds"):
            assert walk(env, 300, seed=1) > 0
        with pytest.raises(ConnectionLost, match="300 steps"):
            env.step(1)
        env.close()
        assert process.wait(ENDS_S) == 0
    finally:
        process.kill()
        process.wait()


def test_text_protocol_1_from_consac_serve(serve_env):
    url = serve_env("Pendulum-v1", protocol="text1", training_length=1000, limits=Limits(grace_s=ENDS_S))
    env = consac.make(url)
    assert walk(env, 450) == 2
    env.reset()  # in the middle of an episode: a new connection
    walk(env, 10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(env, skip_close_check=True)  # which would be a second trainer
    env.close()


def test_an_old_and_slow_engine_is_met_without_hello():
    import socket

    listener = socket.create_server(("127.0.0.1", 0))
    said, got = b"D#2#0#B#1#0,3.4028235e+38#10\n1#0#0\n", []

    def engine():
        slow, _ = listener.accept()
        got.append(slow.recv(100))  # so slow that HELLO has come before it speaks
        slow.sendall(said)
        listener.accept()[0].sendall(said)
    threading.Thread(target=engine, daemon=True).start()
    env = consac.make(f"tcp://127.0.0.1:{listener.getsockname()[1]}")
    assert env.observation_space == spaces.Box(0, np.inf, (1,), np.float32)
    assert env.reset()[0] == [1]
    env.close()
    listener.close()
    assert got[0].startswith(b"\xc0NSC")


@pytest.mark.parametrize("setup, message", {
    b"busy: another trainer\n": "serves another", b"D#2#0#B#1#0,1\n": "fields", b"D#0#0#B#1#0,1#5\n": "size", b"D#2#0#B#2#0,1#5\n": "numbers",
    b"D#2#0#B#1#1,0#5\n": "above", b"D#2#0#C#1#1,0#5\n": "expected D or B", b"D#2#0#B#1#0,1#x\n": "whole", b"D#2#0#B#1#0,nan#4\n": "finite",
    b"D#2#0#B#1#0,4_0#4\n": "no number", b"D#2#0#B#1#0,1#0#\x1b[31m\n": "does not show"}.items())
def test_setups_that_are_wrong(setup, message):
    with ToyServer(first=setup) as server:
        with pytest.raises(ConsacError, match=message):
            consac.make(server.url)


@pytest.mark.parametrize("observation, message", {
    b"1#0\n": "fields", b"1,2#0#0\n": "numbers", b"5#0#0\n": "outside", b"1#x#0\n": "no number", b"1#1_0#0\n": "no number", b"1#0#2\n": "done is", b"error: no\n": "error: no", b"\xff#0#0\n": "no text"}.items())
def test_observations_that_are_wrong(observation, message):
    with ToyServer(first=b"D#2#0#B#1#0,3#10\n" + observation) as server:
        env = consac.make(server.url)
        with pytest.raises(ProtocolError, match=message):
            env.reset()
