"""spec/conformance/protocol2: the frames through our reader, the conversations with our server."""
import json
import os
import pathlib
import socket
import struct
import subprocess
import time

import gymnasium
import numpy as np
import pytest

from consac import wire
from consac.serve import Server

CASES = pathlib.Path(__file__).parents[2] / "spec/conformance/protocol2"
PROGRAM = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", "")) / "cli/consac"
FRAMES, CONVERSATIONS = (json.loads((CASES / name).read_text()) for name in ("frames.json", "server.json"))


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
    """One case under way."""

    def __init__(self, port):
        self.port, self.session, self.kept = port, 0, {}
        self.connect()

    def connect(self):
        self.sock, self.reader = socket.create_connection(("127.0.0.1", self.port), 5), wire.FrameReader(wire.LARGEST_FRAME)

    def next(self):
        while not (frame := self.reader.next()):
            data = self.sock.recv(65536)
            if not data:
                return None
            self.reader.feed(data)
        return self.next() if frame.type == wire.PING else frame

    def send(self, what):
        if "hex" in what:
            return self.sock.sendall(bytes.fromhex(what["hex"]))
        payload = wire.dump_json(what["json"]) if "json" in what else what.get("text", "").encode()
        if "payload" in what:
            payload = self.payload(what["payload"])
        kind = what["type"] if isinstance(what["type"], int) else getattr(wire, what["type"])
        self.sock.sendall(wire.pack(wire.Frame(kind, payload, what["request"], self.session)))

    def payload(self, kind):
        pad = lambda data: data + bytes(-len(data) % 8)
        if kind in ("all", "none", "seeded"):
            out = pad(struct.pack("<II", kind == "seeded", 0) + bytes([kind != "none"] * self.envs))
            return out + struct.pack(f"<{self.envs}q", *range(11, 11 + self.envs)) * (kind == "seeded")
        actions = [0] * self.envs
        if kind == "illegal":
            actions[0] = 100000
        out = pad(pad(bytes(8) + b"\1" * self.envs) + np.array(actions, "<i4").tobytes())
        return out[:-1] if kind == "short" else out

    def expect(self, what):
        frame = self.next()
        if what.get("closed"):
            assert frame is None, frame
            return
        assert frame is not None and frame.type == getattr(wire, what["type"]), (what, frame)
        assert frame.request == what.get("request", frame.request)
        said = json.loads(frame.payload) if frame.type in (wire.WELCOME, wire.SPEC, wire.ERROR) else {}
        if frame.type == wire.WELCOME:
            self.session, self.resume = said["session"], said["resume"]
        if frame.type == wire.SPEC:
            self.envs = said["environments"]
        for key in ("severity", "resumed", "last_request"):
            assert said.get(key) == what.get(key, said.get(key)), (key, said)
        if "code" in what:
            assert said["code"] in (what["code"] if isinstance(what["code"], list) else [what["code"]]), said
        assert "path" not in what or isinstance(said["path"], str)
        assert "text" not in what or bytes(frame.payload) == what["text"].encode()
        payload = bytearray(frame.payload)
        if frame.type == wire.RESULT:
            payload[4:8] = bytes(4)  # the time that the engine took
        if "same_as" in what:
            assert payload == self.kept[what["same_as"]]
        if "keep" in what:
            self.kept[what["keep"]] = payload

    def reconnect(self, _):
        self.sock.close()
        for _ in range(100):
            self.connect()
            self.sock.sendall(wire.pack(wire.Frame(wire.HELLO, wire.dump_json({"protocol": [2, 2], "resume": self.resume}), 0, self.session)))
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


@pytest.mark.parametrize("case", CONVERSATIONS, ids=lambda case: case["name"])
def test_conversations_with_our_server(case):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3) as server:
        conversation = Conversation(server.port)
        for step in case["steps"]:
            (name, what), = step.items()
            getattr(conversation, name)(what)
        conversation.sock.close()


@pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
def test_the_doctor_finds_nothing_wrong_with_our_server():
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3) as server:
        done = subprocess.run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
