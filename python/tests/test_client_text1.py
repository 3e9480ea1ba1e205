"""The client of text protocol 1: engines old, slow and wrong."""
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env

import consac
from consac.errors import ConnectionLost, ConsacError, ProtocolError
from consac.serve import Limits
from toy_server import ToyServer
from waiting import ENDS_S

ROOT = Path(__file__).resolve().parents[2]


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
