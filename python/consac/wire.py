"""Protocol 2 as bytes: frames and JSON. No sockets here; spec/protocol2.md is the law. Spaces and rows: layout.py."""
from __future__ import annotations

import json
import math
import re
import struct
from dataclasses import dataclass

import numpy as np

from .names import quote

MAGIC = 0x43534EC0  # the bytes C0 4E 53 43
VERSION = 2
HEADER = struct.Struct("<IHHIIQII")  # magic, type, flags, length, crc, request, session, reserved
FLAG_CRC = 1
OPTIONAL = 0x8000  # a type with this bit is skipped by those who do not know it
LARGEST_BEFORE_WELCOME = 4096
LARGEST_FRAME = 64 << 20
LARGEST_JSON = 1 << 20
LARGEST_RELABEL = 1 << 20  # bytes of a RELABEL that every server takes
DEEPEST_JSON = 64
MOST_JSON_VALUES = 1 << 18
_STRING = re.compile(rb'"[^"]*"?')
_EMPTY = re.compile(rb"[\[{][ \t\r\n]*[\]}]")
_HUGE = re.compile(rb"[eE]\+?\d{3}|\d{300}")  # a number that may be beyond a double
_SURROGATE = re.compile(rb"\\u[dD][89a-fA-F]")
LARGEST_WHOLE = (1 << 53) - 1  # that every language's JSON has exactly
_NO_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))

HELLO, WELCOME, CONFIGURE, SPEC, RESET, STEP, RESULT, ERROR, GOAWAY, BYE, PING, PONG, PAUSED, RESUMED, RENDER, FRAME, RELABEL, REWARDS = range(1, 19)

TERMINATED, TRUNCATED, FINAL, FIRST, ACTIVE = 1, 2, 4, 8, 16  # a slot's state in RESULT
PART_FINALS, PART_INFOS, PART_STATISTICS, PART_GROUPS = 1, 2, 4, 8  # parts of a RESULT
WITH_SEEDS, WITH_OPTIONS, WITH_PARAMETERS = 1, 2, 4  # flags of a RESET; the last of a STEP too

DTYPES = {"BOOL": np.bool_, "U8": np.uint8, "I8": np.int8, "U16": np.uint16, "I16": np.int16, "U32": np.uint32, "I32": np.int32,
          "U64": np.uint64, "I64": np.int64, "F32": np.float32, "F64": np.float64}
NAMES = {np.dtype(dtype): name for name, dtype in DTYPES.items()}


class WireError(Exception):
    """Bytes that are no protocol 2. `code` is the error's name in spec/protocol2.md, `request` the number in the header that is refused, where that is known."""

    def __init__(self, code: str, message: str, request: int | None = None):
        super().__init__(f"{code}: {message}")
        self.code, self.message, self.request = code, message, request


@dataclass
class Frame:
    """One frame: its header's fields and its payload."""

    type: int
    payload: bytes | memoryview = b""
    request: int = 0
    session: int = 0
    flags: int = 0


def pack(frame: Frame) -> bytes:
    """The frame as bytes, header and payload in one piece."""
    return HEADER.pack(MAGIC, frame.type, frame.flags, len(frame.payload), crc32c(frame.payload) if frame.flags & FLAG_CRC else 0,
                       frame.request, frame.session, 0) + bytes(frame.payload)


def unpack_header(data, limit: int) -> tuple[Frame, int, int]:
    """A frame without its payload, the payload's length and its CRC, from 32 bytes; `limit` bounds the length."""
    magic, kind, flags, length, crc, request, session, reserved = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise WireError("BAD_MAGIC", f"a frame begins with {shown_bytes(data[:4])}, expected {shown_bytes(struct.pack('<I', MAGIC))}; is this protocol 2?")
    if flags & ~FLAG_CRC or reserved != 0:
        raise WireError("MALFORMED", f"a frame has flags {flags:#x} and reserved {reserved}; unknown bits must be 0", request)
    if length > limit:
        raise WireError("FRAME_TOO_LARGE", f"a frame claims {length} bytes, at most {limit} are taken", request)
    return Frame(kind, b"", request, session, flags), length, crc


def check_crc(frame: Frame, crc: int) -> None:
    """Raises CRC_MISMATCH unless the payload is whole."""
    if frame.flags & FLAG_CRC and crc32c(frame.payload) != crc:
        raise WireError("CRC_MISMATCH", "a frame's payload was changed on its way", frame.request)


class FrameReader:
    """Bytes in, frames out, however they are cut. `limit` may be raised once WELCOME is there."""

    def __init__(self, limit: int = LARGEST_BEFORE_WELCOME):
        self.limit, self._data = limit, bytearray()

    def feed(self, data) -> None:
        self._data += data

    def next(self) -> Frame | None:
        """The next whole frame, or None."""
        if len(self._data) < HEADER.size:
            if self._data and not struct.pack("<I", MAGIC).startswith(bytes(self._data[:4])):
                unpack_header(bytes(self._data).ljust(HEADER.size, b"\0"), self.limit)
            return None
        frame, length, crc = unpack_header(self._data, self.limit)
        end = HEADER.size + length
        if len(self._data) < end:
            return None
        frame.payload = bytes(self._data[HEADER.size:end])
        del self._data[:end]
        check_crc(frame, crc)
        return frame


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        value = byte
        for _ in range(8):
            value = (value >> 1) ^ (0x82F63B78 if value & 1 else 0)
        table.append(value)
    return table


