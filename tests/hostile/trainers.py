"""Hostile trainers against `consac serve`, beside one that behaves: its session must not notice them."""
from __future__ import annotations

import random
import socket
import struct
import time

from judge import ESCAPES, FAKE_LINE, Arena, Ended, Limits, Running
from mutate import many, nested, spoil_bytes, spoil_json
import wire

HELLO = {"protocol": [2, 2], "client": "hostile 1", "capabilities": []}


class Good:
    """A trainer that does everything right, as `cartpole-v1` with two environments wants it."""

    def __init__(self, port: int):
        self.peer = wire.Peer(socket.create_connection(("127.0.0.1", port), 10), 10)
        self.peer.send(wire.message(wire.HELLO, HELLO))
        self._expect(wire.WELCOME)
        self.request = 0
        self._ask(wire.CONFIGURE, b"{}", wire.SPEC)
        self._ask(wire.RESET, struct.pack("<II", 0, 0) + wire.block(b"\1\1"), wire.RESULT)

    def _expect(self, wanted: int) -> None:
        kind, _, self.session, payload = self.peer.next()
        if kind != wanted:
            raise ConnectionError(f"the good trainer got type {kind}, not {wanted}: {payload[:200]!r}")

    def _ask(self, kind: int, payload: bytes, wanted: int) -> None:
        self.request += 1
        self.peer.send(wire.frame(kind, payload, request=self.request, session=self.session))
        self._expect(wanted)

    def step(self) -> None:
        self._ask(wire.STEP, struct.pack("<II", 0, 0) + wire.block(b"\1\1") + wire.block(struct.pack("<ii", 0, 1)), wire.RESULT)


def conversation(rng: random.Random) -> list[bytes]:
    """What a trainer sends, one element a write; spoilt at one place."""
    hello = {"protocol": [2, 2], "client": rng.choice(["h", FAKE_LINE, ESCAPES]), "capabilities": rng.choice([[], ["shm"], ["crc", "render"]])}
    if rng.random() < 0.3:
        hello["resume"] = rng.choice(["r" * 32, "x" * 3000, FAKE_LINE])
    messages = [(wire.HELLO, hello, 0), (wire.CONFIGURE, {"autoreset": rng.choice(["same_step", "next_step", "disabled"])}, 1),
                (wire.RESET, struct.pack("<II", 3, 0) + wire.block(b"\1\1") + struct.pack("<qq", 1, 2) + wire.block(struct.pack("<I", 2) + b"{}"), 2),
                (wire.STEP, struct.pack("<II", 0, 0) + wire.block(b"\1\1") + wire.block(struct.pack("<ii", 0, 1)), 3)]
    spoilt = rng.randrange(len(messages))
    writes = []
    for place, (kind, value, request) in enumerate(messages):
        header = {"request": request, "session": 0 if kind == wire.HELLO else rng.choice([1, 1, 2, 9])}
        if place != spoilt:
            writes.append(wire.message(kind, value, **header))
            continue
        way = rng.random()
        if way < 0.5:
            payload = spoil_json(rng, value) if not isinstance(value, bytes) else spoil_bytes(rng, value)
            writes.append(wire.message(kind, payload, **header))
        elif way < 0.8:
            writes.append(spoil_bytes(rng, wire.message(kind, value, **header)))
        elif way < 0.9:
            monster = rng.choice([nested(200_000), many(250_000), b'{"expect":' + many(250_000) + b"}", b'{"a":' + b"9" * 900_000 + b"}"])
            writes.append(wire.message(kind, monster, **header))
        else:
            writes.append(wire.frame(kind, b"", length=rng.choice([1, 4096, 1 << 26, 2**32 - 1]), **header))
    return writes


def text_conversation(rng: random.Random) -> list[bytes]:
    actions = ["0\n", "1\n", "7\n", "-1\n", "1.5\n", "01\n", "\n" * 50, "x" * 100_000, FAKE_LINE, ESCAPES, "0,1\n", "nan\n", "\0\n"]
    return [rng.choice(actions).encode() for _ in range(rng.randint(1, 12))]


def attack(port: int, rng: random.Random) -> None:
    try:
        with socket.create_connection(("127.0.0.1", port), 5) as connection:
            connection.settimeout(rng.choice([0.0, 0.02]))
            for data in text_conversation(rng) if rng.random() < 0.25 else conversation(rng):
                if rng.random() < 0.05:
                    data = data[:rng.randrange(len(data) + 1)]
                connection.settimeout(2)
                connection.sendall(data)
                connection.settimeout(rng.choice([0.001, 0.05]))
                try:
                    connection.recv(1 << 16)
                except TimeoutError:
                    pass
    except OSError:
        pass


def experiment(program: str, arena: Arena, rng: random.Random) -> Ended:
    port_file = arena.outer / "attack-port"
    running = Running([program, "serve", "cartpole-v1", "--envs", "2", "--port", "0", "--port-file", str(port_file), "--trainers", "4", "--deadline", "5"], arena)
    findings = []
    try:
        until = time.monotonic() + 20
        while not (port_file.exists() and port_file.read_text().strip()) and time.monotonic() < until:
            time.sleep(0.01)
        port = int(port_file.read_text())
        good = Good(port)
        for _ in range(rng.randint(3, 12)):
            attack(port, rng)
            began = time.monotonic()
            good.step()
            if time.monotonic() - began > 3:
                findings.append(f"the good trainer waited {time.monotonic() - began:.1f} s for one step")
        good.peer.close()
    except (OSError, ConnectionError, ValueError) as error:
        findings.append(f"the good trainer was disturbed: {error!r}")
    if running.alive():
        running.process.terminate()
    else:
        findings.append("the server ended")
    ended = running.end(Limits(seconds=60))
    ended.findings += findings
    return ended
