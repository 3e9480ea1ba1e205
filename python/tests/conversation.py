"""The trainer's end of a case of spec/conformance/protocol2/server.json, step by step, for servers with an action space of two choices."""
import contextlib
import itertools
import json
import socket
import struct
import time

import gymnasium
import numpy as np

from consac import wire
from consac.goals import ACHIEVED, DESIRED
from consac.layout import align
from result_check import ResultCheck


WRONG_SETTINGS = ("too high", "too low", "infinity", "infinity without a bound", "too high in the first", "too high by the last", "too low by the last")  # of parameters

class Conversation:
    """One case under way, with a server of an action space of two choices. Every RESULT is judged."""

    def __init__(self, port):
        self.port, self.kept, self.seen, self.last, self.judged, self.resume, self.over, self.envs, self.held = port, {}, {}, 0, 0, "", False, 1, b""
        self.paid, self.stepped, self.welcomed = [], False, 0
        self.capabilities, self.parameters, self.set_wrong = [], [], False
        self.connect()

    def connect(self, _=None):
        self.sock, self.reader = socket.create_connection(("127.0.0.1", self.port), 5), wire.FrameReader(wire.LARGEST_FRAME)
        self.session, self.flags = 0, 0

    def next(self, pong=None):
        """The next answer; `pong`: a PONG of these bytes is one."""
        while True:
            while not (frame := self.reader.next()):
                data = self.sock.recv(65536)
                if not data:
                    return None
                self.reader.feed(data)
            if frame.type == wire.PING:
                self.write(wire.PONG, 0, bytes(frame.payload))
            elif frame.type == wire.PONG:
                if bytes(frame.payload) == pong:
                    return frame
            elif frame.type not in (wire.PAUSED, wire.RESUMED) and not frame.type & wire.OPTIONAL:
                return frame

    def write(self, kind, request, payload=b"", how={}):
        session = 0 if "no_session" in how else self.session + ("other_session" in how)
        crc = how.get("crc")
        data = bytearray(wire.pack(wire.Frame(kind, payload, request, session, wire.FLAG_CRC if crc in ("right", "wrong") else self.flags)))
        data[12] ^= crc in ("wrong", "without flag")
        if "flip" in how:
            data[how["flip"][0]] ^= how["flip"][1]
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
            expect = expected(what["expect"], self.offered) if "expect" in what else None
            if what["json"].get("max_frame") == "too small":  # frames are short here
                self.over = True
                return
            payload = wire.dump_json(what["json"] | ({"resume": self.resume} if "resume" in what else {}) | ({"expect": expect} if expect else {}))
        payload = payload.ljust(what.get("blanks", 0))
        if "floats" in what or "token" in what or what.get("leaf", "discrete") not in ("discrete", "discrete, below"):  # there are two choices; and no token is asked for
            self.over = True
            return
        if what.get("payload", "").startswith("goals"):
            payload = self.goals(what["payload"])
            if payload is None:  # no observation has such a number
                self.over = True
                return
        elif ", set " in what.get("payload", ""):
            base, how = what["payload"].split(", set ")
            payload, self.over = self.with_parameters(self.payload(base), how)
            self.set_wrong, self.at_fault = how in WRONG_SETTINGS, 0 if how.endswith("in the first") else self.envs - 1  # else the action may be
            if self.over:
                return
        elif "payload" in what:
            self.set_wrong, self.at_fault = what["payload"] == "illegal of the last", self.envs - 1
            payload = self.payload(what["payload"] + {"discrete": " by one", "discrete, below": " below"}.get(what.get("leaf"), ""))
        request = {"next": self.last + 1, "again": self.last}.get(what["request"], what["request"])
        self.ask(kind, request, payload, what)

    def ask(self, kind, request, payload, how={}):
        self.stepped = kind == wire.STEP and bytes(payload[8:8 + self.envs]) == b"\1" * self.envs
        if kind in (wire.RESET, wire.STEP) and len(payload) >= 8 + self.envs and request != self.judged:
            self.check.ask(kind == wire.STEP, payload[8:8 + self.envs])
        if request == self.last + 1 and kind != wire.HELLO:
            self.last = request
        self.write(kind, request, payload, how)

    def payload(self, kind):
        pad = lambda data: data + bytes(-len(data) % 8)
        only_first, others = bytes([1] + [0] * (self.envs - 1)), bytes([0] + [1] * (self.envs - 1))
        reset = lambda flags=0, chosen=b"\1" * self.envs: pad(struct.pack("<II", flags, 0) + chosen)
        step = lambda chosen=b"\1" * self.envs, first=0, zero=0, actions=None: pad(pad(struct.pack("<II", 0, zero) + chosen) + np.array(actions or [first] + [0] * (self.envs - 1), "<i4").tobytes())
        seeds = lambda first=11: struct.pack(f"<{self.envs}q", first, *range(12, 11 + self.envs))
        options = lambda text: pad(reset(2) + struct.pack("<I", len(text)) + text)
        two = bytes([2] + [1] * (self.envs - 1))
        scattered = struct.pack(f"<{self.envs}q", *range(97 + 3 * self.envs, 97, -3))

        def padded(payload, used, behind=0):
            """With padding of 255 behind the first `used` bytes, and behind `behind` in the block that comes then."""
            end = align(used) + behind
            return payload[:used] + b"\xff" * (align(used) - used) + payload[align(used):end] + b"\xff" * (align(end) - end) + payload[align(end):]
        return {
            "first seeded": lambda: reset(1, only_first) + struct.pack(f"<{self.envs}q", 11, *[-5] * (self.envs - 1)),
            "all, padding": lambda: padded(reset(), 8 + self.envs), "legal, padding": lambda: padded(step(), 8 + self.envs, 4 * self.envs),
            "options, padding": lambda: padded(options(b'{"level":1}'), 8 + self.envs, 4 + 11),
            "largest seeds": lambda: reset(1) + struct.pack(f"<{self.envs}q", *[(1 << 63) - 1] * self.envs),
            "seeded options": lambda: reset(3) + seeds() + options(b'{"difficulty":1}')[len(reset()):],
            "illegal of the last": lambda: step(actions=[0] * (self.envs - 1) + [100000]), "seeds from 0": lambda: reset(1) + struct.pack(f"<{self.envs}q", *range(self.envs)),
            "empty": lambda: b"", "none": lambda: reset(0, bytes(self.envs)), "all": reset, "two reset": lambda: reset(0, two), "first reset": lambda: reset(0, only_first),
            "unknown flag": lambda: reset(64), "seeded": lambda: reset(1) + seeds(), "scattered seeds": lambda: reset(1) + scattered, "negative seed": lambda: reset(1) + seeds(-5), "options": lambda: options(b'{"difficulty":1}'),
            "bad options": lambda: options(b'{"difficulty"'), "short reset": lambda: reset()[:-8], "long reset": lambda: reset() + bytes(8), "legal": step,
            "short": lambda: step()[:-1], "long": lambda: step() + bytes(8), "nonzero": lambda: step(zero=1), "two": lambda: step(two), "first": lambda: step(only_first),
            "others": lambda: step(others), "nobody": lambda: step(bytes(self.envs)), "unknown flag, long": lambda: reset(64) + bytes(3),
            "nonzero, short": lambda: step(zero=1)[:-1], "two, short": lambda: step(two)[:-1], "four bytes": lambda: bytes(4), "no options": lambda: options(b""), "illegal": lambda: step(first=100000), "illegal but not stepped": lambda: step(others, 100000),
            "negative last seed": lambda: reset(1) + seeds()[:-8] + struct.pack("<q", -5), "illegal below": lambda: step(first=-1),
            "illegal by one": lambda: step(first=2), "illegal of the absent": lambda: step(actions=[0 if state & wire.ACTIVE else 100000 for state in self.check.states[0]]),
        }[kind]()

    def with_parameters(self, payload, how):
        """With flag 4 and parameters behind; and whether no parameter has a bound that it takes. What is wrong is of the last environment, or of the first."""
        values, count = np.full((self.envs, len(self.parameters)), np.nan), len(self.parameters)
        wrong, bounds = how in WRONG_SETTINGS, {"too high": "high", "too low": "low"}.get(how[:8].rstrip())
        number = lambda one, name, otherwise: otherwise if one.get(name) is None else one[name]
        for place, one in enumerate(self.parameters):
            low, high = number(one, "low", -np.inf), number(one, "high", np.inf)
            highest = high if np.isfinite(high) else one["default"] + 1
            values[:, place] = {"nothing": np.nan, "high in the last": np.nan, "low": low if np.isfinite(low) else one["default"] - 1}.get(how, highest if wrong or how == "high" else one["default"])
            boundless = {"infinity without a bound": np.inf}.get(how) if np.isinf(high) else None
            last = {"high": high + 1 + abs(high), "low": low - 1 - abs(low)}[bounds] if bounds else {"infinity": np.inf, "infinity without a bound": boundless, "high in the last": highest}.get(how)
            alone = not how.endswith("by the last") or place == max([at for at, other in enumerate(self.parameters) if other.get(bounds) is not None], default=-1)
            if last is not None and not (bounds and np.isinf(last)) and alone:
                values[0 if how.endswith("in the first") else -1, place] = last
        bounded = any(number(one, bounds, None) is not None for one in self.parameters) if bounds else how != "infinity without a bound" or any(number(one, "high", None) is None for one in self.parameters)
        block = bytearray(values.astype("<f8").tobytes())
        for index in np.flatnonzero(np.isnan(values)):  # of any bits: quiet and signalling, with either sign
            struct.pack_into("<Q", block, 8 * index, (0x7FF8000000000000, 0xFFF8000000000001, 0x7FF0000000000001, 0xFFFFFFFFFFFFFFFF)[index % 4])
        data = bytes([payload[0] | 4]) + payload[1:] + block
        return {"short": data[:-8], "long": data + bytes(8)}.get(how, data), bool(count) and not bounded

    def goals(self, kind):
        """A RELABEL of one row of its space again and again: twice, or as often as `kind` says; None where no observation has such a number."""
        layout = self.check.behaviours[0].observation
        if kind in ("goals of others", "goals of the last"):  # there is one behaviour
            return None
        if kind == "goals, as they were":
            self.relabelled = len(self.paid)
            payload = struct.pack("<II", 0, len(self.paid)) + b"".join(row for row, _ in self.paid)
            return payload.ljust(align(len(payload)), b"\0")
        size = layout.row_bytes
        rows = {"goals, none": 0, "goals, 1 MiB": (wire.LARGEST_RELABEL - 8) // max(size, 8)}.get(kind, 2)
        payload = bytearray((b"\xff" if kind == "goals, padding" else b"\0") * align(8 + rows * size))
        struct.pack_into("<II", payload, 0, 0, rows)
        layout.space.seed(1)  # the same row each time
        row = layout.space.sample()
        wrongs = {"goals, NaN": np.nan, "goals, infinity": np.inf, "goals, far": np.finfo(np.float32).max, "goals, beyond": 100, "goals, illegal": 100, "goals, rest illegal": np.nan}
        spoilt = kind not in wrongs
        for leaf, view in zip(layout.leaves, layout.views(payload, rows, 8)):
            view[:] = layout.pick(row, leaf)
            floats, is_goal = leaf.dtype.kind == "f", leaf.path[0] in (ACHIEVED, DESIRED)
            can_be = {"goals, far": leaf.path[0] == DESIRED and floats, "goals, beyond": is_goal and floats and leaf.space.high.max() < 100,
                      "goals, illegal": is_goal and not isinstance(leaf.space, gymnasium.spaces.Box), "goals, rest illegal": not is_goal}.get(kind, is_goal and floats)
            if can_be and kind in wrongs:
                view[-1:], spoilt = wrongs[kind] if floats else 100, True
        self.relabelled = rows
        payload = {"goals, short": payload[:-8], "goals, long": payload + bytes(8), "goals of nobody": b"\xff" * 4 + payload[4:],
                   "goals, without end": payload[:4] + b"\xff" * 4 + payload[8:]}.get(kind, payload)
        return bytes(payload) if spoilt else None

    def keep_paid(self, payload):
        """What a STEP led to, of slots that go on, and what it paid."""
        rewards = align(8 + self.envs * self.row_bytes)
        for env in range(self.envs if self.stepped else 0):
            if payload[rewards + 8 * self.envs + env] == wire.ACTIVE:
                at = 8 + env * self.row_bytes
                self.paid.append((bytes(payload[at:at + self.row_bytes]), struct.unpack_from("<d", payload, rewards + 8 * env)[0]))

    def looked_at(self, payload):
        """Without rows of slots that have none of 16, 1 and 2, infos and the time that was taken. One behaviour of one agent and no masks."""
        size = self.row_bytes
        states = align(8 + self.envs * size) + 8 * self.envs
        end = align(states + self.envs)
        end = align(end + size * sum(state & 4 != 0 for state in payload[states:states + self.envs]))  # the final rows
        payload = bytes([payload[0] & 1]) + payload[1:4] + bytes(4) + payload[8:end]
        return b"".join(payload[8 + env * size:8 + (env + 1) * size] for env in range(self.envs) if payload[states + env] & 19) + payload[states - 8 * self.envs:]

    def expect(self, what):
        if "gone" in what:
            self.sock.settimeout(what.get("within", self.sock.gettimeout()))
            with contextlib.suppress(ConnectionError):
                while self.sock.recv(65536):
                    pass
            return
        frame = self.next(what["text"].encode() if what.get("type") == "PONG" else None)
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
            assert not said["resumed"] or (said["session"], said["resume"], set(said["capabilities"])) == (self.welcomed, self.resume, set(self.capabilities))
            self.welcomed, self.capabilities = said["session"], said["capabilities"]
            self.session, self.resume, self.flags = said["session"], said["resume"], wire.FLAG_CRC if "crc" in said["capabilities"] else 0
            self.reader.limit = said["max_frame"]
        if frame.type == wire.SPEC:
            assert said["autoreset"] == what.get("autoreset", "same_step")
            self.envs, self.autoreset, self.check = said["environments"], said["autoreset"], ResultCheck(said, said["autoreset"], self.capabilities)
            self.parameters = said["parameters"] if "parameters" in self.capabilities else []
            self.offered, self.row_bytes = said["behaviours"], said["behaviours"][0]["observation_row"]["bytes"]
        self.over = self.over or not self.has(what.get("needs", {}), said)
        code = what.get("code", said.get("code"))
        assert said.get("code") in (code if isinstance(code, list) else [code]), said
        for key, value in what.get("members", {}).items():
            within = isinstance(value, dict) and value["from"] <= said.get(key) <= value["to"]
            assert within or said.get(key) == value, (key, said)
        assert said.get("severity") == what.get("severity", said.get("severity")), said
        assert "path" not in what or said["path"] in what["path"], said
        assert frame.type != wire.ERROR or len(frame.payload) <= wire.LARGEST_BEFORE_WELCOME and isinstance(said["message"], str)
        assert "env" not in what or (said.get("env") is None if what["env"] == "none" else isinstance(said["env"], int))
        if what.get("env") == "first" and self.set_wrong:
            assert said["env"] == self.at_fault
        else:
            assert what.get("env") != "first" or said["env"] == next(slot for slot, state in enumerate(self.check.states[0]) if state & wire.ACTIVE)
        assert "text" not in what or bytes(frame.payload) == what["text"].encode()
        payload = bytearray(frame.payload)
        if frame.type == wire.REWARDS:
            assert len(payload) == 8 * self.relabelled and np.isfinite(np.frombuffer(payload)).all()
            assert "alike" not in what or np.allclose(np.frombuffer(payload), np.frombuffer(payload)[:1], rtol=1e-4, atol=1e-4)
            assert "paid" not in what or np.allclose(np.frombuffer(payload), [reward for _, reward in self.paid], rtol=1e-4, atol=1e-4)
        if frame.type == wire.RESULT:
            if frame.request != self.judged:
                assert self.check.judge(payload) is None
                self.judged, self.result = frame.request, payload
                self.keep_paid(payload)
        self.compare(what, payload, self.looked_at(payload) if frame.type == wire.RESULT else payload)

    @staticmethod
    def has(needs, said):
        """Whether WELCOME or SPEC has what the case needs."""
        return all({*wanted["has"]} <= {*said[key]} if isinstance(wanted.get("has"), list) else wanted["has"] in said[key] if "has" in wanted else wanted["from"] <= said[key] <= wanted["to"] for key, wanted in needs.items())

    def compare(self, what, payload, looked_at):
        """A payload, and what is looked at of it or of a whole play, with those that were kept."""
        if "repeats" in what:  # what is served here is the same each time
            assert looked_at == self.seen[what["repeats"]]
        for wanted, compared in (("others_as", range(self.envs - 1)), ("last_as", [self.envs - 1]), ("goes_on_as", range(self.envs))):
            if wanted not in what:
                continue
            kept = self.kept[what[wanted]]
            goes_on = [env for env in compared if not self.ends(payload, env) and not self.ends(kept, env) and (wanted != "goes_on_as" or self.autoreset != "same_step" or not self.begins(kept, env))]
            assert wanted != "goes_on_as" or goes_on, "no environment goes on"
            for env in goes_on:
                assert self.of(payload, env) == self.of(kept, env), (what, env)
        if "differs" in what and any(self.of(payload, env) == self.of(self.kept[what["differs"]], env) for env in range(self.envs)):
            self.over = True
            return
        if "unlike" in what and looked_at == self.seen[what["unlike"]]:
            self.over = True
            return
        if "other_than" in what:
            assert looked_at != self.seen[what["other_than"]], what
        if "same_as" in what:
            assert payload == self.kept[what["same_as"]]
        if "begins_as" in what:
            assert looked_at == self.seen[what["begins_as"]]
        if "keep" in what:
            self.kept[what["keep"]], self.seen[what["keep"]] = payload, looked_at

    def of(self, payload, env):
        """What a RESULT says of an environment, but for final rows. One behaviour of one agent and no masks."""
        rewards = align(8 + self.envs * self.row_bytes)
        at, state = 8 + env * self.row_bytes, payload[rewards + 8 * self.envs + env]
        return bytes(payload[at:at + self.row_bytes] * (state & 19 != 0)) + bytes(payload[rewards + 8 * env:rewards + 8 * env + 8]) + bytes([state])

    def ends(self, payload, env):
        return payload[align(8 + self.envs * self.row_bytes) + 8 * self.envs + env] & 3 != 0

    def begins(self, payload, env):
        return payload[align(8 + self.envs * self.row_bytes) + 8 * self.envs + env] & 8 != 0

    def beside(self, _):
        """A second trainer, while this one is there."""
        other = Conversation(self.port)
        other.write(wire.HELLO, 0, wire.dump_json({"protocol": [2, 2]}))
        frame = other.next()
        assert frame.type == wire.WELCOME or json.loads(bytes(frame.payload))["code"] == "CAPACITY"
        other.write(wire.BYE, 0)
        other.sock.close()

    def play(self, what):
        looked_at = b""  # of the whole play
        anyone = lambda: any(state & wire.ACTIVE for states in self.check.states for state in states)
        for played in itertools.takewhile(lambda played: played < what.get("steps", 0) or not anyone(), range(1000)):
            ended = bytes(self.check.over(env) for env in range(self.envs))
            if what.get("until") == "over" and any(ended) or what.get("until") == "ended" and played and any(self.ends(self.result, env) for env in range(self.envs)):
                return
            reset = self.autoreset == "disabled" and any(ended)
            self.ask(wire.RESET if reset else wire.STEP, self.last + 1, (bytes(8) + ended + bytes(-self.envs % 8)) if reset else self.payload("legal"))
            self.expect({"type": "RESULT", "request": self.last} | ({"or": "UNSUPPORTED"} if reset else {}))
            if reset and self.judged != self.last:  # all of them or none (R47)
                self.ask(wire.RESET, self.last + 1, self.payload("all"))
                self.expect({"type": "RESULT", "request": self.last})
            looked_at += self.looked_at(self.result)
        self.over = self.over or what.get("until") in ("over", "ended")
        assert anyone()
        self.compare(what, self.result, looked_at)

    def wait(self, _):
        """The doctor does, where it is given time."""
        self.over = True

    def half_close(self, _):
        self.sock.shutdown(socket.SHUT_WR)

    def reconnect(self, how):
        """With "beside" the connection stands, until the server closes it."""
        before = self.sock
        if how != "beside":
            before.close()
        for _ in range(100):
            self.connect()
            self.write(wire.HELLO, 0, wire.dump_json({"protocol": [2, 2], "resume": self.resume, "capabilities": self.capabilities + (how["also"] if isinstance(how, dict) else [])}))
            data = self.sock.recv(65536)
            self.reader.feed(data)
            peek = wire.FrameReader(wire.LARGEST_FRAME)
            peek.feed(data)
            frame = peek.next() if data else None
            if frame and frame.type == wire.WELCOME:
                with contextlib.suppress(ConnectionResetError):  # closed with bytes that nobody has read
                    while how == "beside" and before.recv(65536):
                        pass
                return
            self.sock.close()
            time.sleep(0.02)
        raise AssertionError("the session cannot be taken up again")


def expected(how, offered):
    """What CONFIGURE expects of the behaviours that SPEC offered: them as they are, in other words, or the first otherwise."""
    first = {"with a member more": {"later": None}, "of another name": {"name": "somebody else"}}.get(how, {})
    return with_fractions(offered) if how == "with fractions" else [offered[0] | first, *offered[1:]]


def with_fractions(value):
    """The same numbers, written otherwise: 1 as 1.0."""
    if isinstance(value, dict):
        return {key: with_fractions(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [with_fractions(inner) for inner in value]
    return float(value) if type(value) is int else value
