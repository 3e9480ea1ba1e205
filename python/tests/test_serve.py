"""consac.serve spoken to in raw frames: states, limits, exactly-once, resuming, autoreset, text protocol 1."""
import errno
import hashlib
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import tracemalloc
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from consac import wire
from consac.address import ready
from consac.client import connect
from consac.layout import Layout
from consac.serve import Limits, Server
from consac.serve.limits import TICK
from consac.serve.refusal import Refusals
from consac.wire import BYE, CONFIGURE, ERROR, FRAME, GOAWAY, HELLO, PING, PONG, RENDER, RESET, RESULT, SPEC, STEP, WELCOME, Frame, pack
from program import OUR_ENVIRONMENT, OUR_SERVE, run
from waiting import ENDS_S, until

try:
    import resource
except ImportError:  # Windows
    resource = None

PATIENT = Limits(grace_s=ENDS_S)  # nobody is taken for a trainer of text protocol 1 because the machine is slow


class Counter(gymnasium.Env):
    """Counts steps; ends after `length`, terminated for action 0 and truncated for others."""

    observation_space = spaces.Box(0, 1000, (2,), np.float32)
    action_space = spaces.Discrete(3)
    metadata = {"render_modes": ["rgb_array"]}
    render_mode = "rgb_array"
    length = 3

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.count = 0
        self.mark = int(self.np_random.integers(1000))
        return self._see(), {"from": "reset"} | ({"options": options} if options else {})

    def step(self, action):
        assert self.action_space.contains(action)
        self.count += 1
        over = self.count >= self.length
        return self._see(), 0.1 * self.count, over and action == 0, over and action != 0, {"count": self.count, "odd": np.float32("nan"), "list": np.arange(2)}

    def _see(self):
        return np.array([self.count, self.mark], np.float32)

    def render(self):
        return np.full((2, 3, 3), self.count, np.uint8)


class Nested(gymnasium.Env):
    """All kinds of leaves; shows what it was sent; masks nothing."""

    inside = spaces.Dict({"b": spaces.Box(-1, 1, (2, 2), np.float64), "a": spaces.Discrete(3, start=-1),
                          "t": spaces.Tuple([spaces.MultiDiscrete([2, 3]), spaces.MultiBinary(3), spaces.Box(0, 255, (3,), np.uint8)])})
    observation_space = action_space = inside

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.inside.seed(3)
        return self.inside.sample(), {}

    def step(self, action):
        assert self.inside.contains(action)
        return action, 1.5, False, False, {}


class Masked(Counter):
    def reset(self, **arguments):
        return super().reset(**arguments)[0], {"action_mask": np.array([1, 0, 1], np.int8)}

    def step(self, action):
        return (*super().step(action)[:4], {"action_mask": np.array([0, 1, 0], np.int8)})


class Failing(Counter):
    def step(self, action):
        if action == 2:
            raise RuntimeError("the motor burnt out")
        return super().step(action)


class Agents:
    """Three agents in PettingZoo's parallel form; agent k lives k + 2 steps; two kinds of spaces."""

    metadata = {"name": "three"}
    possible_agents = ["red_0", "red_1", "blue_0"]

    def observation_space(self, agent):
        return spaces.Box(-9, 9, (1 if agent.startswith("red") else 2,), np.float32)

    def action_space(self, agent):
        return spaces.Discrete(2)

    def _see(self):
        return {agent: np.full(self.observation_space(agent).shape, self.time, np.float32) for agent in self.agents}

    def reset(self, seed=None, options=None):
        self.agents, self.time = list(self.possible_agents), 0
        return self._see(), {agent: {"at": 0} for agent in self.agents}

    def step(self, actions):
        assert sorted(actions) == sorted(self.agents)
        self.time += 1
        seen, rewards = self._see(), {agent: float(self.time) for agent in self.agents}
        ended = {agent: self.time >= self.possible_agents.index(agent) + 2 for agent in self.agents}
        infos = {agent: {"at": self.time} for agent in self.agents}
        self.agents = [agent for agent in self.agents if not ended[agent]]
        return seen, rewards, ended, {agent: False for agent in ended}, infos

    def close(self):
        pass


class Raw:
    """A client of a few lines."""

    def __init__(self, server, hello=None, **configure):
        self.sock = socket.create_connection(("127.0.0.1", getattr(server, "port", server)), timeout=ENDS_S)
        self.reader, self.number, self.session = wire.FrameReader(wire.LARGEST_FRAME), 0, 0
        self.welcome = self.spec = None
        if hello is not False:
            self.welcome = self.ask_json(HELLO, {"protocol": [2, 2], **(hello or {})})
            self.session = self.welcome.get("session", 0)
            if hello is None or not hello.get("resume"):
                self.spec = self.ask_json(CONFIGURE, configure)
            else:
                self.number = self.welcome.get("last_request", 0)

    def send(self, kind, payload=b"", request=None, session=None, flags=0):
        if request is None and kind == HELLO:
            request = 0
        if request is None:
            self.number += 1
        self.sock.sendall(pack(Frame(kind, payload, self.number if request is None else request, self.session if session is None else session, flags)))

    def take(self):
        while True:
            frame = self.reader.next()
            if frame is not None:
                return frame
            data = self.sock.recv(1 << 16)
            if not data:
                raise EOFError
            self.reader.feed(data)

    def ask(self, kind, payload=b"", **how):
        self.send(kind, payload, **how)
        frame = self.take()
        while frame.type == PING:  # which a slow machine has time for
            frame = self.take()
        assert frame.request == (0 if kind == HELLO and how.get("request") is None else self.number if how.get("request") is None else how["request"])
        return frame

    def ask_json(self, kind, value, **how):
        return json.loads(self.ask(kind, wire.dump_json(value), **how).payload)

    def error(self, kind, payload=b"", **how):
        frame = self.ask(kind, payload, **how)
        assert frame.type == ERROR, frame
        return json.loads(frame.payload)

    @property
    def envs(self):
        return self.spec["environments"]

    def reset(self, which=None, seeds=None, options=None):
        return Result(self, self.ask(RESET, reset_payload(self.envs, which, seeds, options)))

    def step(self, actions, which=None):
        return Result(self, self.ask(STEP, step_payload(self.envs, actions, which)))

    def is_closed(self):
        try:
            while True:
                self.take()
        except (EOFError, ConnectionError):
            return True

    def close(self):
        self.sock.close()


def pad(data):
    return data + bytes(-len(data) % 8)


def reset_payload(envs, which=None, seeds=None, options=None):
    out = struct.pack("<II", (seeds is not None) + 2 * (options is not None), 0) + bytes(which if which is not None else [1] * envs)
    if seeds is not None:
        out = pad(out) + struct.pack(f"<{envs}q", *seeds)
    if options is not None:
        text = wire.dump_json(options)
        out = pad(out) + struct.pack("<I", len(text)) + text
    return pad(out)


def step_payload(envs, actions, which=None):
    return pad(pad(bytes(8) + bytes(which if which is not None else [1] * envs)) + struct.pack(f"<{len(actions)}i", *actions))


