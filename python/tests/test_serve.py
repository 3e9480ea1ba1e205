"""consac.serve spoken to in raw frames: what an environment shows, autoreset, states."""
import hashlib
import json
import struct

import gymnasium
import numpy as np
import pytest

from consac import wire
from consac.layout import Layout
from consac.serve import Server
from consac.wire import CONFIGURE, FRAME, HELLO, PING, PONG, RENDER, RESET, RESULT, STEP, Frame
from raw_client import Raw, Result, pad, reset_payload, step_payload
from toy_worlds import Agents, Counter, Masked, Nested


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


class Joined(Agents):
    """The last agent comes with the second step, and is paid for its coming, which no protocol knows."""

    def reset(self, seed=None, options=None):
        seen, infos = super().reset(seed, options)
        self.agents.remove("blue_0")
        return {agent: seen[agent] for agent in self.agents}, infos

    def step(self, actions):
        answer = super().step(actions)
        if self.time == 2:
            self.agents.append("blue_0")
            answer[0]["blue_0"], answer[1]["blue_0"] = np.full(2, 2, np.float32), 7.0
        return answer


def test_an_agent_that_comes_in_mid_episode_begins_unpaid():
    with Server(Joined) as server:
        client = Raw(server)
        actions = pad(pad(pad(bytes(8) + b"\1") + bytes(4 * 2)) + bytes(4))
        assert client.reset().behaviours[1]["states"] == [0]
        step = lambda: Result(client, client.ask(STEP, actions)).behaviours[1]
        assert step()["states"] == [0]
        coming = step()
        assert (coming["states"], coming["rewards"]) == ([8 | 16], [0.0])
        going_on = step()
        assert (going_on["states"], going_on["rewards"]) == ([16], [3.0])


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
