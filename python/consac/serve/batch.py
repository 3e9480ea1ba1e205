"""The environments of one session: RESET and STEP carried out, and RESULT. One agent each; several are in agents.py."""
from __future__ import annotations

import struct

import numpy as np

from consac import wire
from consac.layout import align
from consac.names import quote
from consac.wire import ACTIVE, FINAL, FIRST, HEADER, TERMINATED, TRUNCATED, WireError

from .goals import Goals
from .infos import plain_info
from .refusal import FAILURES, INTERRUPTIBLE, Refusals, Refused, describe
from .rows import Rows
from .world import World

AUTORESETS = ("same_step", "next_step", "disabled")
_U32 = struct.Struct("<I")
_TWO_U32 = struct.Struct("<II")


class Batch:
    """The environments of one session and the buffer that holds what is known of them."""

    def __init__(self, world: World, envs: list, first_seed: int | None, warn, failures: Refusals):
        self.world, self.envs, self.first_seed, self.warn, self.failures = world, envs, first_seed, warn, failures
        self.autoreset, count = "same_step", len(envs)
        offset = HEADER.size + 8
        for behaviour in world.behaviours:
            offset = align(Rows.offsets(behaviour, offset)[3])
        self.buffer = bytearray(offset)
        self.parts, offset, at = [], HEADER.size + 8, align(8 + count)
        self.request = bytearray(self.step_bytes(world))
        for behaviour in world.behaviours:
            rows = Rows(behaviour, self.buffer, offset)
            rows.actions = behaviour.action.views(self.request, behaviour.slots, at)
            at = align(at + behaviour.slots * behaviour.action.row_bytes)
            offset = align(rows.end)
            self.parts.append(rows)
        self.size = offset
        self.all_ones = b"\1" * count
        self.over = [False] * count  # the episode is over and the next one has not begun
        self.broken = [True] * count  # needs a RESET before a STEP
        self.started = False
        self.goals = Goals(world.behaviours, envs[0])
        self.masked = any(rows.masks is not None for rows in self.parts)
        self.infos: list[tuple[int, dict]] = []  # slots, and what JSON has of their infos
        self.final_infos: list[tuple[int, dict]] = []
        self.dropped: set[str] = set()
        self.agreed: set[str] = set()  # capabilities
        self.parameters = np.tile([one.default for one in world.parameters] or np.empty(0), (count, 1))  # as they were set
        self.noted: dict[str, list[float]] = {}  # statistics

    @staticmethod
    def step_bytes(world: World) -> int:
        """Bytes of a STEP's payload."""
        end = 8 + world.environments
        for behaviour in world.behaviours:
            end = align(end) + behaviour.slots * behaviour.action.row_bytes
        return align(end)

    @staticmethod
    def largest_result(world: World) -> int:
        """Bytes of the largest RESULT's payload, infos apart."""
        end = 8
        for behaviour in world.behaviours:
            end = align(Rows.offsets(behaviour, align(end))[3]) + behaviour.slots * behaviour.observation.row_bytes
        return end

    def close(self) -> None:
        for env in self.envs:
            try:
                env.close()
            except INTERRUPTIBLE as error:
                self.warn(f"an environment did not close: {describe(error)}")

    # -- requests

    def reset(self, payload) -> None:
        count = len(self.envs)
        flags = self._flags(payload, wire.WITH_SEEDS | wire.WITH_OPTIONS, "RESET")
        size, end, seeds, options, text = len(payload), 8 + count, None, None, None
        if flags & wire.WITH_PARAMETERS:
            size -= self.world.parameter_bytes
        if len(payload) < end:
            raise Refused("WRONG_SIZE", f"a RESET of {len(payload)} bytes; {end} are the least for {count} environments")
        if flags & wire.WITH_SEEDS:
            at, end = align(end), align(end) + 8 * count
            if len(payload) < end:
                raise Refused("WRONG_SIZE", f"a RESET of {len(payload)} bytes; with seeds it has {end} or more")
            seeds = struct.unpack_from(f"<{count}q", payload, at)
        if flags & wire.WITH_OPTIONS:
            at = align(end)
            length = _U32.unpack_from(payload, at)[0] if len(payload) >= at + 4 else 0
            end = at + 4 + length
            text = payload[at + 4:end]
        if size != align(end):
            raise Refused("WRONG_SIZE", f"a RESET of {len(payload)} bytes; by its flags it has {align(end) + len(payload) - size}")
        chosen = self._chosen(bytes(payload[8:8 + count]), "RESET")
        for env in chosen if seeds else ():
            if seeds[env] < 0:
                raise Refused("OUT_OF_RANGE", f"seed {seeds[env]} of environment {env}; seeds are 0 or more", env=env)
        if text is not None:
            options = wire.load_json(text)
        setting = self._setting(flags, payload)
        if not self.started and len(chosen) != count:
            raise Refused("BAD_STATE", f"the first RESET resets {len(chosen)} of {count} environments; reset all of them first")
        self._forget(every=True)
        self.parameters = setting
        before = bytes(self.buffer)
        for env in chosen:
            self.broken[env] = True
        try:
            for env in chosen:
                seed = seeds[env] if seeds else None if self.started or self.first_seed is None else self.first_seed + env
                self._guard(env, self._begin, env, seed, options)
        except Refused:
            self.buffer[:] = before  # which later RESULTs go on saying of these (R70)
            raise
        for env in chosen:
            self.broken[env] = False
        self.started = True

    def step(self, payload) -> None:
        flags = self._flags(payload, 0, "STEP")
        size = len(self.request) + (self.world.parameter_bytes if flags & wire.WITH_PARAMETERS else 0)
        if len(payload) != size:
            raise Refused("WRONG_SIZE", f"a STEP of {len(payload)} bytes; with these spaces and {len(self.envs)} environments it has {size}")
        chosen = self._chosen(bytes(payload[8:8 + len(self.envs)]), "STEP")
        setting = self._setting(flags, payload)
        for env in chosen:
            if self.broken[env] or self.over[env] and self.autoreset == "disabled":
                raise Refused("RESET_REQUIRED", f"environment {env} {'failed' if self.broken[env] else 'has ended its episode'}; reset it before it is stepped", env=env)
        self.request[:] = payload[:len(self.request)]
        for rows in self.parts:
            agents, states, at = len(rows.behaviour.agents), self.buffer, rows.states_at
            slots = [slot for env in chosen for slot in range(env * agents, env * agents + agents) if states[at + slot] & ACTIVE]
            if slots:
                rows.check(slots, agents)
        before, self.parameters = bytes(self.buffer), setting
        self._forget(every=len(chosen) != len(self.envs))
        for env in chosen:
            try:
                if self.over[env]:
                    self._begin(env, None, None)
                else:
                    self._advance(env)
            except FAILURES as error:
                self.buffer[:] = before  # which later RESULTs go on saying of these (R70)
                for lost in chosen:
                    self.broken[lost] = True
                raise self._failed(env, error) from error

    def render(self, request: dict) -> bytes:
        env = wire.member(request, "env", int, 0)
        if not 0 <= env < len(self.envs):
            raise Refused("OUT_OF_RANGE", f"RENDER of environment {env!r}; there are 0 to {len(self.envs) - 1}")
        try:
            image = np.asarray(self.envs[env].render())
        except FAILURES as error:
            self.failures.tell(error)
            raise Refused("UNSUPPORTED", f"the environment cannot draw: {describe(error)}", env=env) from error
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise Refused("UNSUPPORTED", f"the environment draws {image.dtype} of shape {image.shape}; wanted are bytes of height x width x 3", env=env)
        return _TWO_U32.pack(*image.shape[:2]) + image.tobytes()

    def _flags(self, payload, known: int, what: str) -> int:
        """The first of the two words that RESET and STEP begin with."""
        if len(payload) < 8:
            raise Refused("WRONG_SIZE", f"a {what} of {len(payload)} bytes; its first words alone have 8")
        flags, zero = _TWO_U32.unpack_from(payload)
        known |= wire.WITH_PARAMETERS if "parameters" in self.agreed else 0
        if flags & ~known or zero:
            raise Refused("MALFORMED", f"a {what} begins with {flags:#x} and {zero}; what is not known is 0")
        return flags

    def _setting(self, flags: int, payload) -> np.ndarray:
        """The parameters as a request sets them, whose last block they are."""
        if not flags & wire.WITH_PARAMETERS:
            return self.parameters
        values = np.frombuffer(bytes(payload[len(payload) - self.world.parameter_bytes:]), "<f8").reshape(self.parameters.shape)
        for env, place in np.argwhere(~np.isnan(values)):
            try:
                self.world.parameters[place].check(float(values[env, place]))
            except ValueError as error:
                raise Refused("NON_FINITE" if np.isinf(values[env, place]) else "OUT_OF_RANGE", f"environment {env}: {error}", env=int(env)) from None
        return np.where(np.isnan(values), self.parameters, values)

    def _chosen(self, mask: bytes, what: str):
        if mask == self.all_ones:
            return range(len(mask))
        for env, value in enumerate(mask):
            if value > 1:
                raise Refused("OUT_OF_RANGE", f"{what} says {value} for environment {env}; 0 or 1", env=env)
        return [env for env, value in enumerate(mask) if value]

    def _forget(self, every: bool) -> None:
        """What is said only once is taken back: rewards, ends, final rows, infos."""
        if every:
            for rows in self.parts:
                rows.states &= FIRST | ACTIVE
                rows.rewards[:] = 0
        for rows in self.parts:
            if rows.finals:
                rows.finals = []
        if self.infos:
            self.infos = []
        if self.final_infos:
            self.final_infos = []
        if self.noted:
            self.noted = {}

    def _guard(self, env: int, act, *arguments) -> None:
        try:
            act(*arguments)
        except FAILURES as error:
            raise self._failed(env, error) from error

    def _failed(self, env: int, error: BaseException) -> Refused:
        self.broken[env] = True
        self.failures.tell(error)
        return Refused("ENV_FAILED", f"environment {env} failed: {describe(error)}; reset it and those stepped with it", env=env)

    # -- one environment with one agent

    def _begin(self, env: int, seed, options) -> None:
        rows = self.parts[0]
        observation, info = self._reset(env, seed, options)
        rows.write(env, observation)
        if info:
            self._keep(env, info, self.infos)
        rows.write_mask(env, info)
        rows.rewards[env] = 0
        self.buffer[rows.states_at + env] = FIRST | ACTIVE
        self.over[env] = False

    def _reset(self, env: int, seed, options):
        if self.world.parameters:
            options = (options or {}) | {one.name: float(value) for one, value in zip(self.world.parameters, self.parameters[env])}
        return self.envs[env].reset(seed=seed) if options is None else self.envs[env].reset(seed=seed, options=options)

    def _advance(self, env: int) -> None:
        rows = self.parts[0]
        observation, reward, terminated, truncated, info = self.envs[env].step(rows.action(env))
        rows.write(env, observation)
        if self.world.statistics:
            self._note(info, "")
        state = ACTIVE
        if terminated or truncated:
            state = (TERMINATED if terminated else 0) | (TRUNCATED if truncated else 0)
            if self.autoreset == "same_step":
                rows.finals.append((env, rows.row(env)))
                if info:
                    self._keep(env, info, self.final_infos)
                observation, info = self._reset(env, None, None)
                rows.write(env, observation)
                state |= FINAL | FIRST | ACTIVE
            else:
                self.over[env] = True
        if reward is None:  # numpy would take it for NaN
            raise TypeError("the reward is None, which is no number")
        rows.rewards[env] = reward
        self.buffer[rows.states_at + env] = state
        if info:
            self._keep(env, info, self.infos)
        if rows.masks is not None:
            rows.write_mask(env, info)

    def _note(self, info: dict, prefix: str) -> None:
        """The numbers of an info that are statistics; what is no finite number is none."""
        for name in self.world.statistics:
            value = info.get(name)
            if isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating)) and np.isfinite(value):
                self.noted.setdefault(prefix + name, []).append(float(value))

    def _keep(self, slot: int, info, infos: list, whose: str = "the info") -> None:
        """Adds to `infos` what JSON has of an info, while what it raises is still its environment's failure."""
        kept = plain_info(info, whose, self._drop, "action_mask" if self.masked else None)
        if kept:
            infos.append((slot, kept))

    # -- the answer

    def result(self, request: int, session: int, crc: bool) -> bytes | memoryview:
        """The RESULT frame; a view of the buffer where nothing of changing size belongs to it."""
        with_finals = any(rows.finals for rows in self.parts)
        infos = self._infos_json() if self.infos or self.final_infos else b""
        noted = wire.dump_json(self.noted) if self.noted and "statistics" in self.agreed else b""
        flags = wire.FLAG_CRC if crc else 0
        if not with_finals and not infos and not noted and not crc:
            HEADER.pack_into(self.buffer, 0, wire.MAGIC, wire.RESULT, 0, self.size - HEADER.size, 0, request, session, 0)
            return memoryview(self.buffer)[:self.size]
        out = bytearray(_TWO_U32.pack((wire.PART_FINALS if with_finals else 0) | (wire.PART_INFOS if infos else 0) | (wire.PART_STATISTICS if noted else 0), 0))
        for rows in self.parts:
            pad(out)
            out += memoryview(self.buffer)[rows.begin:rows.end]
        for rows in self.parts:
            pad(out)
            out += b"".join(row for _, row in sorted(rows.finals))
        pad(out)
        for text in (noted, infos):
            if text:
                out += _U32.pack(len(text)) + text
                pad(out)
        return wire.pack(wire.Frame(wire.RESULT, out, request, session, flags))

    def _infos_json(self) -> bytes:
        said = {}
        for name, of in (("infos", self.infos), ("final_infos", self.final_infos)):
            columns: dict = {}
            for slot, info in of:
                for key, value in info.items():
                    column = columns.setdefault(key, {"slots": [], "values": []})
                    column["slots"].append(slot)
                    column["values"].append(value)
            if columns:
                said[name] = columns
        text = wire.dump_json(said) if said else b""
        if len(text) > wire.LARGEST_JSON:
            self._drop("", f"are {len(text)} bytes of JSON, at most {wire.LARGEST_JSON} are sent")
            return b""
        if len(text) > 2 * wire.MOST_JSON_VALUES:  # a value has two bytes at least, with what follows it
            try:
                wire.load_json(text)
            except WireError as error:
                self._drop("", f"are more than JSON of a message may be: {error.message} (R7)")
                return b""
        return text

    def drop_infos(self, why: str) -> None:
        """The answer is sent without infos."""
        self.infos, self.final_infos, self.noted = [], [], {}
        self._drop("", why)

    def _drop(self, key: str, why: str) -> None:
        if key not in self.dropped:
            self.dropped.add(key)
            self.warn(f"info {quote(key)} {why}; it is not sent" if key else f"the infos {why}; they are not sent")


def pad(out: bytearray) -> None:
    out += bytes(align(len(out)) - len(out))
