"""Protocol 2 and text protocol 1 as an attacker writes them: right unless told otherwise. Written from spec/ alone."""
from __future__ import annotations

import json
import random
import socket
import struct

HEADER = struct.Struct("<4sHHIIQII")
MAGIC = b"\xc0NSC"
HELLO, WELCOME, CONFIGURE, SPEC, RESET, STEP, RESULT, ERROR, GOAWAY, BYE, PING, PONG, PAUSED, RESUMED = range(1, 15)


def frame(kind: int, payload: bytes = b"", request: int = 0, session: int = 0, flags: int = 0, crc: int = 0, length: int | None = None) -> bytes:
    return HEADER.pack(MAGIC, kind, flags, len(payload) if length is None else length, crc, request, session, 0) + payload


def message(kind: int, value, **header) -> bytes:
    return frame(kind, value if isinstance(value, bytes) else json.dumps(value).encode(), **header)


def block(data: bytes) -> bytes:
    return data + bytes(-len(data) % 8)


class Peer:
    """A connection that reads whole frames."""

    def __init__(self, connection: socket.socket, seconds: float = 5.0):
        self.connection = connection
        connection.settimeout(seconds)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        self.connection.sendall(data)

    def take(self, count: int) -> bytes:
        data = bytearray()
        while len(data) < count:
            more = self.connection.recv(count - len(data))
            if not more:
                raise ConnectionError("closed")
            data += more
        return bytes(data)

    def next(self) -> tuple[int, int, int, bytes]:
        """Type, request, session and payload of the next frame that is no PING."""
        while True:
            magic, kind, _, length, _, request, session, _ = HEADER.unpack(self.take(HEADER.size))
            if magic != MAGIC or length > 1 << 26:
                raise ConnectionError("no frame")
            payload = self.take(length)
            if kind == PING:
                self.send(frame(PONG, payload, session=session))
            elif kind not in (PONG, PAUSED, RESUMED):
                return kind, request, session, payload

    def close(self) -> None:
        self.connection.close()


BOX = {"type": "box", "shape": [2], "dtype": "F32", "low": [0, 0], "high": [40, 40]}
CHOICE = {"type": "discrete", "n": 3, "start": 0, "dtype": "I64"}


def spec(behaviours: int = 1, environments: int = 2, length: int = 200) -> dict:
    one = {"agents": ["agent"], "observation": BOX, "action": CHOICE, "masks_actions": False,
           "observation_row": {"bytes": 8, "leaves": [{"path": "", "dtype": "F32", "count": 2, "offset": 0}]},
           "action_row": {"bytes": 4, "leaves": [{"path": "", "dtype": "I32", "count": 1, "offset": 0}]}, "mask_bytes": 0}
    names = ["default"] if behaviours == 1 else [f"kind{i}" for i in range(behaviours)]
    return {"id": "hostile-v0", "environments": environments, "max_episode_steps": 0, "autoreset": "same_step", "training_length": length,
            "model_name": "", "deterministic": True, "behaviours": [{"name": name, **one} for name in names]}


def result(rng: random.Random, behaviours: int, environments: int, first: bool) -> bytes:
    """A RESULT that fits spec(behaviours, environments)."""
    payload = struct.pack("<II", 0, 0)
    for _ in range(behaviours):
        payload += block(struct.pack(f"<{2 * environments}f", *(rng.uniform(0, 40) for _ in range(2 * environments))))
        payload += block(struct.pack(f"<{environments}d", *(0.0 if first else rng.uniform(-1, 1) for _ in range(environments))))
        payload += block(bytes([24 if first else 16] * environments))
    return payload
