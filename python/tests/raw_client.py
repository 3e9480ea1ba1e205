"""Trainers of a few lines: of protocol 2 in raw frames, whose answers are taken apart by the words of the specification, and of text protocol 1."""
import json
import socket
import struct
from dataclasses import replace

import numpy as np

from consac import wire
from consac.serve import Limits
from consac.wire import CONFIGURE, ERROR, HELLO, PING, RESET, RESULT, STEP, Frame, pack
from waiting import ENDS_S

PATIENT = Limits(grace_s=ENDS_S)  # nobody is taken for a trainer of text protocol 1 because the machine is slow


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
