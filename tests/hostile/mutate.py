"""Ways to spoil bytes and JSON, drawn from a generator."""
from __future__ import annotations

import copy
import json
import random

from judge import ESCAPES, FAKE_LINE

NASTY_TEXTS = ["", "../../../.bashrc\0", "../../.bashrc", "/etc/passwd", "config.yaml\0", "CON", "nul.consac", "a/b", "a\\b", ".", "..", "~",
               FAKE_LINE, ESCAPES, "\u202egnp.exe", "x" * 70_000, "\ud800", "名前", "\x7f", "%s%n", "-rf", " ", "a" * 255, "model\u0000.consac"]
NASTY_NUMBERS = [0, -1, 1, 2**31, 2**32, 2**53 + 1, 2**63, 2**64, -(2**63), 1e308, -1e308, 0.5, 1e-320, 10**400]
NASTY_VALUES = [None, True, [], {}, [[]], [None], {"a": {}}, "text", 3]


def nested(depth: int, kind: str = "[") -> bytes:
    return (b"[" * depth + b"]" * depth) if kind == "[" else (b'{"a":' * depth + b"1" + b"}" * depth)


def many(count: int) -> bytes:
    return b"[" + b"{}," * count + b"{}]"


def nasty(rng: random.Random):
    """One that is nobody else's: what spoils it further must not come back in the next experiment, nor lie inside itself."""
    return copy.deepcopy(rng.choice([rng.choice(NASTY_TEXTS), rng.choice(NASTY_NUMBERS), rng.choice(NASTY_VALUES)]))


def places(value, path=()):
    """Every path inside a JSON value."""
    yield path
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, member in members:
        yield from places(member, (*path, key))


def spoil_json(rng: random.Random, value) -> bytes:
    """`value` with one to three members replaced, removed, repeated or made monstrous."""
    value = json.loads(json.dumps(value))
    for _ in range(rng.randint(1, 3)):
        path = rng.choice([path for path in places(value) if path] or [()])
        if not path:
            return json.dumps(nasty(rng)).encode()
        owner = value
        for key in path[:-1]:
            owner = owner[key]
        what = rng.random()
        if what < 0.6:
            owner[path[-1]] = nasty(rng)
        elif what < 0.75:
            del owner[path[-1]]
        elif isinstance(owner, list):
            owner.extend([owner[path[-1]]] * rng.choice([1, 3, 300]))
        else:
            owner[rng.choice(NASTY_TEXTS)] = owner[path[-1]]
    text = json.dumps(value).encode()
    monster = rng.random()
    if monster < 0.05:
        text = nested(rng.choice([33, 1000, 100_000]), rng.choice("[{"))
    elif monster < 0.10:
        text = text[:-1] + b',"extra":' + many(rng.choice([1000, 200_000])) + b"}"
    elif monster < 0.15:
        text = text[:-1] + b',"n":' + b"1" * rng.choice([400, 5000, 500_000]) + b"}"
    return text


def spoil_bytes(rng: random.Random, data: bytes) -> bytes:
    """`data` with bytes flipped, cut out, doubled, cut off, or words made extreme."""
    spoilt = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8])):
        if not spoilt:
            return bytes(rng.randrange(256) for _ in range(rng.randint(0, 64)))
        at = rng.randrange(len(spoilt))
        what = rng.random()
        if what < 0.35:
            spoilt[at] = rng.randrange(256)
        elif what < 0.5:
            spoilt[at:at + 4] = rng.choice([b"\xff\xff\xff\xff", b"\0\0\0\0", b"\0\0\xc0\x7f", b"\0\0\x80\xff", b"\xff\xff\xff\x7f"])
        elif what < 0.65:
            del spoilt[at:at + rng.choice([1, 8, 64, 4096])]
        elif what < 0.8:
            spoilt[at:at] = spoilt[at:at + rng.choice([1, 8, 64, 4096])]
        else:
            del spoilt[at:]
    return bytes(spoilt)
