"""spec/conformance/protocol2: the frames through our reader, the conversations with our server, the RESULTs before a judge of our own."""
import contextlib
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import threading
import time

import gymnasium
import numpy as np
import pettingzoo
import pytest

from consac import wire
from consac.client import connect
from consac.errors import ConsacError, ProtocolError
from consac.frames import ResultFrame
from consac.judge import Judge
from consac.layout import align
from consac.offer import read_spec
from consac.serve import Refused, Server
from consac.serve.batch import Batch
from result_check import ResultCheck

CASES = pathlib.Path(__file__).parents[2] / "spec/conformance/protocol2"
PROGRAM = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", "")) / "cli/consac"
FRAMES, CONVERSATIONS, RESULTS = (json.loads((CASES / name).read_text()) for name in ("frames.json", "server.json", "results.json"))


def read(stream, cut, limit):
    reader, events = wire.FrameReader(limit), []
    try:
        for piece in (stream[:cut], stream[cut:]):
            reader.feed(piece)
            while frame := reader.next():
                events.append({"type": frame.type, "request": frame.request, "session": frame.session, "payload": bytes(frame.payload).hex()})
    except wire.WireError as error:
        events.append({"error": error.code})
    return events


@pytest.mark.parametrize("case", FRAMES, ids=lambda case: case["name"])
def test_frames(case):
    stream = bytes.fromhex(case["hex"])
    for cut in range(len(stream) + 1):
        assert read(stream, cut, case["limit"]) == case["expect"], cut


