"""What an engine or a user may do to the client: floods, JSON that is slow to read, values of the wrong kind, forks and copies."""
import contextlib
import copy
import importlib.util
import inspect
import json
import os
import pickle
import random
import select
import socket
import struct
import threading
import time

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import consac
from consac import wire
from consac.errors import ConnectionLost, ConsacError, DeadlineExceeded, ProtocolError
from consac.layout import Behaviour, Layout
from consac.line import Line
from consac.model_file import ModelError, read_model
from consac.options import Options
from consac.serve import Server
from consac.serve.text1 import TextReader
from played import frame
from toy_server import ToyServer


# ---- floods

@contextlib.contextmanager
def flood(setup, bytes_of_it):
    """An engine that sends `setup(socket)` and then so much that the client is never out of bytes."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve():
        sock, _ = listener.accept()
        with contextlib.suppress(OSError), sock:
            setup(sock)
            while True:
                sock.sendall(bytes_of_it)
    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"
    listener.close()
    thread.join(20)
    assert not thread.is_alive()


def answered(sock, last):
    """Answers as the toy engine does up to the request `last`, which only a flood answers."""
    toy = ToyServer.__new__(ToyServer)
    toy.__dict__.update(observation=Layout.of(spaces.Box(-1, 1, (8,), np.float32)), action=Layout.of(spaces.Discrete(2)), length=10, fault=None, before=None, capacity=None, keep=True,
                        heartbeat_s=10, spec={}, capabilities=[], steps=0, sessions={}, log=[])
    from toy_server import Talk

    talk, reader = Talk(toy, sock, 1), wire.FrameReader(wire.LARGEST_FRAME)
    while True:
        got = reader.next()
        if got is None:
            reader.feed(sock.recv(65536))
        elif got.type == wire.HELLO:
            talk.hello(wire.load_json(got.payload))
        elif got.request == last:
            return
        else:
            talk.request(got)


def test_a_flood_of_pings_does_not_defeat_the_deadline():
    pings = frame(wire.PONG, b"", 0) * 20_000 + frame(wire.PING, b"", 0)
    with flood(lambda sock: answered(sock, 3), pings) as url, consac.make(url, protocol=2, resume_s=0.1) as env:
        env.reset()
        env.unwrapped.connection.timeout = 0.5
        begun = time.monotonic()
        with pytest.raises((DeadlineExceeded, ConnectionLost)):
            env.step(0)
        assert time.monotonic() - begun < 30  # the deadline of others is 60 s


def test_a_flood_between_requests_does_not_keep_the_client():
    pings = frame(wire.PONG, b"", 0) * 2000
    with flood(lambda sock: None, pings) as url:
        sock = socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])))
        line = consac.Connection.__new__(consac.Connection)
        Line.__init__(line)
        line.closed, line.url, line.timeout = False, url, 1.0
        line._hold(sock, time.monotonic() + 1)
        assert select.select([sock], [], [], 10)[0]
        begun = time.thread_time()
        line._read_idle()
        assert time.thread_time() - begun < 2 and line._broken is None
        line._drop()
        line.closed = True


@pytest.mark.parametrize("setup", [b"", b"D#2#0#B#1#0,3#10\n"], ids=["in the setup", "in an observation"])
def test_a_flood_of_empty_lines_does_not_defeat_the_deadline(setup):
    with flood(lambda sock: sock.sendall(setup), b"\r\n" * 500_000) as url:
        begun = time.monotonic()
        with pytest.raises(DeadlineExceeded):
            consac.make(url, protocol="text1", timeout=0.5).reset()
        assert time.monotonic() - begun < 30  # the deadline of others is 60 s


# ---- JSON

SLOW = {
    "many objects": b'{"a":[' + b"{}," * 340_000 + b"{}]}",
    "one key twice behind many": b'{"a":{' + b",".join(b'"%d":0' % i for i in range(100_000)) + b',"99999":1}}',
    "quotes that never end": b'{"a":"' + b'\\"' * 500_000,
    "backslashes": b'{"a":"' + b"\\" * 1_000_000,
    "deep": b'{"a":' + b"[" * 500_000 + b"]" * 500_000 + b"}",
    "closed only": b'{"a":' + b"]" * 1_000_000,
    "digits": b'{"a":' + b"7" * 5000 + b"}",
    "more digits": b'{"a":-' + b"7" * 1_000_000 + b"}",
    "quotes": b'{"a":[' + b'"",' * 300_000 + b'""]}',
}


@pytest.mark.parametrize("kind", SLOW)
def test_json_is_read_or_refused_in_time_linear_in_its_size(kind):
    assert len(SLOW[kind]) <= wire.LARGEST_JSON
    begun = time.process_time()
    with pytest.raises(wire.WireError) as told:
        wire.load_json(SLOW[kind])
    assert told.value.code == "MALFORMED" and "\n" not in told.value.message and len(told.value.message) < 400
    assert time.process_time() - begun < 2


def test_json_is_as_deep_as_its_limit_and_strings_do_not_count():
    deepest = lambda levels: b'{"a":' * (levels - 1) + b"{}" + b"}" * (levels - 1)
    assert wire.load_json(deepest(wire.DEEPEST_JSON)) and wire.load_json(json.dumps({"a": "[{" * 100_000 + '\\"', "b\\": "\\\\"}).encode())
    with pytest.raises(wire.WireError, match=f"nested {wire.DEEPEST_JSON + 1} deep"):
        wire.load_json(deepest(wire.DEEPEST_JSON + 1))


def test_a_model_files_header_may_hold_more_than_a_message():
    numbers = lambda count: '{"a":[' + ",".join("1" * count) + "]}"
    with pytest.raises(wire.WireError, match="over 262144 values"):
        wire.load_json(numbers(300_000).encode())
    for count, found in ((300_000, "metadata|tensor|specification"), (1_100_000, "over 1048576 values")):
        header = numbers(count)
        data = struct.pack("<Q", len(header)) + header.encode()
        with pytest.raises(ModelError, match=found):
            read_model(data)


@pytest.mark.parametrize("text,choice", [("2", 2), ("+1", 1), ("0", 0), ("+", None), ("-1", None), ("++1", None), ("3", None), ("1_0", None)])
def test_a_choice_of_text_protocol_1(text, choice):
    reader = TextReader(None, spaces.Discrete(3), None)
    if choice is None:
        with pytest.raises(ValueError, match="from 0 to 2"):
            reader._value(text.encode())
    else:
        assert reader._value(text.encode()) == choice

NUMBERS = ["7" * 5000, "1e999", "-1", "1.5", '"x"', "null", "[]", "{}", "true", str(1 << 70), str(1 << 32), "-0.0", '"' + "7" * 5000 + '"']


@pytest.mark.parametrize("member", ["session", "max_frame", "heartbeat_s", "last_request", "resume", "capabilities", "protocol", "resumed"])
def test_a_welcome_with_anything_in_it(member):
    for number in NUMBERS:
        def before(server, sock, got):
            if got.type == wire.HELLO:
                said = {"protocol": 2, "server": "toy", "session": 1, "resume": "x", "capabilities": [], "max_frame": 1 << 20, "heartbeat_s": 10, "last_request": 0, "resumed": False}
                text = json.dumps(said | {member: "HERE"}).replace('"HERE"', number)
                sock.sendall(frame(wire.WELCOME, text.encode(), got.request))
                sock.shutdown(socket.SHUT_WR)
            return True
        with ToyServer(before=before) as server, pytest.raises(ConsacError):
            consac.make(server.url, protocol=2, resume_s=0.01, timeout=0.2)


def leaves(value, path=()):
    """Where the members of a JSON value are."""
    yield path
    for key, below in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from leaves(below, (*path, key))


def test_a_spec_with_anything_anywhere():
    odd = [None, -1, 1 << 70, 1.5, float("inf"), "x", "7" * 5000, [], {}, [1 << 70], True, [[]], {"a": 1}, 0]
    space = spaces.Dict(a=spaces.Box(-1, 1, (2,), np.float32), b=spaces.Discrete(3, start=1), c=spaces.MultiDiscrete([2, 3]), d=spaces.MultiBinary(2), e=spaces.Tuple([spaces.Discrete(2)]))
    behaviour = Behaviour("default", ["agent"], Layout.of(space), Layout.of(space), 1, True).to_json()
    spec = {"environments": 1, "behaviours": [behaviour], "max_episode_steps": 0, "autoreset": "same_step", "deterministic": True, "id": "x"}
    from consac.offer import read_spec

    assert read_spec(spec, "same_step", 1 << 26).environments == 1
    tried = 0
    for path in list(leaves(spec))[1:]:
        for value in odd:
            changed = copy.deepcopy(spec)
            at = changed
            for key in path[:-1]:
                at = at[key]
            at[path[-1]] = value
            try:
                read_spec(changed, "same_step", 1 << 26)
            except ProtocolError as error:
                assert "\n" not in str(error) and len(str(error)) < 2500
            tried += 1
    assert tried > 1000


def test_infos_of_any_kind_make_no_other_error():
    from consac.vector import columns

    values = [1, 1 << 70, -1.5, "x", None, [1], {"a": 1}, {"a": {"b": "c"}}, {}, True, [[], {}]]
    chance = random.Random(1)
    for _ in range(500):
        column = {"slots": [0, 2], "values": chance.choices(values, k=2)}
        assert columns({"key": column}, 3)["_key"].tolist() == [True, False, True]


# ---- what a user does

class Plain(gymnasium.Env):
    observation_space, action_space = spaces.Box(0, 1, (2,), np.float32), spaces.Discrete(3)

    def reset(self, *, seed=None, options=None):
        return np.zeros(2, np.float32), {}

    def step(self, action):
        return np.zeros(2, np.float32), 0.0, False, False, {}


@pytest.fixture(scope="module")
def url():
    with Server(Plain, 2) as server:
        yield f"tcp://127.0.0.1:{server.port}"


@pytest.fixture(scope="module")
def one():
    with Server(Plain) as server:
        yield f"tcp://127.0.0.1:{server.port}"


@pytest.mark.parametrize("seed", [-1, 1 << 63, 1 << 64, "x", 1.5, [0, -1], [0, 1 << 64]], ids=str)
def test_seeds_that_no_engine_takes(url, seed):
    with contextlib.closing(consac.make_vec(url)) as envs:
        with pytest.raises(ValueError, match="seed"):
            envs.reset(seed=seed)
        envs.reset(seed=(1 << 63) - 2)


@pytest.mark.parametrize("action", [np.array([1]), [1], 1.0, "1", None, 1 << 40, {}, [[1], [1, 2]]], ids=str)
def test_actions_that_are_none(one, action):
    with consac.make(one) as env:
        env.reset()
        with pytest.raises(ValueError, match="action"):
            env.step(action)
        env.step(np.int64(1))


@pytest.mark.parametrize("address", [6132, None, b"tcp://a:1", "http://a:1", "tcp://a", "tcp://[::1", "tcp://a:99999"], ids=str)
def test_addresses_that_are_none(address):
    with pytest.raises(ConsacError, match="tcp://host:port"):
        consac.make(address)


@pytest.mark.parametrize("attempt", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_copy_is_refused_in_words(url, one, attempt):
    with consac.make(one) as env, contextlib.closing(consac.make_vec(url)) as envs:
        for each in (env.connection, envs.connection):
            with pytest.raises(TypeError, match="cannot be copied or pickled; make another"):
                attempt(each)
        if attempt is copy.deepcopy:
            for each in (env, envs):
                with pytest.raises(TypeError, match="cannot be copied or pickled; make another"):
                    attempt(each)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("memory", [True, False])
def test_a_forked_process_does_not_step_its_parents_world(one, memory):
    with consac.make(one, shared_memory=memory) as env:
        env.reset()
        child = os.fork()
        if child == 0:
            try:
                env.step(0)
            except ConnectionLost as error:
                os._exit(0 if "forked" in str(error) else 1)
            finally:
                os._exit(2)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        for _ in range(3):
            env.step(0)


def test_everything_on_the_page_is_an_attribute():
    for name in ("pettingzoo", "sb3", "rllib", "serve", "policy", "errors", "wire"):
        assert name in dir(consac)
    assert consac.rllib.env_creator and consac.serve.Server and consac.policy.load_policy is consac.load_policy
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        consac.nothing


def test_every_option_is_an_argument_of_a_connection():
    assert {*Options.__annotations__, "self", "url", "autoreset", "sock"} == {*inspect.signature(consac.Connection.__init__).parameters}


def faces():
    yield consac.make
    yield consac.make_vec
    if importlib.util.find_spec("pettingzoo"):
        yield consac.ConsacParallelEnv
    if importlib.util.find_spec("stable_baselines3"):
        yield consac.ConsacVecEnv
    yield consac.connect


@pytest.mark.parametrize("options, error, why", [
    ({"tokn": "x"}, TypeError, "unknown argument 'tokn'; did you mean 'token'"), ({"frobnicate": 1}, TypeError, "'frobnicate'; there are .*timeout"), ({"token": 5}, TypeError, "token is a text"),
    ({"timeout": -1}, ValueError, "timeout=-1"), ({"timeout": float("nan")}, ValueError, "timeout=nan"), ({"timeout": 0}, ValueError, "timeout=0"), ({"timeout": 1e300}, ValueError, "seconds"),
    ({"timeout": "60"}, ValueError, "seconds"), ({"wait": -1}, ValueError, "wait=-1"), ({"resume_s": None}, ValueError, "resume_s"), ({"max_frame": 1}, ValueError, "max_frame=1"),
    ({"max_frame": 1 << 40}, ValueError, "max_frame"), ({"max_frame": 65536.0}, ValueError, "max_frame"),
], ids=str)
def test_arguments_that_are_unknown_or_out_of_range(one, options, error, why):
    for face in faces():
        with pytest.raises(error, match=why):
            face(one, **options)


def test_a_token_from_the_environment(monkeypatch):
    with Server(Plain, token="sesame") as server:
        url = f"tcp://127.0.0.1:{server.port}"
        with pytest.raises(consac.Refused, match="missing"):
            consac.make(url)
        monkeypatch.setenv("CONSAC_TOKEN", "sesame")
        consac.make(url).close()
        with pytest.raises(consac.Refused, match="another"):
            consac.make(url, token="open")
