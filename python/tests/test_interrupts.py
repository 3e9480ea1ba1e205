"""Ctrl-C: at every bytecode of a request and of what mends an interrupted one, and as SIGINTs from outside, the client stays usable."""
import contextlib
import pathlib
import random
import re
import signal
import subprocess
import sys
import threading
import time

import gymnasium
import numpy as np
import pytest

import consac
import toy_worlds
from consac import shared_memory
from consac.serve import Limits, Server
from program import OUR_ENVIRONMENT, OUR_SERVE, PROGRAM, needs_program, run
from toy_server import ToyServer
from waiting import ENDS_S

PACKAGE = pathlib.Path(consac.__file__).parent
in_both_ways = pytest.mark.parametrize("memory", [False, pytest.param(True, marks=pytest.mark.skipif(not shared_memory.AVAILABLE, reason="no shared memory here"))], ids=["tcp", "memory"])
SIGNALS = 120


# ---- every bytecode

def interrupted(act, at):
    """Whether `act` was interrupted: KeyboardInterrupt is raised before the bytecode number `at` that it runs in the client's own files."""
    left = at

    def trace(frame, event, _):
        nonlocal left
        if not frame.f_code.co_filename.startswith(str(PACKAGE)) or "serve" in frame.f_code.co_filename:
            return None
        frame.f_trace_opcodes, frame.f_trace_lines = True, False
        if event == "opcode":
            left -= 1
            if left == 0:
                raise KeyboardInterrupt
        return trace

    sys.settrace(trace)
    try:
        act()
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(None)
    return False


class Counter(gymnasium.Env):
    """An observation is the number of steps in the episode."""

    observation_space, action_space = gymnasium.spaces.Box(0, 1e6, (1,), np.float32), gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        self.steps = 0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.steps += 1
        return np.full(1, self.steps, np.float32), 1.0, False, False, {}


def stays_usable(env):
    """The step after an interrupted one is answered, and a new episode counts from its beginning."""
    first = env.step(0)[0][0]
    assert env.step(0)[0][0] == first + 1
    assert env.reset()[0][0] == 0
    assert [env.step(0)[0][0] for _ in range(3)] == [1, 2, 3]


@in_both_ways
@pytest.mark.parametrize("what", ["step", "reset"])
def test_an_interrupt_at_any_bytecode_of_a_request(memory, what):
    with Server(Counter, limits=Limits(max_sessions=1000)) as server, contextlib.ExitStack() as opened:
        begin = lambda: opened.enter_context(consac.make(f"tcp://127.0.0.1:{server.port}", protocol=2, shared_memory=memory))
        env, at = begin(), 1
        env.reset()
        while interrupted((lambda: env.step(0)) if what == "step" else env.reset, at):
            stays_usable(env)
            if not env.connection.in_memory and memory:  # what was taken up goes on over TCP
                env.close()
                env = begin()
                assert env.connection.in_memory
                env.reset()
            at += 1
        assert at > 20


@in_both_ways
def test_an_interrupt_at_any_bytecode_of_what_mends_one(memory):
    with Server(Counter) as server, consac.make(f"tcp://127.0.0.1:{server.port}", protocol=2, shared_memory=memory) as env:
        env.reset()
        at = 1
        while True:
            assert interrupted(lambda: env.step(0), 15)
            if not interrupted(lambda: env.step(0), at):
                break
            stays_usable(env)
            at += 1
        assert at > 100


def test_an_interrupt_before_the_first_reset_and_an_engine_that_keeps_no_session():
    with ToyServer(keep=False) as server, consac.make(server.url, protocol=2) as env:
        at = 1
        while interrupted(env.reset, at):
            env.reset()
            assert env.step(0)[1] == 1.0
            at += 1
        assert at > 20
        at = 1
        while True:
            assert interrupted(lambda: env.step(0), 15)
            if not interrupted(env.reset, at):
                break
            env.reset()
            assert env.step(0)[1] == 1.0
            at += 1
        assert at > 100


@pytest.mark.parametrize("steps", [0, 3], ids=["first", "later"])
def test_a_step_may_follow_a_reset_that_was_answered_and_not_looked_at(monkeypatch, steps):
    """Nothing is known of the states before it, least of all that they were those of an episode that is over (R66)."""
    with Server(toy_worlds.Counter) as server, consac.make(f"tcp://127.0.0.1:{server.port}", protocol=2) as env:
        if steps:
            env.reset()
            assert [env.step(0)[2] for _ in range(steps)][-1]

        def interrupt(*_, **__):
            raise KeyboardInterrupt

        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(env.unwrapped.connection, "_check", interrupt)
            env.unwrapped.connection.reset()
        env.unwrapped.connection.step()
        env.reset()
        assert env.step(0)[0][0] == 1