_CRC_TABLE = _crc_table()


def crc32c(data) -> int:
    """CRC-32C (Castagnoli), as in iSCSI. Slow in Python: loopback does without."""
    crc = 0xFFFFFFFF
    for byte in bytes(data):
        crc = _CRC_TABLE[(crc ^ byte) & 0xFF] ^ (crc >> 8)
    return crc ^ 0xFFFFFFFF


def dump_json(value) -> bytes:
    return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()


def canonical_json(value) -> bytes:
    return json.dumps(value, separators=(",", ":"), sort_keys=True, allow_nan=False).encode()


def load_json(payload, limit: int = LARGEST_JSON, values: int = MOST_JSON_VALUES) -> dict:
    """The object in a JSON payload of at most `limit` bytes and `values` values, in time linear in them; MALFORMED says what is wrong with it."""
    if len(payload) > limit:
        raise WireError("MALFORMED", f"a JSON payload of {len(payload)} bytes; at most {limit} are taken")

    def no_constant(text):
        raise WireError("MALFORMED", f"{text} in a JSON payload; an unbounded side is null")

    def no_twice(pairs):
        read = dict(pairs)
        if len(read) != len(pairs):
            seen: set = set()
            twice = next(key for key, _ in pairs if key in seen or seen.add(key))
            raise WireError("MALFORMED", f"a JSON object names {quote(twice)} twice")
        return read

    def no_infinity(text):
        if math.isinf(float(text)):
            raise WireError("MALFORMED", f"{text[:40]} in a JSON payload is beyond a double")
        return float(text)

    def no_huge(text):
        no_infinity(text)
        return int(text)

    text = bytes(payload)
    _check_bounds(text, values)
    numbers = {"parse_float": no_infinity, "parse_int": no_huge} if _HUGE.search(text) else {}
    try:
        value = json.loads(text.decode(), parse_constant=no_constant, object_pairs_hook=no_twice, **numbers)
        if _SURROGATE.search(text):
            json.dumps(value, ensure_ascii=False).encode()  # half of a pair is no text
    except (ValueError, RecursionError) as error:  # not UTF-8, not JSON, or an integer of more digits than Python converts
        raise WireError("MALFORMED", f"a JSON payload cannot be read: {str(error)[:200]}") from None
    if not isinstance(value, dict):
        raise WireError("MALFORMED", "a JSON payload is no object")
    return value


def _check_bounds(text: bytes, values: int) -> None:
    """MALFORMED where JSON is nested too deep or has too many values. Without its strings, only brackets and commas count."""
    bare = _STRING.sub(b"", text.replace(b"\\\\", b"").replace(b'\\"', b""))
    if 1 + bare.count(b",") + bare.count(b"[") + bare.count(b"{") - len(_EMPTY.findall(bare)) > values:
        raise WireError("MALFORMED", f"a JSON payload of over {values} values")
    depth = deepest = 0
    for bracket in bare.translate(None, _NO_BRACKETS):
        depth += 1 if bracket in b"[{" else -1
        deepest = max(deepest, depth)
    if deepest > DEEPEST_JSON:
        raise WireError("MALFORMED", f"JSON nested {deepest} deep; at most {DEEPEST_JSON} is taken")


_KINDS = {int: "a whole number", float: "a number", str: "a text", bool: "true or false", list: "a list"}


def shown(value, limit: int = 80) -> str:
    """A value of JSON as a line quotes it."""
    return quote(json.dumps(value, ensure_ascii=False), limit)


def shown_bytes(data) -> str:
    """The same of bytes."""
    return "'" + "".join(chr(byte) if 32 <= byte < 127 else f"\\x{byte:02x}" for byte in bytes(data)) + "'"


def member(value: dict, name: str, kind: type, *otherwise):
    """A member of a message, of its kind (R9 of spec/protocol2.md); what holds where it is missing comes last, and there is none where it is required."""
    if name not in value and otherwise:
        return otherwise[0]
    if name not in value:
        raise WireError("MALFORMED", f"{name} is missing")
    found = value[name]
    if type(found) is not kind and not (kind is float and type(found) is int):
        raise WireError("MALFORMED", f"{name} is {shown(found)}, expected {_KINDS[kind]}")
    if kind is int and abs(found) > LARGEST_WHOLE:
        raise WireError("MALFORMED", f"{name} is {found}, beyond the whole numbers that every end has")
    return found


def texts(value: dict, name: str) -> list[str]:
    """A member that is a list of texts, [] where it is missing."""
    found = member(value, name, list, [])
    if not all(type(text) is str for text in found):
        raise WireError("MALFORMED", f"{name} is {shown(found)}, expected texts")
    return found
