"""STEP, RESET and RESULT of a session as arrays over their bytes. What sends and receives them is in client.py."""
from __future__ import annotations

import struct

import numpy as np

from . import wire
from .errors import ConsacError, ProtocolError
from .extras import read_statistics
from .layout import Behaviour, align

_WORDS = struct.Struct("<II")
_LENGTH = struct.Struct("<I")


def read_json(payload) -> dict:
    """A JSON payload, or ProtocolError."""
    try:
        return wire.load_json(payload)
    except wire.WireError as error:
        raise ProtocolError(error.code, error.message) from None


class StepFrame:
    """A STEP with its header. `mask` [environments] u8, 1 to step; `actions` for each behaviour and leaf [slots, *shape]."""

    def __init__(self, behaviours: list[Behaviour], environments: int):
        at = wire.HEADER.size + 8 + environments
        self.action_offsets = []
        for behaviour in behaviours:
            self.action_offsets.append(align(at))
            at = self.action_offsets[-1] + behaviour.slots * behaviour.action.row_bytes
        self.size = align(at)
        self._behaviours, self._environments = behaviours, environments

    def begin(self, flags: int, session: int) -> None:
        """Makes the frame; a separate call, since its size may be refused."""
        self.bytes = bytearray(self.size)
        wire.HEADER.pack_into(self.bytes, 0, wire.MAGIC, wire.STEP, flags, self.size - wire.HEADER.size, 0, 0, session, 0)
        self.mask = np.ndarray(self._environments, np.uint8, self.bytes, wire.HEADER.size + 8)
        self.mask[:] = 1
        self.actions = [b.action.views(self.bytes, b.slots, offset) for b, offset in zip(self._behaviours, self.action_offsets)]


def reset_payload(environments: int, mask, seeds, options: dict | None, parameters: bytes = b"") -> bytearray:
    """A RESET's payload; `mask` [environments] and `seeds` [environments] as in Connection.reset, `parameters` as they go over the wire."""
    flags = (wire.WITH_SEEDS if seeds is not None else 0) | (wire.WITH_OPTIONS if options is not None else 0) | (wire.WITH_PARAMETERS if parameters else 0)
    blocks = [(np.ones(environments, np.uint8) if mask is None else np.asarray(mask, np.uint8)).tobytes()]
    if seeds is not None:
        blocks.append(np.array([_seed(seed) for seed in seeds], "<i8").tobytes())
    if options is not None:
        try:
            text = wire.dump_json(options)
        except (TypeError, ValueError) as error:
            raise ConsacError(f"reset options must be JSON: {error}") from None
        blocks.append(_LENGTH.pack(len(text)) + text)
    payload = bytearray(_WORDS.pack(flags, 0))
    for block in [*blocks, parameters]:
        payload += block
        payload += bytes(align(len(payload)) - len(payload))
    return payload


def _seed(seed) -> int:
    """A seed that every engine takes."""
    if not isinstance(seed, (int, np.integer)) or not 0 <= seed < 1 << 63:
        raise ValueError(f"seed={seed!r}; seeds are whole numbers from 0 to 2**63 - 1")
    return int(seed)


class Rows:
    """What a RESULT says of one behaviour. The arrays lie in the receive buffer: they hold until the next request."""

    __slots__ = ("observations", "rewards", "states", "masks", "final_slots", "finals")

    def __init__(self):
        self.observations: list[np.ndarray] = []  # for each leaf [slots, *shape]
        self.rewards: np.ndarray  # [slots] f64
        self.states: np.ndarray  # [slots] u8, bits as wire.TERMINATED ...
        self.masks: np.ndarray | None = None  # [slots, mask_bytes] u8
        self.final_slots: np.ndarray  # slots that `finals` are of; both hold while the RESULT has PART_FINALS
        self.finals: list[np.ndarray]  # for each leaf [len(final_slots), *shape]