@pytest.mark.parametrize("what", ["step", "reset"])
def test_an_interrupted_request_of_text_protocol_1_is_mended_by_reset(what):
    with Server(Counter, protocol="text1", training_length=1 << 30, limits=Limits(grace_s=ENDS_S)) as server, consac.make(f"tcp://127.0.0.1:{server.port}", protocol="text1") as env:
        env.reset()
        at = 1
        while interrupted((lambda: env.step(1)) if what == "step" else env.reset, at):
            with contextlib.suppress(consac.ConsacError):  # which says that the episode is over
                env.step(1)
            for _ in range(2):
                assert env.reset()[0][0] == 0
                assert [env.step(1)[0][0] for _ in range(3)] == [1, 2, 3]
            at += 1
        assert at > 20


# ---- signals from outside

def test_our_server_is_told_to_end_without_a_lock():
    """By a signal's handler: were it to come while its own thread holds that lock, it would wait for itself for ever."""
    server = Server(Counter)
    with server._lock, server._text_lock, server._refusals._lock, server._failures._lock:
        ending = threading.Thread(target=server.end, daemon=True)
        ending.start()
        ending.join(ENDS_S)
        assert not ending.is_alive()
    server.run()  # to its end, at once
    server.close()


PROBE = """
import contextlib, os, sys
import numpy as np
import consac

url, memory, signals = sys.argv[1], sys.argv[2] == "True", int(sys.argv[3])
actions = [np.array([i % 2, 1], np.int64) for i in range(4)]

def episode(envs):
    return [envs.reset(seed=7)[0]] + [envs.step(action)[0] for action in actions]

def begin():
    envs = consac.make_vec(url, protocol=2, shared_memory=memory)
    assert envs.connection.in_memory == memory
    return envs

envs = begin()
expected = episode(envs)
for number in range(signals):
    try:
        os.write(1, b"!")
        while True:
            envs.step(actions[0])
            if number % 3 == 0:
                envs.reset(seed=number)
    except KeyboardInterrupt:
        pass
    if number % 4 == 0:
        continue  # the next signal meets what mends this one
    if number % 2:
        envs.step(actions[1])
    assert np.array_equal(episode(envs), expected), number
    if memory:
        envs.close()
        envs = begin()
        envs.reset()
assert np.array_equal(episode(envs), expected)
envs.close()
os.write(1, b".")
"""


def torment(url, memory):
    """Interrupts a client `SIGNALS` times, each at a random moment of the time that it asks for one."""
    moment = random.Random(1)
    probe = subprocess.Popen([sys.executable, "-c", PROBE, url, str(memory), str(SIGNALS)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=OUR_ENVIRONMENT)
    with probe:
        while probe.stdout.read(1) == b"!":
            end = time.perf_counter() + moment.uniform(0, 0.004)
            while time.perf_counter() < end:
                pass
            probe.send_signal(signal.SIGINT)
        said = probe.stderr.read().decode()
    assert probe.returncode == 0, said


def torment_server(command, memory):
    """Torments a client of the server that `command` starts; its first line ends with the port that it serves on."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=OUR_ENVIRONMENT) as server:
        try:
            torment(f"tcp://127.0.0.1:{int(re.search(r':([0-9]+)', server.stdout.readline())[1])}", memory)
        finally:
            server.terminate()


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no job ignores signals here")
def test_signals_reach_the_tests_though_whoever_began_them_ignores_them():
    """As a job in the background of a script does: without this the interrupts below would be waited for in vain."""
    def ignore():
        for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
            signal.signal(number, signal.SIG_IGN)
    done = run([sys.executable, "-c", "import signal, conftest; print([signal.getsignal(number).name for number in (signal.SIGHUP, signal.SIGQUIT)], signal.getsignal(signal.SIGINT).__name__)"],
               preexec_fn=ignore, cwd=pathlib.Path(__file__).parent, env=OUR_ENVIRONMENT)
    assert done.stdout == "['SIG_DFL', 'SIG_DFL'] default_int_handler\n", done.stderr


@in_both_ways
def test_signals_from_outside_against_our_server(memory):
    torment_server([*OUR_SERVE, "CartPole-v1", "--envs", "2", "--port", "0", "--no-render"], memory)


@needs_program
@in_both_ways
def test_signals_from_outside_against_consac_serve(memory):
    torment_server([PROGRAM, "serve", "cartpole-v1", "--envs", "2", "--port", "0"], memory)
