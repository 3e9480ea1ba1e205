"""Frames through shared memory: between our client, `consac serve` and our own server, and what happens when one end goes away."""
import _thread
import contextlib
import importlib.util
import logging
import os
import signal
import subprocess
import threading
import time

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import consac
from consac import shared_memory
from consac.errors import ConnectionLost, DeadlineExceeded, EngineError
from consac.serve import Limits, Server
from program import OUR_ENVIRONMENT, OUR_SERVE, PROGRAM, needs_program, run
from waiting import ENDS_S, until

pytestmark = pytest.mark.skipif(not shared_memory.AVAILABLE, reason="shared memory is there on Linux with x86-64 only")


# ---- against `consac serve`

def trajectory(url, memory, mode, steps=300):
    """Everything that a vector environment says."""
    said = []
    with contextlib.closing(consac.make_vec(url, autoreset_mode=mode, shared_memory=memory)) as envs:
        assert envs.connection.in_memory == memory
        observations, _ = envs.reset(seed=7)
        rng, ended = np.random.default_rng(1), np.zeros(envs.num_envs, bool)
        for _ in range(steps):
            if mode == AutoresetMode.DISABLED and ended.any():
                observations, _ = envs.reset(options={"reset_mask": ended})
                said.append(observations)
            observations, rewards, terminated, truncated, infos = envs.step(rng.integers(0, 2, envs.num_envs))
            ended = terminated | truncated
            said += [observations, rewards, terminated, truncated] + [final for final in infos.get("final_obs", ()) if final is not None]
    return said


@needs_program
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_memory_and_tcp_say_the_same(serve, mode):
    url = serve("cartpole-v1", "--envs", "5")
    one, other = trajectory(url, True, mode), trajectory(url, False, mode)
    assert len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other))


@needs_program
def test_one_world_says_the_same_and_its_observations_stay(serve):
    url, episodes = serve("pendulum-v1"), []
    for memory in (True, False):
        with consac.make(url, shared_memory=memory) as env:
            assert env.connection.in_memory == memory
            kept = [env.reset(seed=3)[0]]
            copies = [kept[0].copy()]
            for _ in range(100):
                kept.append(env.step(np.array([0.5], np.float32))[0])
                copies.append(kept[-1].copy())
            assert np.array_equal(kept, copies)
            episodes.append(np.array(kept))
    assert np.array_equal(*episodes)


@needs_program
def test_a_refused_action_and_then_a_good_one(serve):
    with consac.make(serve("cartpole-v1")) as env:
        env.reset(seed=1)
        with pytest.raises(EngineError, match="OUT_OF_RANGE"):
            env.step(7)
        assert env.connection.in_memory
        env.step(1)


@needs_program
def test_a_killed_engine_is_told_long_before_the_deadline(serve):
    with consac.make(serve("cartpole-v1")) as env:
        env.reset(seed=1)
        threading.Timer(0.2, serve.processes[0].kill).start()
        with pytest.raises(ConnectionLost):
            while True:
                begun = time.monotonic()
                if env.step(1)[2]:
                    env.reset()
        assert time.monotonic() - begun < env.connection.timeout / 2


@needs_program
def test_an_engine_that_stands_still_runs_into_the_deadline(serve):
    with consac.make(serve("cartpole-v1")) as env:
        env.reset(seed=1)
        env.connection.timeout = 0.3
        serve.processes[0].send_signal(signal.SIGSTOP)
        begun = time.monotonic()
        with pytest.raises(DeadlineExceeded):
            env.step(1)
        assert 0.25 < time.monotonic() - begun < 30  # the deadline of others
        serve.processes[0].send_signal(signal.SIGCONT)


@needs_program
def test_a_lost_connection_goes_on_over_tcp_and_no_step_is_carried_out_twice(serve):
    url, said = serve("pendulum-v1", "--envs", "3"), []
    for cut in (False, True):
        with contextlib.closing(consac.make_vec(url)) as envs:
            envs.reset(seed=5)
            for step in range(60):
                if cut and step == 20:
                    envs.connection._socket.shutdown(2)
                    with envs.connection._lock:  # what the watching thread would find
                        envs.connection._broken = ConnectionLost("cut on purpose")
                observations, rewards, *_ = envs.step(np.full((3, 1), 0.1 * (step % 7), np.float32))
                said.append((observations, rewards))
            assert envs.connection.in_memory != cut
    assert all(np.array_equal(a[0], b[0]) and np.array_equal(a[1], b[1]) for a, b in zip(said[:60], said[60:]))