class ResultFrame:
    """Where everything lies in a RESULT with its header, and what it says.

    `plain_end`: bytes of one without final rows and infos, `plain_size` with its padding; `largest`: with all final rows."""

    def __init__(self, behaviours: list[Behaviour], environments: int = 1, groups: int = 0, statistics: bool = False):
        self._groups, self._known = (environments, groups), wire.PART_FINALS | wire.PART_INFOS | wire.PART_STATISTICS * statistics | wire.PART_GROUPS * (groups > 0)
        self.statistics: dict[str, list[float]] = {}  # that the latest RESULT has brought
        self.group_rewards = np.zeros(self._groups)  # likewise
        self._behaviours, self._slots = behaviours, sum(behaviour.slots for behaviour in behaviours)
        self.plain_size, finals = wire.HEADER.size + 8, 0
        for behaviour in behaviours:
            block = align(behaviour.slots * behaviour.observation.row_bytes)
            self.plain_end = self.plain_size + block + 9 * behaviour.slots
            if behaviour.masks_actions:
                self.plain_end = align(self.plain_end) + behaviour.slots * behaviour.action.mask_bytes
            self.plain_size = align(self.plain_end)
            finals += block
        self.largest = self.plain_size + finals + 8 * environments * groups
        self._padding = self._padding_of_plain()
        self.rows: list[Rows] = []
        self._buffer = None

    def _padding_of_plain(self) -> np.ndarray:
        """Where zeros lie in a plain one."""
        at, padding = wire.HEADER.size + 8, []
        for behaviour in self._behaviours:
            for size in (behaviour.slots * behaviour.observation.row_bytes, 9 * behaviour.slots, behaviour.slots * behaviour.action.mask_bytes * behaviour.masks_actions):
                end = at + size
                at = align(end)
                padding += range(end, at)
        return np.array(padding, np.intp)

    def check_padding(self) -> None:
        """ProtocolError where it is not 0 (R62)."""
        if len(self._padding) and self._buffer[self._padding].any():
            raise ProtocolError("MALFORMED", "a RESULT breaks protocol 2: padding between its blocks is not 0 (R62)")

    def lay_over(self, buffer: np.ndarray) -> list[Rows]:
        """Rows over a buffer of bytes that every RESULT comes to lie in."""
        self._buffer, self.rows, at = buffer, [], wire.HEADER.size + 8
        for behaviour in self._behaviours:
            slots, rows = behaviour.slots, Rows()
            rows.observations = behaviour.observation.views(buffer, slots, at)
            at = align(at + slots * behaviour.observation.row_bytes)
            rows.rewards = np.ndarray(slots, np.float64, buffer, at)
            at += 8 * slots
            rows.states = np.ndarray(slots, np.uint8, buffer, at)
            at = align(at + slots)
            if behaviour.masks_actions:
                rows.masks = np.ndarray((slots, behaviour.action.mask_bytes), np.uint8, buffer, at)
                at = align(at + slots * behaviour.action.mask_bytes)
            self.rows.append(rows)
        return self.rows

    def read(self, payload: memoryview, in_place: bool) -> tuple[int, dict | None, dict | None]:
        """Parts, infos and final infos; ProtocolError where sizes do not fit. Unless `in_place` its rows are copied to where they belong."""
        end, at = len(payload), self.plain_end - wire.HEADER.size
        if not in_place and end >= at:
            self._buffer[wire.HEADER.size:self.plain_end] = payload[:at]
        parts, infos, final_infos = _LENGTH.unpack_from(payload)[0] if end >= 4 else 0, None, None
        if parts & ~self._known:
            raise ProtocolError("WRONG_SIZE", f"a RESULT with parts {parts:#x}, known are {self._known:#x} (R61)")
        if end >= at and parts & wire.PART_FINALS:
            at = self._map_finals(payload, at)
        self.statistics, self.group_rewards[:] = {}, 0.0
        if end >= at and parts & wire.PART_GROUPS:
            self._check_padding_at(payload, at)
            begin, at = align(at), align(at) + self.group_rewards.nbytes
            if at <= end:
                self.group_rewards[:] = np.ndarray(self._groups, "<f8", payload, begin)
        if end >= at and parts & wire.PART_STATISTICS:
            begin, at = self._text(payload, at)
            if at <= end:
                self.statistics = read_statistics(payload[begin:at])
        if end >= at and parts & wire.PART_INFOS:
            begin, at = self._text(payload, at)
            if at <= end:
                said = read_json(payload[begin:at])
                infos, final_infos = self._columns(said, "infos"), self._columns(said, "final_infos")
        if end != align(at):
            raise ProtocolError("WRONG_SIZE", f"a RESULT of {end} bytes with parts {parts:#x}, expected {align(at)} (R60, R61)")
        if any(payload[at:end]):
            raise ProtocolError("MALFORMED", "a RESULT breaks protocol 2: padding at its end is not 0 (R62)")
        return parts, infos, final_infos

    @staticmethod
    def _check_padding_at(payload: memoryview, at: int) -> None:
        if any(payload[at:align(at)]):
            raise ProtocolError("MALFORMED", "a RESULT breaks protocol 2: padding before one of its last blocks is not 0 (R62)")

    def _text(self, payload: memoryview, at: int) -> tuple[int, int]:
        """Where the text of the block behind `at` begins and ends."""
        self._check_padding_at(payload, at)
        begin = align(at) + 4
        return begin, begin + (_LENGTH.unpack_from(payload, begin - 4)[0] if begin <= len(payload) else 0)

    def check_groups(self, played: np.ndarray) -> None:
        """ProtocolError where groups are paid what they cannot be (R107). `played` [environments]: somebody took part."""
        if not np.isfinite(self.group_rewards).all() or self.group_rewards[~played].any():
            raise ProtocolError("MALFORMED", "a RESULT breaks protocol 2: a group is paid NaN or infinity, or in an environment in which nobody took part (R107)")

    def _map_finals(self, payload: memoryview, at: int) -> int:
        """Lays the final rows over the payload from `at`; where they end."""
        for behaviour, rows in zip(self._behaviours, self.rows):
            rows.final_slots = np.flatnonzero(rows.states & wire.FINAL)
            if any(payload[at:align(at)]):
                raise ProtocolError("MALFORMED", "a RESULT breaks protocol 2: padding behind final rows is not 0 (R62)")
            begin, at = align(at), align(at) + len(rows.final_slots) * behaviour.observation.row_bytes
            if at > len(payload):
                break
            rows.finals = behaviour.observation.views(payload, len(rows.final_slots), begin)
        return at

    def _columns(self, infos: dict, part: str) -> dict | None:
        """Infos whose slots exist, and once each; final ones of slots that have a final row (R74)."""
        if part not in infos:
            return None
        said = infos[part]
        may = np.concatenate([rows.states for rows in self.rows]) & wire.FINAL if part == "final_infos" else np.ones(self._slots, np.uint8)
        try:
            for column in said.values():
                slots = column["slots"]
                if len(slots) != len(column["values"]) or not all(type(slot) is int and 0 <= slot < self._slots and may[slot] for slot in slots) or len(set(slots)) != len(slots):
                    raise ValueError
        except (AttributeError, KeyError, TypeError, ValueError):
            raise ProtocolError("MALFORMED", f"infos of {self._slots} slots that cannot be read: {wire.shown(said, 200)}") from None
        return said