class Result:
    """RESULT taken apart by the words of the specification, with nothing of the server's code."""

    def __init__(self, client, frame):
        assert frame.type == RESULT, json.loads(frame.payload)
        data, parts, at = frame.payload, struct.unpack_from("<II", frame.payload), 8
        assert parts[1] == 0
        self.behaviours = []
        for behaviour in client.spec["behaviours"]:
            slots, row = client.envs * len(behaviour["agents"]), behaviour["observation_row"]["bytes"]
            found = {}
            at = -(-at // 8) * 8
            found["rows"], at = [data[at + i * row:at + (i + 1) * row] for i in range(slots)], at + slots * row
            at = -(-at // 8) * 8
            found["rewards"], at = list(struct.unpack_from(f"<{slots}d", data, at)), at + 8 * slots
            found["states"], at = list(data[at:at + slots]), at + slots
            if behaviour["masks_actions"]:
                at = -(-at // 8) * 8
                size = behaviour["mask_bytes"]
                found["masks"], at = [list(data[at + i * size:at + (i + 1) * size]) for i in range(slots)], at + slots * size
            at = -(-at // 8) * 8
            self.behaviours.append(found)
        for behaviour, found in zip(client.spec["behaviours"], self.behaviours):
            if parts[0] & 1:
                row, count = behaviour["observation_row"]["bytes"], sum(state & 4 != 0 for state in found["states"])
                found["finals"], at = [data[at + i * row:at + (i + 1) * row] for i in range(count)], at + count * row
                at = -(-at // 8) * 8
        self.said = {}
        if parts[0] & 2:
            at = -(-at // 8) * 8
            size = struct.unpack_from("<I", data, at)[0]
            self.said, at = json.loads(data[at + 4:at + 4 + size]), at + 4 + size
            at = -(-at // 8) * 8
        assert at == len(data)
        self.rewards, self.states = self.behaviours[0]["rewards"], self.behaviours[0]["states"]

    def floats(self, name="rows", behaviour=0):
        return [np.frombuffer(row, "<f4").tolist() for row in self.behaviours[behaviour].get(name, [])]


@pytest.fixture(scope="module")
def counters():
    with Server(Counter, 2, limits=Limits(max_sessions=200)) as server:
        yield server


# ---- what an environment shows

def test_matches_native_cartpole_bit_by_bit():
    native = gymnasium.make("CartPole-v1")
    with Server("CartPole-v1", 1) as server:
        client = Raw(server, autoreset="disabled")
        assert (client.spec["id"], client.spec["max_episode_steps"]) == ("CartPole-v1", 500)
        assert client.spec["hash"] == hashlib.sha256(wire.canonical_json(client.spec["behaviours"])).hexdigest()
        rng = np.random.default_rng(1)
        for episode in range(5):
            seed = 7 if episode == 0 else None
            mine, _ = native.reset(seed=seed)
            theirs = client.reset(seeds=[seed] if seed else None)
            over = False
            assert theirs.behaviours[0]["rows"][0] == mine.tobytes() and theirs.states == [8 | 16]
            while not over:
                action = int(rng.integers(2))
                mine, reward, terminated, truncated, _ = native.step(action)
                theirs = client.step([action])
                over = terminated or truncated
                assert theirs.behaviours[0]["rows"][0] == mine.tobytes() and theirs.rewards == [reward]
                assert theirs.states == [terminated * 1 + truncated * 2 + (not over) * 16]


def test_nested_spaces_travel_whole():
    layout = Layout.of(Nested.inside)
    with Server(Nested, 2) as server:
        client = Raw(server)
        first = client.reset()
        Nested.inside.seed(3)
        expected = Nested.inside.sample()
        buffer = bytearray(b"".join(first.behaviours[0]["rows"]))
        views = layout.views(buffer, 2, 0)
        for leaf, view in zip(layout.leaves, views):
            assert np.array_equal(view[0], layout.pick(expected, leaf)) and np.array_equal(view[1], layout.pick(expected, leaf))
        sent = Nested.inside.sample()
        for leaf, view in zip(layout.leaves, views):
            view[:] = layout.pick(sent, leaf)
        head = pad(bytes(8) + b"\1\1")
        result = Result(client, client.ask(STEP, head + bytes(buffer)))
        assert b"".join(result.behaviours[0]["rows"]) == bytes(buffer) and result.rewards == [1.5, 1.5]
        for index, (bad, code) in enumerate([(np.nan, "NON_FINITE"), (np.inf, "NON_FINITE"), (1.5, "OUT_OF_RANGE")]):
            views[1][1, 0, 1] = bad
            error = client.error(STEP, head + bytes(buffer))
            assert (error["code"], error["env"], error["path"]) == (code, 1, "default/agent/b"), index
        views[1][:] = 0
        for leaf, value in ((0, 2), (2, 5), (3, 2)):
            kept = views[leaf].copy()
            views[leaf][:] = value
            assert client.error(STEP, head + bytes(buffer))["code"] == "OUT_OF_RANGE"
            views[leaf][:] = kept
        Result(client, client.ask(STEP, head + bytes(buffer)))


@pytest.mark.parametrize("name", ["Taxi-v4", "Pendulum-v1", "FrozenLake-v1", "Blackjack-v1"])
def test_serves_stock_environments(name):
    with Server(name, 2) as server:
        client = Raw(server)
        native = gymnasium.make(name)
        native.reset(seed=4)
        client.reset(seeds=[4, 5])
        layout = Layout.of(native.action_space)
        native.action_space.seed(1)
        for _ in range(20):
            action = native.action_space.sample()
            actions = bytearray(2 * layout.row_bytes)
            layout.views(actions, 2, 0)[0][:] = action
            result = Result(client, client.ask(STEP, pad(bytes(8) + b"\1\1") + actions))
            seen, reward, terminated, truncated, info = native.step(action)
            if terminated or truncated:
                native.reset()
                break
            wanted = Layout.of(native.observation_space)
            row = bytearray(wanted.row_bytes)
            for leaf, view in zip(wanted.leaves, wanted.views(row, 1, 0)):
                view[0] = wanted.pick(seen, leaf)
            assert result.behaviours[0]["rows"][0] == bytes(row) and result.rewards[0] == reward
            if "action_mask" in info:
                assert client.spec["behaviours"][0]["masks_actions"] and result.behaviours[0]["masks"][0] == info["action_mask"].tolist()


def test_masks():
    with Server(Masked, 1) as server:
        client = Raw(server)
        behaviour = client.spec["behaviours"][0]
        assert behaviour["masks_actions"] and behaviour["mask_bytes"] == 3
        assert client.reset().behaviours[0]["masks"] == [[1, 0, 1]]
        assert client.step([0]).behaviours[0]["masks"] == [[0, 1, 0]]


def test_infos_and_options(counters):
    client = Raw(counters)
    assert client.reset(options={"map": 2}).said == {"infos": {"from": {"slots": [0, 1], "values": ["reset"] * 2}, "options": {"slots": [0, 1], "values": [{"map": 2}] * 2}}}
    result = client.step([1, 1], [1, 0])
    assert result.said == {"infos": {"count": {"slots": [0], "values": [1]}, "odd": {"slots": [0], "values": [None]}, "list": {"slots": [0], "values": [[0, 1]]}}}
    client.step([1, 1], [1, 0])
    said = client.step([1, 1], [1, 0]).said
    assert said["final_infos"]["count"] == {"slots": [0], "values": [3]} and said["infos"]["from"]["slots"] == [0]


def test_seeds_and_streams(counters):
    a, b = Raw(counters), Raw(counters)
    one, two = a.reset(seeds=[5, 6]), b.reset(seeds=[5, 6])
    assert one.floats() == two.floats() and one.floats()[0] != one.floats()[1]
    assert a.reset().floats() == b.reset().floats() != one.floats()
    native = Counter()
    native.reset(seed=5)
    native.reset()
    assert a.reset([1, 0]).floats()[0] == native.reset()[0].tolist()


def test_the_servers_own_seed():
    with Server(Counter, 2, seed=5) as server:
        one, two = Raw(server), Raw(server)
        assert one.reset().floats() == two.reset(seeds=[5, 6]).floats() and one.reset().floats() == two.reset().floats()


def test_ends_after_the_wanted_sessions_in_which_a_trainer_has_stepped():
    with Server(Counter, 1, sessions=2, training_length=9, limits=PATIENT) as server:
        Raw(server, hello=False).sock.close()  # a port scanner
        Raw(server).send(BYE, request=0)
        only_reset = Raw(server)
        only_reset.reset(), only_reset.send(BYE, request=0)
        mute = Text(server)
        mute.line(), mute.line(), mute.sock.shutdown(socket.SHUT_RDWR)
        until(lambda: server._text_holder is None)
        stepped = Raw(server)
        stepped.reset(), stepped.step([1]), stepped.send(BYE, request=0)
        until(lambda: server._finished == 1)
        server._thread.join(3 * TICK)
        assert server._thread.is_alive()
        text = Text(server)
        text.line(), text.line(), text.ask("1\n"), text.sock.shutdown(socket.SHUT_RDWR)
        server._thread.join(ENDS_S)
        assert not server._thread.is_alive()


class Brittle(Counter):
    def step(self, action):
        raise RuntimeError("boom")


def test_an_environment_that_fails_again_and_again_is_told_in_a_few_tracebacks(monkeypatch):
    monkeypatch.setattr(Refusals, "EVERY_S", ENDS_S)
    said = []
    with Server(Brittle, log=said.append) as server:
        client = Raw(server)
        for _ in range(40):
            client.reset()
            assert client.error(STEP, step_payload(1, [1]))["code"] == "ENV_FAILED"
    assert sum(line.startswith("Traceback") for line in said) == 5
    assert said[-1] == "RuntimeError: boom (and 34 more like it)", said[-1]


@pytest.mark.parametrize("begins, why", [(b"GET / HTTP", "BAD_MAGIC: a frame begins with 'GET ', expected '\\xc0NSC'; is this protocol 2?"),
                                         (wire.pack(wire.Frame(HELLO, b'{"protocol":"2"}')), "MALFORMED: HELLO has protocol '\"2\"'; it is [lowest, highest]")])
def test_who_was_turned_away_and_why_is_one_plain_line(begins, why):
    said = []
    with Server(Counter, protocol="2", log=said.append) as server:
        client = Raw(server, hello=False)
        client.sock.sendall(begins)
        peer = "127.0.0.1:%d" % client.sock.getsockname()[1]
        client.take()
        until(lambda: said)
    assert said == [f"{peer} was turned away: {why}"]


def test_what_cannot_be_served_is_told_without_pythons_own_words(capsys):
    from consac.serve.command import main

    with Server(Counter) as server:
        for arguments, why in ([["CartPole-v1", "--port", str(server.port)], "Address already in use"], [["CartPole-v1", "--host", "0.0.0.0"], "an access token is needed"],
                               [["NoSuch-v0"], "doesn't exist"]):
            assert main(arguments) == 2
            said = capsys.readouterr().err.splitlines()
            assert len(said) == 1 and said[0].startswith("consac.serve: ") and why in said[0] and "Error" not in said[0] and "[Errno" not in said[0], said


def test_sessions_are_independent(counters):
    a, b = Raw(counters), Raw(counters)
    a.reset(), b.reset()
    a.step([1, 1]), a.step([1, 1])
    assert [row[0] for row in b.step([1, 1]).floats()] == [1, 1]
    assert a.session != b.session


# ---- autoreset

def test_same_step(counters):
    client = Raw(counters)
    client.reset()
    client.step([0, 1]), client.step([0, 1])
    result = client.step([0, 1])
    assert result.states == [1 | 4 | 8 | 16, 2 | 4 | 8 | 16]
    assert [row[0] for row in result.floats()] == [0, 0] and [row[0] for row in result.floats("finals")] == [3, 3]
    assert result.rewards == [0.1 * 3, 0.1 * 3]
    assert client.step([0, 0]).states == [16, 16]


def test_next_step(counters):
    client = Raw(counters, autoreset="next_step")
    client.reset()
    client.step([0, 1]), client.step([0, 1])
    result = client.step([0, 1])
    assert result.states == [1, 2] and [row[0] for row in result.floats()] == [3, 3]
    result = client.step([99, 1], [1, 0])
    assert result.states == [8 | 16, 0] and result.rewards == [0, 0] and [row[0] for row in result.floats()] == [0, 3]
    result = client.step([1, 77])
    assert result.states == [16, 8 | 16] and [row[0] for row in result.floats()] == [1, 0]


def test_disabled(counters):
    client = Raw(counters, autoreset="disabled")
    client.reset()
    client.step([0, 1], [1, 0]), client.step([0, 1], [1, 0])
    result = client.step([0, 1], [1, 0])
    assert result.states == [1, 8 | 16] and [row[0] for row in result.floats()] == [3, 0]
    error = client.error(STEP, step_payload(2, [0, 0]))
    assert (error["code"], error["severity"], error["env"]) == ("RESET_REQUIRED", "request", 0)
    assert client.step([0, 0], [0, 1]).states == [0, 16]
    assert client.reset([1, 0]).states == [8 | 16, 16]
    assert client.step([0, 0]).states == [16, 16]


def test_what_is_not_stepped_is_repeated(counters):
    client = Raw(counters)
    client.reset()
    result = client.step([1, 1], [0, 1])
    assert result.states == [8 | 16, 16] and result.rewards == [0, 0.1]
    result = client.step([1, 1], [0, 0])
    assert result.states == [8 | 16, 16] and result.rewards == [0, 0] and [row[0] for row in result.floats()] == [0, 1]


def test_several_agents():
    with Server(Agents, 2) as server:
        client = Raw(server)
        assert [(b["name"], b["agents"]) for b in client.spec["behaviours"]] == [("red", ["red_0", "red_1"]), ("blue", ["blue_0"])]
        actions = pad(pad(bytes(8) + b"\1\1") + bytes(4 * 4)) + bytes(4 * 2)
        first = client.reset()
        assert [b["states"] for b in first.behaviours] == [[24] * 4, [24] * 2]
        step = lambda: Result(client, client.ask(STEP, actions))
        assert [b["states"] for b in step().behaviours] == [[16] * 4, [16] * 2]
        second = step()
        assert [b["states"] for b in second.behaviours] == [[5, 16, 5, 16], [16, 16]] and second.floats()[0] == [2]
        third = step()
        assert [b["states"] for b in third.behaviours] == [[0, 5, 0, 5], [16, 16]] and third.floats()[0] == [2]
        assert third.rewards == [0, 3, 0, 3]
        fourth = step()
        assert [b["states"] for b in fourth.behaviours] == [[24] * 4, [1 | 4 | 8 | 16] * 2]
        assert fourth.floats("finals", 1) == [[4, 4], [4, 4]] and fourth.floats("rows", 1) == [[0, 0], [0, 0]]
        assert fourth.said["final_infos"] == {"at": {"slots": [4, 5], "values": [4, 4]}}
        assert [b["states"] for b in step().behaviours] == [[16] * 4, [16] * 2]


# ---- states

def test_wrong_states(counters):
    for kind in (CONFIGURE, RESET, STEP, RENDER):
        error = Raw(counters, hello=False).error(kind, b"{}")
        assert (error["code"], error["severity"]) == ("BAD_STATE", "connection")
    client = Raw(counters, hello=False)
    welcome = client.ask_json(HELLO, {"protocol": [1, 9], "capabilities": ["render", "novel"], "news": {}})
    assert (welcome["protocol"], welcome["capabilities"], welcome["resumed"], welcome["last_request"]) == (2, ["render"], False, 0)
    client.session = welcome["session"]
    for kind, payload in ((STEP, bytes(24)), (RESET, bytes(10)), (RENDER, b"{}"), (HELLO, wire.dump_json({"protocol": [2, 2]}))):
        error = client.error(kind, payload)  # a second HELLO uses no number up
        assert (error["code"], error["severity"]) == ("BAD_STATE", "request")
    client.spec = client.ask_json(CONFIGURE, {})
    assert client.ask_json(CONFIGURE, {"autoreset": "disabled"})["autoreset"] == "disabled"
    for kind, payload in ((STEP, step_payload(2, [0, 0])), (RENDER, b"{}"), (RESET, reset_payload(2, [1, 0]))):
        assert client.error(kind, payload)["code"] == "BAD_STATE"
    client.reset()
    assert client.error(CONFIGURE, b"{}")["code"] == "BAD_STATE"
    assert client.error(STEP, step_payload(2, [0, 0]), session=client.session + 1)["code"] == "BAD_STATE"
    client.number -= 1
    assert client.error(77)["code"] == "UNKNOWN_MESSAGE"
    assert client.error(RESULT)["code"] == "UNKNOWN_MESSAGE"
    client.send(0x8077, b"skip me", request=0)
    assert client.step([0, 0]).states == [16, 16]


def test_hello_is_no_request_whatever_its_number(counters):
    for number in (0, 1, 7):
        client = Raw(counters, hello=False)
        client.send(HELLO, b'{"protocol":[2,2]}', request=number)
        frame = client.take()
        assert frame.request == 0 and json.loads(frame.payload)["last_request"] == 0
        client.session = json.loads(frame.payload)["session"]
        assert client.ask(CONFIGURE, b"{}").request == 1
        assert client.ask(RESET, reset_payload(2), session=0).type == RESULT
        client.close()


def test_configure_is_checked(counters):
    client = Raw(counters)
    right = client.spec["behaviours"]
    assert client.ask_json(CONFIGURE, {"expect": right})["behaviours"] == right
    wrong = json.loads(json.dumps(right))
    wrong[0]["observation"]["shape"] = [3]
    error = client.error(CONFIGURE, wire.dump_json({"expect": wrong}))
    assert (error["code"], error["path"]) == ("SPEC_MISMATCH", "behaviours/0/observation/shape/0") and "3" in error["message"] and "2" in error["message"]
    assert client.error(CONFIGURE, b'{"transport":"shm"}')["code"] == "UNSUPPORTED"
    assert client.error(CONFIGURE, b'{"autoreset":"sometimes"}')["code"] == "UNSUPPORTED"
    assert client.reset().states == [24, 24]


def test_bad_requests_change_nothing(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2])
    for kind, payload, code in [
            (STEP, b"", "WRONG_SIZE"), (STEP, step_payload(2, [0, 0])[:-1], "WRONG_SIZE"), (STEP, step_payload(2, [0, 0, 0]), "WRONG_SIZE"),
            (STEP, step_payload(2, [0, 3]), "OUT_OF_RANGE"), (STEP, step_payload(2, [-1, 0]), "OUT_OF_RANGE"), (STEP, step_payload(2, [0, 0], [1, 2]), "OUT_OF_RANGE"),
            (RESET, b"", "WRONG_SIZE"), (RESET, reset_payload(2)[:9], "WRONG_SIZE"), (RESET, reset_payload(2, seeds=[1, 2])[:-1], "WRONG_SIZE"),
            (RESET, reset_payload(2, seeds=[1, -2]), "OUT_OF_RANGE"), (RESET, reset_payload(2) + b"\0", "WRONG_SIZE"), (RESET, reset_payload(2, options={})[:-1], "WRONG_SIZE"),
            (RESET, pad(struct.pack("<II", 2, 0) + b"\1\1") + struct.pack("<I", 1 << 31) + b"{}", "WRONG_SIZE"), (RESET, reset_payload(2, [3, 1]), "OUT_OF_RANGE"),
            (RENDER, b'{"env":0}', "UNSUPPORTED")]:
        error = client.error(kind, payload)
        assert (error["code"], error["severity"]) == (code, "request"), (kind, payload)
        assert len(error["message"]) > 20
    assert [row[0] for row in client.step([1, 1]).floats()] == [1, 1]


def test_a_failing_environment_is_told():
    with Server(Failing, 3) as server:
        client = Raw(server)
        client.reset()
        error = client.error(STEP, step_payload(3, [0, 2, 0]))
        assert (error["code"], error["env"]) == ("ENV_FAILED", 1) and "motor burnt out" in error["message"]
        for env in (0, 1):
            assert client.error(STEP, step_payload(3, [0] * 3))["code"] == "RESET_REQUIRED"
        assert client.step([0, 0, 0], [0, 0, 1]).floats()[2][0] == 1
        client.reset([1, 1, 0])
        assert [row[0] for row in client.step([0, 0, 0]).floats()] == [1, 1, 2]


def test_render(counters):
    client = Raw(counters, hello={"capabilities": ["render"]})
    client.reset(), client.step([1, 1], [0, 1])
    frame = client.ask(RENDER, b'{"env":1}')
    assert frame.type == FRAME and frame.payload == struct.pack("<II", 2, 3) + b"\1" * 18
    for bad in (b'{"env":2}', b'{"env":-1}'):
        assert client.error(RENDER, bad)["code"] == "OUT_OF_RANGE"
    assert client.error(RENDER, b'{"env":"x"}')["code"] == "MALFORMED" and client.is_closed()


def test_ping(counters):
    client = Raw(counters)
    for payload in (b"", b"x" * 64):
        assert client.ask(PING, payload, request=0) == Frame(PONG, payload, session=client.session)
    client.send(PING, b"x" * 65, request=0)
    assert json.loads(client.take().payload)["code"] == "MALFORMED" and client.is_closed()


# ---- exactly once, resuming

def test_a_repeated_number_is_answered_again_and_not_carried_out(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2])
    answer = client.ask(STEP, step_payload(2, [1, 1]))
    for payload in (step_payload(2, [1, 1]), b"whatever", b""):
        assert client.ask(STEP, payload, request=client.number) == answer
    for number in (0, 1, client.number - 1, client.number + 2, 1 << 63):
        assert client.error(STEP, step_payload(2, [1, 1]), request=number)["code"] == "BAD_STATE"
    assert [row[0] for row in client.step([1, 1]).floats()] == [2, 2]
    wrong = client.ask(STEP, step_payload(2, [9, 9]))
    assert wrong.type == ERROR and client.ask(STEP, step_payload(2, [1, 1]), request=client.number) == wrong
    assert [row[0] for row in client.step([1, 1]).floats()] == [0, 0]


def test_resume_carries_a_step_out_once(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2]), client.step([1, 1])
    number = client.number + 1
    client.sock.sendall(pack(Frame(STEP, step_payload(2, [1, 1]), number, client.session)))
    assert ready(client.sock, ENDS_S)  # with an answer that is never read
    client.close()
    again = Raw(counters, hello={"resume": client.welcome["resume"]})
    assert again.welcome["resumed"] and again.welcome["session"] == client.session and again.welcome["last_request"] == number
    again.spec = client.spec
    repeated = Result(again, again.ask(STEP, step_payload(2, [1, 1]), request=number))
    assert [row[0] for row in repeated.floats()] == [2, 2]
    assert again.step([1, 1]).floats("finals")[0][0] == 3


def test_a_connection_cut_at_every_byte_of_a_step(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2])
    steps, length = 0, len(pack(Frame(STEP, step_payload(2, [1, 1]))))
    for at in range(length + 1):
        number = client.number + 1
        data = pack(Frame(STEP, step_payload(2, [1, 1]), number, client.session))
        client.sock.sendall(data[:at])
        client.close()
        again = Raw(counters, hello={"resume": client.welcome["resume"]})
        assert again.welcome["last_request"] in ((number - 1,) if at < length else (number - 1, number))
        again.spec, again.welcome = client.spec, client.welcome
        result = Result(again, again.ask(STEP, step_payload(2, [1, 1]), request=number))
        steps += 1
        assert [row[0] for row in result.floats()] == [steps % 3] * 2
        again.number, client = number, again
    client.send(BYE, request=0)


def test_resume_takes_over_from_a_connection_that_looks_alive(counters):
    client = Raw(counters)
    client.reset()
    again = Raw(counters, hello={"resume": client.welcome["resume"]})
    again.spec = client.spec
    assert again.welcome["resumed"] and client.is_closed()
    assert again.step([1, 1]).states == [16, 16]


def test_resume_is_refused_after_bye_and_after_its_time():
    with Server(Counter, 1, limits=Limits(resume_s=0.3)) as server:
        for leave in (lambda client: client.send(BYE, request=0), lambda client: client.close()):
            client = Raw(server)
            client.reset()
            leave(client)
            until(lambda: not server._sessions)
            late = Raw(server, hello={"resume": client.welcome["resume"]})
            assert late.welcome["code"] == "AUTH_FAILED" and late.welcome["severity"] == "connection" and late.is_closed()


# ---- limits and security

def test_frames_that_are_refused(counters):
    header = lambda magic=wire.MAGIC, kind=HELLO, flags=0, length=0, crc=0, request=1, session=0, reserved=0: wire.HEADER.pack(magic, kind, flags, length, crc, request, session, reserved)
    for data, code in [(b"GET / HTTP/1.1\r\n\r\n" + bytes(40), "BAD_MAGIC"), (b"GET /", "BAD_MAGIC"), (header(flags=2), "MALFORMED"), (header(reserved=1), "MALFORMED"),
                       (header(length=4097), "FRAME_TOO_LARGE"), (header(length=0xFFFFFFFF), "FRAME_TOO_LARGE"), (header(flags=1, length=2, crc=5) + b"{}", "CRC_MISMATCH"),
                       (header(length=2) + b"[]", "MALFORMED"), (header(length=2) + b"{]", "MALFORMED"), (header(length=80) + b"[" * 80, "MALFORMED"),
                       (header(length=15) + b'{"protocol":[]}', "MALFORMED"), (header(length=18) + b'{"protocol":[3,9]}', "UNSUPPORTED_VERSION")]:
        client = Raw(counters, hello=False)
        client.sock.sendall(data)
        frame = client.take()
        error = json.loads(frame.payload)
        assert (error["code"], error["severity"], frame.request) == (code, "connection", 0 if code == "BAD_MAGIC" else 1), data
        assert client.is_closed()
    assert error["protocol"] == [2, 2]


def test_large_frames_after_welcome(counters):
    client = Raw(counters, hello={"max_frame": 8192})
    assert client.welcome["max_frame"] == 8192
    client.sock.sendall(wire.HEADER.pack(wire.MAGIC, RESET, 0, 8193, 0, 2, client.session, 0))
    frame = client.take()
    assert frame.request == 2 and json.loads(frame.payload)["code"] == "FRAME_TOO_LARGE" and client.is_closed()
    client = Raw(counters)
    options = {"map": "x" * 900_000}
    payload = pack(Frame(RESET, reset_payload(2, options=options), 2, client.session))
    for at in range(0, len(payload), 65_521):
        client.sock.sendall(payload[at:at + 65_521])
    client.number = 2
    assert Result(client, client.take()).said == {}
    assert client.step([1, 1]).states == [16, 16]


def test_a_frame_in_single_bytes(counters):
    client = Raw(counters, hello=False)
    for byte in pack(Frame(HELLO, b'{"protocol":[2,2]}', 1)):
        client.sock.sendall(bytes([byte]))
    assert client.take().type == WELCOME


def test_random_damage_never_stops_the_server(counters):
    rng = np.random.default_rng(5)
    for _ in range(60):
        client = Raw(counters)
        good = [pack(Frame(RESET, reset_payload(2, seeds=[1, 2], options={"a": [1]}), 2, client.session)), pack(Frame(STEP, step_payload(2, [1, 1]), 3, client.session)), pack(Frame(CONFIGURE, b'{"autoreset":"disabled"}', 2, client.session))]
        for _ in range(4):
            data = bytearray(good[rng.integers(3)])
            for at in rng.integers(4, len(data), rng.integers(1, 4)):
                data[at] ^= 1 << int(rng.integers(8))
            try:
                client.sock.sendall(data[:int(rng.integers(1, 2 * len(data)))])
            except ConnectionError:
                break
        client.sock.close()
    assert Raw(counters).reset().states == [24, 24]


def test_two_frames_at_once(counters):
    client = Raw(counters)
    client.sock.sendall(pack(Frame(RESET, reset_payload(2), 2, client.session)) + pack(Frame(STEP, step_payload(2, [1, 1]), 3, client.session)))
    assert [(frame.request, frame.type) for frame in (client.take(), client.take())] == [(2, RESULT), (3, RESULT)]


def test_results_too_large_for_the_client():
    class Wide(Counter):
        observation_space = spaces.Box(0, 1, (2000,), np.float32)

        def _see(self):
            return np.zeros(2000, np.float32)

    with Server(Wide, 1) as server:
        client = Raw(server, hello={"max_frame": 8192})
        assert client.spec["code"] == "UNSUPPORTED"
    with pytest.raises(ValueError, match="use fewer"):
        Server(Wide, 5000)


def test_a_claim_takes_no_memory():
    with Server(Counter, 1) as server:
        client = Raw(server)
        client.sock.sendall(wire.HEADER.pack(wire.MAGIC, RESET, 0, wire.LARGEST_FRAME, 0, 3, client.session, 0) + bytes(100_000))
        until(lambda: [len(connection.buffer) for connection in list(server._connections)] == [131072])
        held, = server._connections
        until(lambda: held.end == wire.HEADER.size + 100_000)
        assert len(held.buffer) == 131072


def test_crc(counters):
    client = Raw(counters, hello={"capabilities": ["crc"]})
    assert client.welcome["capabilities"] == ["crc"]
    client.sock.sendall(pack(Frame(RESET, reset_payload(2), 2, client.session, wire.FLAG_CRC)))
    frame = client.take()
    assert frame.type == RESULT and frame.flags == wire.FLAG_CRC


def test_token():
    with pytest.raises(ValueError, match="token"):
        Server(Counter, 1, host="0.0.0.0")
    with Server(Counter, 1, token="secret", training_length=5) as server:
        for hello, code in ((None, "AUTH_FAILED"), ({"token": "wrong"}, "AUTH_FAILED"), ({"token": 3}, "MALFORMED")):
            client = Raw(server, hello=False)
            client.sock.sendall(pack(Frame(HELLO, wire.dump_json({"protocol": [2, 2], **(hello or {})}), 1)))
            frame = client.take()
            error = json.loads(frame.payload)
            assert frame.request == 1 and error["code"] == code and "secret" not in error["message"] and client.is_closed()
        client = Raw(server, hello={"token": "secret"})
        assert client.reset().states == [24]
        client.close()


def test_capacity():
    with Server(Counter, 1, limits=Limits(max_sessions=2)) as server:
        a, b = Raw(server), Raw(server)
        late = Raw(server, hello=False)
        error = late.ask_json(HELLO, {"protocol": [2, 2]})
        assert (error["code"], error["severity"]) == ("CAPACITY", "connection") and error["retry_after_s"] > 0 and late.is_closed()
        a.send(BYE, request=0)
        until(lambda: len(server._sessions) == 1)
        assert Raw(server).reset().states == [24]
        assert b.reset().states == [24]


def test_a_trainer_that_vanishes_before_its_first_result_leaves_no_place_taken():
    with Server(Counter, 1, limits=Limits(max_sessions=1)) as server:
        for _ in range(3):
            client = Raw(server)
            assert "code" not in client.welcome
            client.close()
            until(lambda: not server._sessions)
        late = Raw(server, hello={"resume": client.welcome["resume"]})
        assert late.welcome["code"] == "AUTH_FAILED"
        held = Raw(server)
        held.reset()
        held.close()
        until(lambda: [session.connection for session in list(server._sessions.values())] == [None])
        assert Raw(server, hello=False).ask_json(HELLO, {"protocol": [2, 2]})["code"] == "CAPACITY"
        assert Raw(server, hello={"resume": held.welcome["resume"]}).welcome["resumed"]


def test_a_flood_of_refused_connections_is_told_in_a_few_lines(monkeypatch):
    monkeypatch.setattr(Refusals, "EVERY_S", ENDS_S)
    said = []
    with Server(Counter, token="sesame", protocol="2", log=said.append) as server:
        for _ in range(60):
            assert Raw(server, hello=False).ask_json(HELLO, {"protocol": [2, 2]})["code"] == "AUTH_FAILED"
        until(lambda: not server._connections)
        assert len(said) == 5
    assert len(said) == 6 and said[-1].endswith("(and 54 more like it)"), said


def test_whoever_says_nothing_gives_way_and_whoever_finds_no_place_hears_why():
    said = []
    with Server(Counter, protocol="2", limits=Limits(max_sessions=4, handshake_s=ENDS_S), log=said.append) as server:
        served, silent = Raw(server), []
        for _ in range(60):
            silent.append(Raw(server, hello=False))
            until(lambda: not any(connection.given_up for connection in list(server._connections)))  # of too many at once some would be sent away
        for _ in range(3):
            assert Raw(server).reset().states == [24]
        assert silent[0].take().type == ERROR and silent[0].is_closed()
        assert served.reset().states == [24]
        assert any(line.startswith("127.0.0.1:") and line.endswith(" was turned away: it had said nothing, and others wait") for line in said)
    with Server(Counter, protocol="2", limits=Limits(max_sessions=1, handshake_s=ENDS_S)) as server:
        half = [Raw(server, hello=False) for _ in range(18)]
        for one in half:
            one.sock.sendall(b"\xc0")  # has spoken, and keeps its place
        until(lambda: [connection.has_spoken for connection in list(server._connections)] == [True] * 18)
        late = Raw(server, hello=False)
        late.send(HELLO, b'{"protocol":[2,2]}')
        assert json.loads(late.take().payload)["code"] == "CAPACITY" and late.is_closed()


def test_a_silent_trainer_of_text_protocol_1_gives_its_place_to_another():
    with Server(Counter, protocol="text1", training_length=9, limits=Limits(grace_s=ENDS_S, handshake_s=0.1)) as server:
        silent = Text(server)
        assert silent.line()
        time.sleep(0.5)  # five handshakes; after four it may be sent away
        server.limits = replace(server.limits, grace_s=5)
        other = Text(server)
        assert other.line().startswith("D#3#0#B") and other.line() and other.ask("1\n")


@pytest.mark.skipif(resource is None, reason="no limits on descriptors here")
def test_descriptors_of_any_number_serve_both_ends():
    """select() takes none above 1023."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    if before[1] != resource.RLIM_INFINITY and before[1] < 2048:
        pytest.skip("at most 2048 descriptors")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(2048, before[0]), before[1]))
    held = [os.open(os.devnull, os.O_RDONLY)]
    try:
        while held[-1] < 1100:
            held.append(os.dup(held[0]))
        with Server(Counter, training_length=9, limits=PATIENT) as server:
            with connect(f"tcp://127.0.0.1:{server.port}", shared_memory=False) as client:
                assert client._socket.fileno() > 1023
                client.reset()
                client.step()
                client._idle()
            server.limits = replace(server.limits, grace_s=0.02)
            text = connect(f"tcp://127.0.0.1:{server.port}", protocol="text1")
            text.close()
    finally:
        for descriptor in held:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


class Unpaid(Counter):
    def step(self, action):
        observation, _, *rest = super().step(action)
        return observation, None, *rest


class Quitting(Counter):
    def step(self, action):
        sys.exit("no more coins")


@pytest.mark.parametrize("env, why", [(Unpaid, "the reward is None, which is no number"), (Quitting, "SystemExit: no more coins")])
def test_an_environment_that_pays_nothing_or_quits_is_told(env, why):
    said = []
    with Server(env, log=said.append) as server:
        client = Raw(server)
        client.reset()
        error = client.error(STEP, step_payload(1, [0]))
        assert error["code"] == "ENV_FAILED" and why in error["message"]
        assert any(why in line for line in said), said
        assert client.reset().states == [24]


def test_a_space_beyond_any_frame_is_refused_before_anything_of_its_size_is_made():
    class Vast(Counter):
        observation_space = spaces.Dict({"all": spaces.Box(np.float32(-np.inf), np.float32(np.inf), (40_000_000,), np.float32)})

        def reset(self, **_):
            raise AssertionError("it was reset")

    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match="1 observation of 160000000 bytes"):
            Server(Vast)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()


def test_a_bad_action_of_text_protocol_1_is_one_line():
    said = []
    with Server(Counter, protocol="text1", training_length=9, log=said.append) as server:
        text = Text(server)
        text.line(), text.line()
        assert text.ask("1\0\n").startswith("error: action '1\\x00'") and text.line() == ""
        until(lambda: said)
    assert len(said) == 1 and said[0].startswith("text protocol 1, 127.0.0.1:") and ": action '1" in said[0], said


def test_handshake_deadline():
    with Server(Counter, 1, protocol="2", limits=Limits(handshake_s=2.0)) as server:
        silent, half = Raw(server, hello=False), Raw(server, hello=False)
        half.ask_json(HELLO, {"protocol": [2, 2]})
        for client in (silent, half):
            frame = client.take()
            assert (frame.type, json.loads(frame.payload)["code"]) == (ERROR, "MALFORMED") and client.is_closed()


def test_heartbeat():
    with Server(Counter, 1, limits=Limits(heartbeat_s=0.3)) as server:
        client = Raw(server)
        client.reset()
        assert [client.take().type for _ in range(3)] == [PING] * 3
        assert client.is_closed()
        again = Raw(server, hello={"resume": client.welcome["resume"]})
        assert again.welcome["resumed"]


def test_a_long_request_is_accompanied_by_pings():
    heard = threading.Event()

    class Slow(Counter):
        def step(self, action):
            assert heard.wait(ENDS_S)
            return super().step(action)

    with Server(Slow, 1, limits=Limits(heartbeat_s=0.2)) as server:
        client = Raw(server)
        client.reset()
        client.send(STEP, step_payload(1, [1]))
        assert client.take().type == PING
        heard.set()
        while (kind := client.take().type) == PING:
            pass
        assert kind == RESULT


def test_shutting_down_says_goaway():
    server = Server(Counter, 1).start()
    client = Raw(server)
    client.reset()
    server.close(), server.close()
    assert not server._thread.is_alive() and not server._connections  # nobody was waited for in vain
    frame = client.take()
    assert frame.type == GOAWAY and json.loads(frame.payload)["reason"] and client.is_closed()
    with pytest.raises(OSError):
        Raw(server)


def test_shutting_down_answers_what_is_under_way():
    begun, go = threading.Event(), threading.Event()

    class Slow(Counter):
        def step(self, action):
            begun.set()
            assert go.wait(ENDS_S)
            return super().step(action)

    server = Server(Slow, 1).start()
    client = Raw(server)
    client.reset()
    client.send(STEP, step_payload(1, [1]))
    assert begun.wait(ENDS_S)
    connection, = server._connections
    closing = threading.Thread(target=server.close)
    closing.start()
    assert connection.closing.wait(ENDS_S)
    go.set()
    assert client.take().type == RESULT and client.take().type == GOAWAY and client.is_closed()
    closing.join()


def test_environments_that_cannot_be_served():
    class Odd(Counter):
        observation_space = spaces.Text(4)

    with pytest.raises(TypeError, match="cannot be sent"):
        Server(Odd, 1)

    class Nameless(Agents):
        possible_agents = property()

    with pytest.raises(TypeError, match="possible_agents"):
        Server(Nameless, 1)
    made = []

    def make():
        made.append(1)
        if len(made) > 2:
            raise RuntimeError("no licence")
        return Counter()

    with Server(make, 2) as server:
        client = Raw(server)
        assert client.spec["code"] == "ENV_FAILED" and "no licence" in client.spec["message"] and client.spec["env"] == 1


# ---- text protocol 1

class Text:
    """A trainer of text protocol 1, which is known by its silence: the server is in haste until it has spoken."""

    def __init__(self, server):
        limits, server.limits = server.limits, replace(server.limits, grace_s=0.02)
        self.sock = socket.create_connection(("127.0.0.1", server.port), timeout=ENDS_S)
        self.sock.recv(1, socket.MSG_PEEK)
        server.limits = limits
        self.file = self.sock.makefile("rb")

    def line(self):
        return self.file.readline().decode().rstrip("\n")

    def ask(self, text):
        self.sock.sendall(text.encode())
        return self.line()


def test_text_fallback():
    with Server(Counter, 4, training_length=6, model_name="walker", seed=1, limits=PATIENT) as server:
        text = Text(server)
        assert text.line() == "D#3#0#B#2#0,0,1000,1000#6#walker"
        mark = text.line().split("#")[0].split(",")[1]
        assert text.ask("1\n") == f"1,{mark}#0.1#0"
        late = Text(server)
        assert late.line().startswith("busy: ") and late.line() == ""
        assert text.ask("1") == f"2,{mark}#0.2#0"
        assert text.ask("2\r\n") == f"3,{mark}#{0.1 * 3!r}#1"
        assert text.line().endswith("#0#0")
        modern = Raw(server)
        assert modern.reset().states == [24] * 4 and modern.spec["training_length"] == 6 and modern.spec["model_name"] == "walker"
        assert text.ask("7\n").startswith("error: action '7'") and text.line() == ""


def test_text_boxes():
    with Server("Pendulum-v1", 1, protocol="text1", training_length=9) as server:
        text = Text(server)
        assert text.line() == "B#1#-2,2#B#3#-1,-1,-8,1,1,8#9"
        assert len(text.line().split(",")) == 3
        assert text.ask("0.5").endswith("#0") and text.ask("99\n").endswith("#0")
        assert text.ask("nan\n").startswith("error: ")


def test_text_is_not_served_where_it_does_not_fit():
    with pytest.raises(ValueError, match="training length"):
        Server(Counter, 1, protocol="text1")
    said = []
    with Server(Nested, 1, training_length=9, limits=Limits(grace_s=0.05), log=said.append) as server:
        client = Raw(server, hello=False)
        until(lambda: any("says nothing" in line for line in said))
        assert client.ask_json(HELLO, {"protocol": [2, 2]})["protocol"] == 2


# ---- command line

def test_command_line(tmp_path):
    port_file = tmp_path / "port"
    command = [*OUR_SERVE, "CartPole-v1", "--envs", "2", "--port", "0", "--port-file", str(port_file), "--steps", "50"]
    with subprocess.Popen(command, env=OUR_ENVIRONMENT, stdout=subprocess.PIPE) as process:
        try:
            process.stdout.readline()
            client = Raw(int(port_file.read_text()))
            client.reset(seeds=[1, 2])
            assert client.step([0, 1]).states == [16, 16] and client.spec["training_length"] == 50
            process.send_signal(signal.SIGTERM)
            assert client.take().type == GOAWAY
            assert process.wait(ENDS_S) == 0
        finally:
            process.kill()
    for arguments in (["NoSuch-v0"], ["CartPole-v1", "--host", "0.0.0.0", "--port", "0"], ["no.module:thing"]):
        done = run([*OUR_SERVE, *arguments], env=OUR_ENVIRONMENT)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr


# ---- environments that fail, are misspelt, draw, or have kinds of agents

WORLDS = '''
import gymnasium
import numpy as np

class Drawing(gymnasium.Env):
    metadata = {"render_modes": ["rgb_array"]}
    observation_space, action_space = gymnasium.spaces.Box(0, 1, (1,), np.float32), gymnasium.spaces.Discrete(2)

    def __init__(self, render_mode=None):
        self.render_mode = render_mode

    def reset(self, *, seed=None, options=None):
        return np.zeros(1, np.float32), {}

    def step(self, action):
        raise RuntimeError("line one\\nline two\\x1b[2J")

    def render(self):
        return np.full((2, 2, 3), 7, np.uint8)

class Mute(Drawing):
    metadata = {}

    def __init__(self):
        super().__init__("rgb_array")

class Blunt(Drawing):
    def reset(self, **_):
        raise RuntimeError("first\\nreset")

class Old:
    observation_space, action_space = Drawing.observation_space, Drawing.action_space

    def reset(self):
        return np.zeros(1, np.float32)

    def step(self, action):
        return np.zeros(1, np.float32), 0.0, False, {}

class Older(Old):
    def close(self):
        pass
'''


@pytest.fixture
def worlds(tmp_path, monkeypatch):
    (tmp_path / "worlds_of_ours.py").write_text(WORLDS)
    monkeypatch.syspath_prepend(tmp_path)
    yield "worlds_of_ours"
    sys.modules.pop("worlds_of_ours", None)


def test_an_environment_that_fails_is_told_with_its_place_and_the_server_has_the_traceback(worlds):
    said = []
    with Server(f"{worlds}:Drawing", log=said.append) as server:
        client = Raw(server)
        client.reset()
        error = client.error(STEP, step_payload(1, [0]))
    line = WORLDS.split("\n").index('        raise RuntimeError("line one\\nline two\\x1b[2J")') + 1
    assert error["code"] == "ENV_FAILED" and f"RuntimeError: line one line two\\x1b[2J (worlds_of_ours.py, line {line}, in step)" in error["message"]
    assert any(f'worlds_of_ours.py", line {line}, in step' in one for one in said) and not any("\n" in one or "\x1b" in one for one in said)


def test_a_first_reset_that_fails_is_told_with_its_place(worlds, tmp_path):
    done = run([*OUR_SERVE, f"{worlds}:Blunt", "--port", "0"], env=dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), *sys.path])))
    last = done.stderr.splitlines()[-1]
    assert done.returncode == 2 and last.startswith("consac.serve: RuntimeError: first reset (worlds_of_ours.py, line ") and last.endswith("in reset)") and "Traceback" in done.stderr


def test_environments_of_a_module_are_drawn_where_they_say_so(worlds):
    for name, renders in (("Drawing", True), ("Mute", False)):
        with Server(f"{worlds}:{name}") as server:
            client = Raw(server, hello={"capabilities": ["render"]})
            assert ("render" in client.welcome["capabilities"]) == renders
            if renders:
                client.reset()
                assert client.ask(RENDER, b'{"env":0}').payload[8:] == b"\7" * 12
    from consac.serve.world import environment_maker

    assert environment_maker(f"{worlds}:Drawing", render=False)().render_mode is None


@pytest.mark.parametrize("name, why", [("Drawnig", "did you mean worlds_of_ours:Drawing"), ("nothing_like_it", "has no callable"), ("Old", "no close.*old gym"), ("Older", "gave a ndarray.*old gym")])
def test_environments_that_are_none(worlds, name, why):
    with pytest.raises((TypeError, ValueError), match=why):
        Server(f"{worlds}:{name}")


class Pack(Agents):
    """Two kinds of equal spaces."""

    possible_agents = ["wolf_0", "wolf_1", "sheep_0"]

    def observation_space(self, agent):
        return spaces.Box(-9, 9, (1,), np.float32)


def test_kinds_of_agents_do_not_share_a_policy_unless_asked():
    for group, expected in (("kind", [("wolf", ["wolf_0", "wolf_1"]), ("sheep", ["sheep_0"])]), ("spaces", [("default", ["wolf_0", "wolf_1", "sheep_0"])])):
        with Server(Pack, group=group) as server:
            assert [(b["name"], b["agents"]) for b in Raw(server).spec["behaviours"]] == expected

    class Numbered(Pack):
        possible_agents = [0, 1, 2]

    with Server(Numbered) as server:
        assert [(b["name"], b["agents"]) for b in Raw(server).spec["behaviours"]] == [("default", ["0", "1", "2"])]
    with pytest.raises(ValueError, match="kind or spaces"):
        Server(Pack, group="all")


def test_the_command_says_which_agents_share_a_policy(tmp_path):
    (tmp_path / "pack.py").write_text("from test_serve import Pack\n\ndef parallel_env(render_mode=None):\n    return Pack()\n")
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), os.path.dirname(__file__), *sys.path]))
    with subprocess.Popen([*OUR_SERVE, "--pettingzoo", "pack", "--port", "0"], env=environment, stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        assert process.stdout.readline() == "agents that share a policy (--group kind): wolf: wolf_0, wolf_1; sheep: sheep_0\n"
        process.terminate()


def test_agents_without_good_names_are_not_served():
    class Twice(Pack):
        possible_agents = ["wolf", "Wolf"]

    with pytest.raises(ValueError, match="capitals"):
        Server(Twice)


@pytest.mark.parametrize("payload", [b'{"autoreset":' + b"7" * 5000 + b"}", b'{"a":' + b"[" * 1500 + b"]" * 1500 + b"}"], ids=["digits", "depth"])
def test_json_that_python_does_not_read_is_answered(payload, capfd):
    with Server(Counter) as server:
        client = Raw(server)
        assert client.error(CONFIGURE, payload)["code"] == "MALFORMED" and client.is_closed()
    assert "Traceback" not in capfd.readouterr().err


def test_a_flood_of_empty_lines_does_not_defeat_the_deadline_of_text_protocol_1():
    said = []
    with Server(Counter, protocol="text1", training_length=9, limits=Limits(text_s=0.3), log=said.append) as server:
        text = Text(server)
        text.line(), text.line()
        begun = time.monotonic()
        with pytest.raises(ConnectionError):
            while time.monotonic() - begun < ENDS_S:
                text.sock.sendall(b"\n" * 10_000)


ODD = ["null", "-1", "1.5", "1e999", str(1 << 70), "7" * 3000, '"x"', '"\\ud800"', "[]", "{}", "[[]]", '[{"space":1}]', '[{"space":1},{"name":[],"space":{}}]', "true", '{"a":[{"space":{}}]}']


def test_requests_with_anything_in_them_are_answered(capfd):
    with Server(Counter, token="sesame", limits=Limits(max_sessions=1000)) as server:
        tried = 0
        for member in ("protocol", "client", "capabilities", "token", "resume", "max_frame"):
            for odd in ODD:
                client = Raw(server, hello=False)
                text = json.dumps({"protocol": [2, 2], "token": "sesame", member: "HERE"}).replace('"HERE"', odd)
                client.send(HELLO, text.encode())
                assert client.take().type in (WELCOME, ERROR)
                client.close()
                tried += 1
        client = Raw(server, hello={"token": "sesame", "capabilities": ["render"]})
        for kind, member in ((CONFIGURE, "autoreset"), (CONFIGURE, "expect"), (CONFIGURE, "transport"), (RENDER, "env")):
            for odd in ODD:
                try:
                    answer = client.ask(kind, f'{{"{member}":{odd}}}'.encode())
                except EOFError:
                    answer = None
                assert answer is not None and answer.type in (SPEC, ERROR, FRAME)
                if answer.type == ERROR and json.loads(answer.payload)["severity"] == "connection":
                    client = Raw(server, hello={"token": "sesame", "capabilities": ["render"]})
                tried += 1
    assert tried == 150 and "Traceback" not in capfd.readouterr().err


def test_a_server_without_descriptors_or_threads_goes_on_when_there_are_some_again(monkeypatch):
    said = []
    with Server(Counter, log=said.append) as server:
        first = Raw(server)
        first.reset()
        listener, failures = server._listener, [errno.EMFILE, errno.ENFILE, errno.ECONNABORTED]

        class Failing:
            def accept(self):
                if failures:
                    raise OSError(failures.pop(), "no more of them")
                return listener.accept()

            def __getattr__(self, name):
                return getattr(listener, name)

        server._listener = Failing()
        Raw(server).close()  # by the accept() that was under way
        second = Raw(server)  # accepted once there are descriptors again
        assert not failures and sum("no more of them" in one for one in said) == 3
        start = threading.Thread.start

        def no_thread(thread):
            if failures:
                raise RuntimeError(failures.pop())
            start(thread)

        failures.append("can't start new thread")
        monkeypatch.setattr(threading.Thread, "start", no_thread)
        refused = Raw(server, hello=False)
        error = json.loads(refused.take().payload)
        assert error["code"] == "CAPACITY" and "can't start new thread" in error["message"] and refused.is_closed()
        for client in (first, second, Raw(server)):
            client.reset()
            assert client.step([0]).states == [16]