@needs_program
def test_memory_that_cannot_be_mapped_is_done_without(serve, monkeypatch, caplog):
    def no(*_):
        raise PermissionError("no")

    monkeypatch.setattr(shared_memory.mmap, "mmap", no)
    with caplog.at_level(logging.DEBUG, "consac"), consac.make(serve("cartpole-v1")) as env:
        assert not env.connection.in_memory and "going on over TCP" in caplog.text
        env.reset(seed=1)
        assert env.step(1)[1] == 1.0


@needs_program
def test_a_pause_between_steps_longer_than_every_spin(serve):
    with consac.make(serve("cartpole-v1")) as env:
        env.reset(seed=1)
        for _ in range(10):
            time.sleep(0.05)
            assert env.step(1)[1] == 1.0


# ---- our own server

@contextlib.contextmanager
def served(world="CartPole-v1", envs=3, *arguments):
    """`python -m consac.serve` in a process of its own; its address and process."""
    process = subprocess.Popen([*OUR_SERVE, world, "--envs", str(envs), "--port", "0", "--no-render", *arguments], stdout=subprocess.PIPE, text=True, env=OUR_ENVIRONMENT)
    try:
        yield f"tcp://127.0.0.1:{int(process.stdout.readline().rpartition(':')[2])}", process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_our_server_says_the_same_in_memory(mode):
    with served() as (url, _):
        one, other = trajectory(url, True, mode), trajectory(url, False, mode)
    assert len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other))


def test_our_server_killed_is_told_long_before_the_deadline():
    with served(envs=1) as (url, process), consac.make(url) as env:
        env.reset(seed=1)
        assert env.connection.in_memory
        process.kill()
        begun = time.monotonic()
        with pytest.raises(ConnectionLost):
            env.step(1)
        assert time.monotonic() - begun < env.connection.timeout / 2


def test_our_server_goes_on_over_tcp_where_the_connection_was_lost():
    with served() as (url, _), contextlib.closing(consac.make_vec(url)) as envs:
        envs.reset(seed=5)
        for step in range(30):
            if step == 10:
                envs.connection._broken = ConnectionLost("cut on purpose")
            envs.step(np.array([0, 1, step % 2]))
        assert not envs.connection.in_memory


class Talkative(gymnasium.Env):
    """Infos of many sizes, and one action that it does not bear."""

    observation_space, action_space = gymnasium.spaces.Box(-1, 1, (2,), np.float32), gymnasium.spaces.Discrete(100_000)

    def reset(self, *, seed=None, options=None):
        return np.zeros(2, np.float32), {"options": str(options)}

    def step(self, action):
        if action == 13:
            raise RuntimeError("not this one")
        return np.full(2, 1 / (1 + action), np.float32), float(action), False, False, {"text": "x" * int(action)}


def test_what_does_not_fit_in_memory_goes_over_tcp():
    with Server(Talkative) as server, consac.make(f"tcp://127.0.0.1:{server.port}") as env:
        assert env.connection.in_memory
        for size in (0, 1000, 99_000, 5, 99_999, 99_998, 0):
            observation, reward, _, _, info = env.step(size) if size else (*env.reset(options={"map": "y" * 2000})[:1], 0.0, False, False, {"text": ""})
            assert reward == size and len(info["text"]) == size and observation[0] == np.float32(1 / (1 + size) if size else 0)
        with pytest.raises(EngineError, match="ENV_FAILED.*not this one"):
            env.step(13)
        with pytest.raises(EngineError, match="RESET_REQUIRED"):
            env.step(1)
        assert env.reset()[1] == {"options": "None"} and env.connection.in_memory


def test_a_server_that_closes_says_so():
    with Server(lambda: gymnasium.make("CartPole-v1")) as server:
        env = consac.make(f"tcp://127.0.0.1:{server.port}")
        env.reset(seed=1)
        env.step(1)
        server.close()
        with pytest.raises(ConnectionLost):
            env.step(1)


def test_every_face_asks_for_memory():
    from consac.rllib import env_creator

    faces = [consac.make, consac.make_vec, lambda url: env_creator({"url": url}), lambda url: consac.make("tcp://localhost:" + url.rpartition(":")[2])]
    if importlib.util.find_spec("stable_baselines3"):
        faces.append(consac.ConsacVecEnv)
    if importlib.util.find_spec("pettingzoo"):
        faces.append(consac.ConsacParallelEnv)
    with Server(lambda: gymnasium.make("CartPole-v1")) as server:
        for face in faces:
            env = face(f"tcp://127.0.0.1:{server.port}")
            assert getattr(env, "unwrapped", env).connection.in_memory
            env.reset()
            env.close()