class Conversation:
    """One case under way, with a server of an action space of two choices. Every RESULT is judged."""

    def __init__(self, port):
        self.port, self.kept, self.last, self.judged, self.resume, self.over, self.envs, self.held = port, {}, 0, 0, "", False, 1, b""
        self.connect()

    def connect(self, _=None):
        self.sock, self.reader = socket.create_connection(("127.0.0.1", self.port), 5), wire.FrameReader(wire.LARGEST_FRAME)
        self.session, self.flags = 0, 0

    def next(self):
        while True:
            while not (frame := self.reader.next()):
                data = self.sock.recv(65536)
                if not data:
                    return None
                self.reader.feed(data)
            if frame.type == wire.PING:
                self.write(wire.PONG, 0, bytes(frame.payload))
            elif frame.type not in (wire.PAUSED, wire.RESUMED) and not frame.type & wire.OPTIONAL:
                return frame

    def write(self, kind, request, payload=b"", how={}):
        session = 0 if "no_session" in how else self.session + ("other_session" in how)
        crc = how.get("crc")
        data = bytearray(wire.pack(wire.Frame(kind, payload, request, session, wire.FLAG_CRC if crc in ("right", "wrong") else self.flags)))
        data[12] ^= crc in ("wrong", "without flag")
        self.put(bytes(data), how)

    def put(self, data, how):
        """Held back for the next write, or in pieces that arrive one after another."""
        self.held += data
        if "hold" in how:
            return
        data, self.held = self.held, b""
        size = -(-len(data) // how.get("pieces", 1))
        for at in range(0, len(data), size):
            time.sleep(0.005 if at else 0)
            self.sock.sendall(data[at:at + size])

    def send(self, what):
        if "hex" in what:
            return self.put(bytes.fromhex(what["hex"]) + bytes(what.get("zeros", 0)), what)
        kind = what["type"] if isinstance(what["type"], int) else getattr(wire, what["type"])
        payload = what.get("text", "").encode()
        if "json" in what:
            expect = {"offered": self.offered, "with fractions": with_fractions(self.offered)}[what["expect"]] if "expect" in what else None
            payload = wire.dump_json(what["json"] | ({"resume": self.resume} if "resume" in what else {}) | ({"expect": expect} if expect else {}))
        if "floats" in what:  # there are two choices
            self.over = True
            return
        if "payload" in what:
            payload = self.payload(what["payload"])
        request = self.last + 1 if what["request"] == "next" else what["request"]
        self.ask(kind, request, payload, what)

    def ask(self, kind, request, payload, how={}):
        if kind in (wire.RESET, wire.STEP) and len(payload) >= 8 + self.envs and request != self.judged:
            self.check.ask(kind == wire.STEP, payload[8:8 + self.envs])
        if request == self.last + 1 and kind != wire.HELLO:
            self.last = request
        self.write(kind, request, payload, how)

    def payload(self, kind):
        pad = lambda data: data + bytes(-len(data) % 8)
        only_first, others = bytes([1] + [0] * (self.envs - 1)), bytes([0] + [1] * (self.envs - 1))
        reset = lambda flags=0, chosen=b"\1" * self.envs: pad(struct.pack("<II", flags, 0) + chosen)
        step = lambda chosen=b"\1" * self.envs, first=0, zero=0: pad(pad(struct.pack("<II", 0, zero) + chosen) + np.array([first] + [0] * (self.envs - 1), "<i4").tobytes())
        seeds = lambda first=11: struct.pack(f"<{self.envs}q", first, *range(12, 11 + self.envs))
        options = lambda text: pad(reset(2) + struct.pack("<I", len(text)) + text)
        two = bytes([2] + [1] * (self.envs - 1))
        scattered = struct.pack(f"<{self.envs}q", *range(97 + 3 * self.envs, 97, -3))
        return {
            "empty": lambda: b"", "none": lambda: reset(0, bytes(self.envs)), "all": reset, "two reset": lambda: reset(0, two), "first reset": lambda: reset(0, only_first),
            "unknown flag": lambda: reset(64), "seeded": lambda: reset(1) + seeds(), "scattered seeds": lambda: reset(1) + scattered, "negative seed": lambda: reset(1) + seeds(-5), "options": lambda: options(b'{"difficulty":1}'),
            "bad options": lambda: options(b'{"difficulty"'), "short reset": lambda: reset()[:-8], "long reset": lambda: reset() + bytes(8), "legal": step,
            "short": lambda: step()[:-1], "long": lambda: step() + bytes(8), "nonzero": lambda: step(zero=1), "two": lambda: step(two), "first": lambda: step(only_first),
            "others": lambda: step(others), "nobody": lambda: step(bytes(self.envs)), "unknown flag, long": lambda: reset(64) + bytes(3),
            "nonzero, short": lambda: step(zero=1)[:-1], "two, short": lambda: step(two)[:-1], "four bytes": lambda: bytes(4), "no options": lambda: options(b""), "illegal": lambda: step(first=100000), "illegal but not stepped": lambda: step(others, 100000),
        }[kind]()

    def looked_at(self, payload):
        """Without rows of slots that have none of 16, 1 and 2. One behaviour of one agent and no masks."""
        size = self.row_bytes
        states = align(8 + self.envs * size) + 8 * self.envs
        return b"".join(payload[8 + env * size:8 + (env + 1) * size] for env in range(self.envs) if payload[states + env] & 19) + payload[states - 8 * self.envs:]

    def expect(self, what):
        if "gone" in what:
            with contextlib.suppress(ConnectionError):
                while self.sock.recv(65536):
                    pass
            return
        frame = self.next()
        if what.get("closed"):
            assert frame is None, frame
            return
        assert frame is not None, what
        said = json.loads(bytes(frame.payload)) if frame.type in (wire.WELCOME, wire.SPEC, wire.ERROR) else {}
        if "unless" in what and said.get("code") == what["unless"]:
            self.over = True
            return
        if "or" in what and said.get("code") == what["or"]:
            return
        assert frame.type == getattr(wire, what["type"]), (what, frame)
        assert frame.request == what.get("request", frame.request)
        if frame.type == wire.WELCOME:
            said = {"capabilities": [], "max_frame": wire.LARGEST_FRAME, "last_request": 0, "resumed": False, "resume": ""} | said
            self.session, self.resume, self.flags = said["session"], said["resume"], wire.FLAG_CRC if "crc" in said["capabilities"] else 0
            self.reader.limit = said["max_frame"]
            self.over = not all(wanted["from"] <= said[key] <= wanted["to"] for key, wanted in what.get("needs", {}).items())
        if frame.type == wire.SPEC:
            assert said["autoreset"] == what.get("autoreset", "same_step")
            self.envs, self.autoreset, self.check = said["environments"], said["autoreset"], ResultCheck(said, said["autoreset"])
            self.offered, self.row_bytes = said["behaviours"], said["behaviours"][0]["observation_row"]["bytes"]
        code = what.get("code", said.get("code"))
        assert said.get("code") in (code if isinstance(code, list) else [code]), said
        for key, value in what.get("members", {}).items():
            within = isinstance(value, dict) and value["from"] <= said.get(key) <= value["to"]
            assert within or said.get(key) == value, (key, said)
        assert said.get("severity") == what.get("severity", said.get("severity")), said
        assert "path" not in what or said["path"] in what["path"], said
        assert frame.type != wire.ERROR or len(frame.payload) <= wire.LARGEST_BEFORE_WELCOME
        assert "env" not in what or isinstance(said["env"], int)
        assert what.get("env") != "first" or said["env"] == next(slot for slot, state in enumerate(self.check.states[0]) if state & wire.ACTIVE)
        assert "text" not in what or bytes(frame.payload) == what["text"].encode()
        payload = bytearray(frame.payload)
        if frame.type == wire.RESULT:
            payload[4:8] = bytes(4)  # the time that the engine took
            if frame.request != self.judged:
                assert self.check.judge(payload) is None
                self.judged = frame.request
        if "same_as" in what:
            assert payload == self.kept[what["same_as"]]
        if "begins_as" in what:
            assert self.looked_at(payload) == self.looked_at(self.kept[what["begins_as"]])
        if "keep" in what:
            self.kept[what["keep"]] = payload

    def beside(self, _):
        """A second trainer, while this one is there."""
        other = Conversation(self.port)
        other.write(wire.HELLO, 0, wire.dump_json({"protocol": [2, 2]}))
        frame = other.next()
        assert frame.type == wire.WELCOME or json.loads(bytes(frame.payload))["code"] == "CAPACITY"
        other.write(wire.BYE, 0)
        other.sock.close()

    def play(self, what):
        for _ in range(what.get("steps", 0)):
            ended = bytes(self.check.over(env) for env in range(self.envs))
            if what.get("until") == "over" and any(ended):
                return
            reset = self.autoreset == "disabled" and any(ended)
            self.ask(wire.RESET if reset else wire.STEP, self.last + 1, (bytes(8) + ended + bytes(-self.envs % 8)) if reset else self.payload("legal"))
            self.expect({"type": "RESULT", "request": self.last} | ({"or": "UNSUPPORTED"} if reset else {}))
            if reset and self.judged != self.last:  # all of them or none (R47)
                self.ask(wire.RESET, self.last + 1, self.payload("all"))
                self.expect({"type": "RESULT", "request": self.last})
        self.over = self.over or what.get("until") == "over"
        assert any(state & wire.ACTIVE for states in self.check.states for state in states)

    def half_close(self, _):
        self.sock.shutdown(socket.SHUT_WR)

    def reconnect(self, _):
        self.sock.close()
        for _ in range(100):
            self.connect()
            self.write(wire.HELLO, 0, wire.dump_json({"protocol": [2, 2], "resume": self.resume}))
            data = self.sock.recv(65536)
            self.reader.feed(data)
            peek = wire.FrameReader(wire.LARGEST_FRAME)
            peek.feed(data)
            frame = peek.next() if data else None
            if frame and frame.type == wire.WELCOME:
                return
            self.sock.close()
            time.sleep(0.02)
        raise AssertionError("the session cannot be taken up again")


def with_fractions(value):
    """The same numbers, written otherwise: 1 as 1.0."""
    if isinstance(value, dict):
        return {key: with_fractions(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [with_fractions(inner) for inner in value]
    return float(value) if type(value) is int else value


@pytest.mark.parametrize("case", CONVERSATIONS, ids=lambda case: case["name"])
def test_conversations_with_our_server(case):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3) as server:
        conversation = Conversation(server.port)
        for step in case["steps"]:
            (name, what), = step.items()
            getattr(conversation, name)(what)
            if conversation.over:  # the server cannot do what the case is of, and said so
                break
        conversation.sock.close()


@pytest.mark.parametrize("case", RESULTS["cases"], ids=lambda case: case["name"])
def test_results(case):
    check = ResultCheck(RESULTS["specs"][case["spec"]], case["autoreset"])
    for answer in case["answers"]:
        check.ask(answer["to"] == "STEP", answer.get("environments", [1] * check.environments))
        assert check.judge(bytes.fromhex("".join(answer["result"]))) == answer.get("breaks")


def choose_legal(connection):
    """The first legal choice of each; 0 is within every box of the cases."""
    for behaviour, rows, actions in zip(connection.behaviours, connection.rows, connection.actions):
        at = 0
        for leaf, action in zip(behaviour.action.leaves, actions):
            counts = [leaf.space.n] if isinstance(leaf.space, gymnasium.spaces.Discrete) else list(leaf.space.nvec) if isinstance(leaf.space, gymnasium.spaces.MultiDiscrete) else []
            for index, count in enumerate(counts):
                first = rows.masks[:, at:at + count].argmax(1)
                action[(slice(None), *([index] if action.ndim > 1 else []))] = first
                at += count


@pytest.mark.parametrize("case", [case for case in RESULTS["cases"] if case["answers"][-1].get("breaks") != "R75"], ids=lambda case: case["name"])
def test_results_before_our_client(case):
    """Its own judge, in answers to requests of some environments too; numbers it leaves to whoever learns."""
    offer = read_spec(RESULTS["specs"][case["spec"]] | {"autoreset": case["autoreset"]}, case["autoreset"], wire.LARGEST_FRAME)
    result, judge = ResultFrame(offer.behaviours), Judge(offer.behaviours, case["autoreset"])
    rows = result.lay_over(np.zeros(result.largest + (1 << 16), np.uint8))
    for request, answer in enumerate(case["answers"], 1):
        payload = memoryview(bytes.fromhex("".join(answer["result"])))
        chosen = np.array(answer["environments"], bool) if "environments" in answer else None
        held = True
        try:
            parts, _, _ = result.read(payload, False)
            result.check_padding()
            judge.judge(request, rows, answer["to"] == "STEP", chosen, bool(parts & wire.PART_FINALS))
        except ProtocolError:
            held = False
        rows_may_change = answer.get("breaks") == "R70" and "another" in case["name"]  # which nobody needs to compare (R78)
        assert held == ("breaks" not in answer or rows_may_change)


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
@pytest.mark.parametrize("autoreset, max_frame", [("same_step", wire.LARGEST_FRAME), ("same_step", 4096), ("next_step", wire.LARGEST_FRAME), ("disabled", wire.LARGEST_FRAME)])
def test_every_case_holds_for_our_client(autoreset, max_frame):
    """Whoever asks for another way first is put through its cases too."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with subprocess.Popen([PROGRAM, "doctor", "--conformance-trainer", f"tcp://127.0.0.1:{port}", "--timeout", "30"], stdout=subprocess.PIPE, text=True) as doctor:
        doctor.stdout.readline()
        while doctor.poll() is None:
            try:
                with contextlib.closing(connect(f"tcp://127.0.0.1:{port}", protocol=2, max_frame=max_frame, autoreset=(autoreset,) if autoreset == "same_step" else (autoreset, "same_step"))) as connection:
                    connection.reset()
                    while True:
                        choose_legal(connection)
                        connection.step()
            except (ConsacError, OSError):
                pass
        said = doctor.stdout.read()
    assert doctor.returncode == 0, said
    assert (f"holds        {autoreset}: an end with " in said) == (autoreset != "same_step"), said


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
@pytest.mark.parametrize("token", ["", "open sesame"])
def test_the_doctor_finds_nothing_wrong_with_our_server(token):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3, token=token) as server:
        done = subprocess.run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}", *["--token", token] * bool(token)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr


def all_or_none(monkeypatch):
    """Environments that are stepped and reset together or not at all."""
    for name in ("reset", "step"):
        def judged(batch, payload, plain=getattr(Batch, name)):
            if len(payload) >= 8 + len(batch.envs) and not all(payload[8:8 + len(batch.envs)]) and batch.started:
                raise Refused("UNSUPPORTED", "all or none")
            plain(batch, payload)
        monkeypatch.setattr(Batch, name, judged)


def somebody_comes_later(monkeypatch):
    """Nobody is there after a RESET but in the first step."""
    reset, advance = Batch.reset, Batch._advance

    def empty(batch, payload):
        reset(batch, payload)
        batch.parts[0].states[np.frombuffer(payload, np.uint8, len(batch.envs), 8) == 1] = 0

    def fill(batch, env):
        if batch.parts[0].states[env]:
            return advance(batch, env)
        batch.parts[0].states[env] = wire.FIRST | wire.ACTIVE
    monkeypatch.setattr(Batch, "reset", empty)
    monkeypatch.setattr(Batch, "_advance", fill)


def nobody_is_ever_said(monkeypatch):
    """State 16 is forgotten."""
    result = Batch.result

    def forgetful(batch, *arguments):
        for rows in batch.parts:
            rows.states[:] = 0
            rows.rewards[:] = 0
        return result(batch, *arguments)
    monkeypatch.setattr(Batch, "result", forgetful)


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
@pytest.mark.parametrize("engine", [all_or_none, somebody_comes_later], ids=lambda engine: engine.__name__)
def test_engines_that_the_page_allows_hold_every_case(engine, monkeypatch):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3) as server:
        engine(monkeypatch)
        done = subprocess.run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    if engine is all_or_none:
        assert "holds        disabled: 300 steps" in done.stdout and "not offered  the first environment alone is stepped" in done.stdout, done.stdout


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
def test_an_engine_that_forgets_state_16_is_told_so_by_name(monkeypatch):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=1) as server:
        nobody_is_ever_said(monkeypatch)
        with subprocess.Popen([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"], stdout=subprocess.PIPE, text=True) as doctor:
            said = []
            while not (said and "state 16" in said[-1]):
                said.append(doctor.stdout.readline())
                assert said[-1], said
            doctor.kill()
    assert "nobody takes part: state 16 has been set for no slot for 10 s (R77)" in said[-1]


@contextlib.contextmanager
def scripted(answer):
    """A port where everybody's frames are answered by `answer`(write, type, request), and none otherwise."""
    def serve(sock):
        reader = wire.FrameReader(wire.LARGEST_FRAME)
        write = lambda kind, request=0, payload=b"": sock.sendall(wire.pack(wire.Frame(kind, payload, request, 5)))
        with sock, contextlib.suppress(OSError, wire.WireError):
            while data := sock.recv(65536):
                reader.feed(data)
                while frame := reader.next():
                    answer(write, frame.type, frame.request)

    def accept():
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=serve, args=(listener.accept()[0],), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=accept, daemon=True).start()
        yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        listener.shutdown(socket.SHUT_RDWR)


def welcomes(write, kind, request):
    if kind == wire.HELLO:
        write(wire.WELCOME, 0, wire.dump_json({"protocol": 2, "session": 5, "resume": "", "capabilities": [], "max_frame": wire.LARGEST_FRAME}))


def pauses_for_ever(write, kind, request):
    welcomes(write, kind, request)
    if kind == wire.CONFIGURE:
        write(wire.PAUSED)


def pings_for_ever(write, kind, request):
    if kind in (wire.HELLO, wire.PONG):
        time.sleep(0.01)
        write(wire.PING, 0, b"still there")


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
@pytest.mark.parametrize("answer, said", [(pauses_for_ever, "no answer within 0.05 s: the server says PAUSED and no RESUMED"), (pings_for_ever, "no answer within 0.05 s"),
                                          (lambda *_: None, "no answer within 0.05 s")])
def test_no_server_holds_the_doctor_up(answer, said):
    """Neither by a pause that nobody ends, nor by PINGs, nor by silence; --timeout says how long an answer may take."""
    with scripted(answer) as url:
        done = subprocess.run([PROGRAM, "doctor", "--conformance", url, "--timeout", "0.05"], capture_output=True, text=True, timeout=100)
    assert done.returncode == 3 and said in done.stdout, done.stdout + done.stderr


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
def test_what_the_doctor_is_asked_is_what_it_does():
    """One examination at a time; its advice names its own flag; signals that end it leave one exit code."""
    for both in (["tcp://127.0.0.1:1", "--conformance", "tcp://127.0.0.1:2"], ["--conformance", "tcp://127.0.0.1:1", "--conformance-trainer", "tcp://127.0.0.1:2"]):
        done = subprocess.run([PROGRAM, "doctor", *both], capture_output=True, text=True, timeout=20)
        assert done.returncode == 2 and "one examination at a time" in done.stderr and done.stderr.count("\n") == 1, done.stderr
    with scripted(welcomes) as url:
        done = subprocess.run([PROGRAM, "doctor", url, "--timeout", "0.3"], capture_output=True, text=True, timeout=20)
    assert done.returncode == 3 and "raise --timeout" in done.stderr, done.stderr
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        with subprocess.Popen([PROGRAM, "doctor", "--conformance-trainer", "tcp://127.0.0.1:0", "--timeout", "30"], stdout=subprocess.PIPE, text=True) as doctor:
            assert "listening" in doctor.stdout.readline()
            doctor.send_signal(number)
            assert doctor.wait(10) == 130, number
    with subprocess.Popen([PROGRAM, "bench", "--only", "cartpole", "--repeats", "100"], stdout=subprocess.DEVNULL) as bench:
        time.sleep(0.5)
        bench.terminate()
        assert bench.wait(10) == 130


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
def test_a_reward_beyond_float32_is_told_as_that(tmp_path):
    with Server(lambda: gymnasium.wrappers.TransformReward(gymnasium.make("CartPole-v1"), lambda _: 1e308)) as server:
        done = subprocess.run([PROGRAM, "train", f"tcp://127.0.0.1:{server.port}", "--steps", "64", "--name", "rich", "--dir", tmp_path], capture_output=True, text=True, timeout=60)
    assert done.returncode == 7 and "the reward is inf, or a number beyond float32" in done.stderr, done.stderr


class Deaths(pettingzoo.ParallelEnv):
    """Of two agents one ends while the other goes on."""
    metadata = {"name": "deaths_v0"}
    possible_agents = ["first", "last"]

    def observation_space(self, agent):
        return gymnasium.spaces.Discrete(3)

    def action_space(self, agent):
        return gymnasium.spaces.Discrete(2)

    def reset(self, seed=None, options=None):
        self.steps, self.agents = 0, list(self.possible_agents)
        return {agent: 0 for agent in self.agents}, {agent: {} for agent in self.agents}

    def step(self, actions):
        self.steps += 1
        were = self.agents
        ended = {agent: self.steps == (3 if agent == "first" else 6) for agent in were}
        self.agents = [agent for agent in were if not ended[agent]]
        return {agent: 1 for agent in were}, {agent: 1.0 for agent in were}, ended, {agent: False for agent in were}, {agent: {"steps": self.steps} for agent in were}


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
def test_every_case_holds_where_one_agent_ends_before_the_others():
    with Server(Deaths, envs=2) as server:
        done = subprocess.run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr


class Outsider(gymnasium.Env):
    """Its bounds are more values than a message's JSON may have."""
    observation_space = gymnasium.spaces.Box(np.arange(140000.0), np.arange(140000.0) + 1, dtype=np.float64)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return self.observation_space.low, {}

    def step(self, action):
        return self.observation_space.low, 0.0, False, False, {}


def test_a_spec_that_is_more_than_json_may_be_is_unsupported():
    with Server(Outsider) as server, pytest.raises(ConsacError, match="UNSUPPORTED.*R7"):
        connect(f"tcp://127.0.0.1:{server.port}", protocol=2)