def test_the_descriptor_goes_with_its_session():
    with Server(lambda: gymnasium.make("CartPole-v1")) as server:
        before = len(os.listdir("/proc/self/fd"))
        for _ in range(5):
            with consac.make(f"tcp://127.0.0.1:{server.port}") as env:
                env.reset(seed=1)
        del env  # whose rows lie in the last region
        until(lambda: len(os.listdir("/proc/self/fd")) <= before, "the end of the descriptors")


@needs_program
@pytest.mark.parametrize("envs", [1, 4])
def test_consac_train_in_memory_with_python_worlds(tmp_path, envs):
    with served("CartPole-v1", envs) as (url, _):
        done = run([PROGRAM, "train", url, "--steps", "2000", "--dir", tmp_path, "--no-tensorboard"])
    assert done.returncode == 0, done.stderr
    assert "in shared memory" in done.stdout + done.stderr


class Hung(gymnasium.Env):
    """Its tenth step ends with the test."""

    observation_space, action_space, over = gymnasium.spaces.Box(0, 1, (1,), np.float32), gymnasium.spaces.Discrete(2), None

    def reset(self, *, seed=None, options=None):
        self.steps = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.steps += 1
        if self.steps == 10:
            self.over.wait(ENDS_S)
        return np.zeros(1, np.float32), 0.0, False, False, {}


@needs_program
@pytest.mark.parametrize("memory", [True, False])
def test_a_hung_environment_ends_the_training_at_its_deadline(tmp_path, memory, monkeypatch):
    """Though the server sends PINGs, since it is alive."""
    monkeypatch.setattr(Hung, "over", threading.Event())
    if not memory:
        monkeypatch.setattr(shared_memory, "AVAILABLE", False)
    with Server(Hung, limits=Limits(heartbeat_s=0.2)) as server:
        try:
            done = run([PROGRAM, "train", f"tcp://127.0.0.1:{server.port}", "--steps", "2000", "--dir", tmp_path, "--no-tensorboard", "--deadline", "1"])
        finally:
            Hung.over.set()
    assert done.returncode != 0 and "is silent for 1 s" in done.stderr, done.stderr
    assert ("in shared memory" in done.stdout + done.stderr) == memory


class Slow(gymnasium.Env):
    """Counts its steps, of which number 2 takes as long as the test wants."""

    observation_space, action_space = gymnasium.spaces.Box(0, 99, (1,), np.float32), gymnasium.spaces.Discrete(2)

    def __init__(self, pause):
        self.pause = pause

    def reset(self, *, seed=None, options=None):
        self.steps = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.steps += 1
        if self.steps == 2:
            self.pause()
        return np.full(1, self.steps, np.float32), 0.0, False, False, {}


def test_an_interrupted_step_is_not_the_end():
    interrupted = threading.Event()

    def interrupt():
        _thread.interrupt_main()
        assert interrupted.wait(ENDS_S)  # the step is not over before

    with Server(lambda: Slow(interrupt)) as server, consac.make(f"tcp://127.0.0.1:{server.port}") as env:
        env.reset()
        env.step(0)
        with pytest.raises(KeyboardInterrupt):
            env.step(0)
        interrupted.set()
        assert env.step(0)[0] == 3 and not env.connection.in_memory


def test_pings_are_answered_while_a_step_takes_long():
    with Server(lambda: Slow(lambda: time.sleep(4.0)), limits=Limits(heartbeat_s=1.0)) as server, consac.make(f"tcp://127.0.0.1:{server.port}") as env:
        env.reset()  # four heartbeats: three unanswered ones would end the connection
        assert [env.step(0)[0] for _ in range(3)] == [1, 2, 3] and env.connection.in_memory


@needs_program
@pytest.mark.parametrize("shared", [True, False])
def test_a_refused_step_leaves_the_rows_that_are_repeated(serve, shared):
    with contextlib.closing(consac.make_vec(serve("cartpole-v1", "--envs", "3"), autoreset_mode="disabled", shared_memory=shared)) as envs:
        envs.reset(seed=4)
        before = envs.step(np.array([0, 1, 0]))[0].copy()
        with pytest.raises(EngineError):  # by the engine, not by us
            envs.step(np.array([0, 7, 0]))
        after = envs.reset(options={"reset_mask": np.array([True, False, False])})[0]
        assert np.array_equal(after[1:], before[1:]) and not np.array_equal(after[0], before[0])
