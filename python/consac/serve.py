"""The engine side of protocol 2 in Python: any Gymnasium or PettingZoo environment, served to trainers over TCP.

    python -m consac.serve CartPole-v1 --envs 8 --port 5005

Every session has environments of its own and a thread of its own. spec/protocol2.md and spec/text1.md are the law.
"""
from __future__ import annotations

import argparse
import hashlib
import hmac
import importlib
import ipaddress
import os
import secrets
import select
import signal
import socket
import struct
import sys
import threading
import time
from dataclasses import dataclass

import gymnasium
import numpy as np
from gymnasium import spaces

from consac import wire
from consac.wire import ACTIVE, FINAL, FIRST, TERMINATED, TRUNCATED, HEADER, WireError

CONNECTION_ERRORS = {"BAD_MAGIC", "MALFORMED", "FRAME_TOO_LARGE", "CRC_MISMATCH", "UNSUPPORTED_VERSION", "AUTH_FAILED", "CAPACITY", "SHUTTING_DOWN"}
AUTORESETS = ("same_step", "next_step", "disabled")
TICK = 0.25  # seconds between two looks at deadlines
UNBOUNDED = 3.4028235e+38  # how text protocol 1 writes a side without bound
_U32 = struct.Struct("<I")
_TWO_U32 = struct.Struct("<II")


@dataclass(frozen=True)
class Limits:
    """Times in seconds, sizes in bytes, as in spec/protocol2.md."""

    grace_s: float = 0.3  # silence after which text protocol 1 is served
    handshake_s: float = 5.0  # from connecting to CONFIGURE
    heartbeat_s: float = 10.0  # between PINGs to a silent peer; three unanswered end the connection
    write_s: float = 10.0  # for a write that is not taken
    resume_s: float = 60.0  # how long a session outlives its connection
    text_s: float = 60.0  # for an answer in text protocol 1
    quiet_s: float = 0.002  # that ends a text message without terminator
    spin_s: float = 1e-4 if (os.cpu_count() or 1) > 1 else 0.0  # awake for the next request, while they come that fast: a sleeping core wakes slowly
    max_frame: int = wire.LARGEST_FRAME
    max_sessions: int = 8  # at once, those that may yet be resumed included


class Refused(Exception):
    """A request that is answered with ERROR; `extra` are further members of it."""

    def __init__(self, code: str, message: str, **extra):
        super().__init__(f"{code}: {message}")
        self.code, self.message, self.extra = code, message, extra


class _Gone(Exception):
    """The peer closed, fell silent or does not read."""


def _error_json(code: str, message: str, **extra) -> bytes:
    severity = "connection" if code in CONNECTION_ERRORS else "request"
    return wire.dump_json({"code": code, "severity": severity, "message": message[:2000], **extra})


# ---- worlds

@dataclass
class World:
    """What SPEC says of an environment, learnt from one instance of it."""

    name: str
    environments: int
    behaviours: list[wire.Behaviour]
    multi_agent: bool
    renders: bool
    max_episode_steps: int = 0
    deterministic: bool = True
    ids: dict | None = None  # of several agents: what the environment calls them, by their names

    @classmethod
    def probe(cls, make_env, environments: int, name: str = "") -> "World":
        env = make_env()
        try:
            spec = getattr(env, "spec", None)
            known = name or (spec.id if spec is not None else "") or env.metadata.get("name", "") or type(getattr(env, "unwrapped", env)).__name__
            multi_agent = hasattr(env, "possible_agents")
            if not multi_agent and callable(env.observation_space):
                raise TypeError(f"{known} does not name its possible_agents; protocol 2 needs all names before the first episode")
            groups = _groups(env) if multi_agent else [("default", ["agent"], env.observation_space, env.action_space)]
            _, info = env.reset()
            behaviours = []
            for group, agents, observation, action in groups:
                layouts = [_layout(observation, "observation"), _layout(action, "action")]
                mask = (info.get(agents[0]) or {} if multi_agent else info).get("action_mask")
                masks = mask is not None and layouts[1].mask_bytes > 0 and _flat_mask(mask).size == layouts[1].mask_bytes
                behaviours.append(wire.Behaviour(group, list(map(str, agents)), *layouts, environments * len(agents), masks))
            return cls(known, environments, behaviours, multi_agent, getattr(env, "render_mode", None) == "rgb_array",
                       int(getattr(spec, "max_episode_steps", 0) or 0), not getattr(spec, "nondeterministic", False),
                       {str(agent): agent for agent in env.possible_agents} if multi_agent else None)
        finally:
            env.close()

    def to_json(self, autoreset: str, training_length: int, model_name: str) -> dict:
        behaviours = [behaviour.to_json() for behaviour in self.behaviours]
        return {"id": self.name, "environments": self.environments, "max_episode_steps": self.max_episode_steps, "autoreset": autoreset,
                "training_length": training_length, "model_name": model_name, "deterministic": self.deterministic,
                "hash": hashlib.sha256(wire.canonical_json(behaviours)).hexdigest(), "behaviours": behaviours}


def _groups(env) -> list[tuple]:
    """Agents with equal spaces are one behaviour, named after what their names begin with."""
    groups: list[tuple] = []
    for agent in env.possible_agents:
        observation, action = env.observation_space(agent), env.action_space(agent)
        same = next((group for group in groups if group[2] == observation and group[3] == action), None)
        if same:
            same[1].append(agent)
        else:
            groups.append((str(agent).rstrip("0123456789").rstrip("_") or str(agent), [agent], observation, action))
    if len(groups) == 1:
        return [("default", *groups[0][1:])]
    names = [group[0] for group in groups]
    return [(name if names.count(name) == 1 else f"{name}_{index}", *group[1:]) for index, (name, group) in enumerate(zip(names, groups))]


def _layout(space: spaces.Space, what: str) -> wire.Layout:
    wire.space_to_json(space)
    layout = wire.Layout.of(space)
    for leaf in layout.leaves:
        highest = 0
        if isinstance(leaf.space, spaces.Discrete):
            highest = int(leaf.space.start) + int(leaf.space.n)
        elif isinstance(leaf.space, spaces.MultiDiscrete):
            highest = int(np.max(leaf.space.nvec, initial=0))
        if highest > 2**31 or isinstance(leaf.space, spaces.Discrete) and leaf.space.start < -2**31:
            raise TypeError(f"the {what} space {leaf.space} has values that a row's I32 cannot hold; wrap it")
    return layout


def _flat_mask(mask) -> np.ndarray:
    if isinstance(mask, dict):
        mask = [mask[name] for name in sorted(mask, key=str.encode)]
    parts = [np.ravel(part) for part in mask] if isinstance(mask, (tuple, list)) else [np.ravel(mask)]
    return np.concatenate(parts).astype(bool)


def _plain(value):
    """A value of an info as JSON has it; TypeError for what has no form there."""
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, float):
        return value if value - value == 0 else None
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    raise TypeError(f"a {type(value).__name__}")


class _Rows:
    """One behaviour's part of a RESULT buffer, and its actions from a STEP."""

    def __init__(self, behaviour: wire.Behaviour, buffer, offset: int):
        self.behaviour, self.buffer = behaviour, buffer
        self.layout, self.actions_layout = behaviour.observation, behaviour.action
        self.begin, slots = offset, behaviour.slots
        self.observations = self.layout.views(buffer, slots, offset)
        self.rewards_at, self.states_at, self.masks_at, self.end = self.offsets(behaviour, offset)
        self.rewards = np.ndarray((slots,), np.float64, buffer, self.rewards_at)
        self.states = np.ndarray((slots,), np.uint8, buffer, self.states_at)
        self.masks = np.ndarray((slots, behaviour.action.mask_bytes), np.uint8, buffer, self.masks_at) if behaviour.masks_actions else None
        self.one_leaf = len(self.layout.leaves) == 1 and not self.layout.leaves[0].path
        only = behaviour.action.space
        self.number = only.dtype.type if isinstance(only, spaces.Discrete) else None
        self.only, self.shape = self.observations[0], self.layout.leaves[0].shape
        self.actions: list[np.ndarray] = []
        self.finals: list[tuple[int, bytes]] = []

    @staticmethod
    def offsets(behaviour: wire.Behaviour, offset: int) -> tuple[int, int, int, int]:
        """Where rewards, states, masks and the end lie."""
        rewards = wire.align(offset + behaviour.slots * behaviour.observation.row_bytes)
        states = rewards + 8 * behaviour.slots
        end = states + behaviour.slots
        if not behaviour.masks_actions:
            return rewards, states, end, end
        masks = wire.align(end)
        return rewards, states, masks, masks + behaviour.slots * behaviour.action.mask_bytes

    def write(self, slot: int, observation) -> None:
        if self.one_leaf:
            if np.shape(observation) != self.shape:
                raise ValueError(f"an observation of shape {np.shape(observation)}, but the space says {self.shape}")
            self.only[slot] = observation
            return
        for leaf, view in zip(self.layout.leaves, self.observations):
            part = self.layout.pick(observation, leaf)
            if np.shape(part) != leaf.shape:
                raise ValueError(f"an observation's leaf {'/'.join(map(str, leaf.path))} of shape {np.shape(part)}, but the space says {leaf.shape}")
            view[slot] = part

    def write_mask(self, slot: int, info: dict) -> None:
        if self.masks is None:
            return
        mask = info.get("action_mask")
        if mask is None:
            self.masks[slot] = 1
            return
        flat = _flat_mask(mask)
        self.masks[slot] = flat if flat.any() else 1

    def row(self, slot: int) -> bytes:
        size = self.layout.row_bytes
        return bytes(memoryview(self.buffer)[self.begin + slot * size:self.begin + (slot + 1) * size])

    def check(self, slots: list[int], per_env: int) -> None:
        """Refuses actions of `slots` that are outside their space."""
        for leaf, view in zip(self.actions_layout.leaves, self.actions):
            space = leaf.space
            if isinstance(space, spaces.Discrete):
                low, high = int(space.start), int(space.start) + int(space.n)
                values = view.tolist()
                for slot in slots:
                    if not low <= values[slot] < high:
                        raise self._outside(slot, per_env, leaf, values[slot], f"{low} to {high - 1}")
                continue
            rows = view[slots]
            if isinstance(space, spaces.MultiDiscrete):
                good, say = (rows >= 0) & (rows < space.nvec), f"0 to {(space.nvec - 1).tolist()}"
            elif isinstance(space, spaces.MultiBinary):
                good, say = rows <= 1, "0 or 1"
            elif leaf.dtype.kind == "b":
                good, say = rows.view(np.uint8) <= 1, "0 or 1"
            else:
                good, say = (rows >= space.low) & (rows <= space.high), f"{_short(space.low)} to {_short(space.high)}"
                if leaf.dtype.kind == "f" and not np.isfinite(rows).all():
                    good, say = np.isfinite(rows), ""
            if not good.all():
                slot, where = slots[int(np.argwhere(~good)[0][0])], tuple(np.argwhere(~good)[0])
                raise self._outside(slot, per_env, leaf, rows[where].item(), say)

    def _outside(self, slot: int, per_env: int, leaf: wire.Leaf, value, say: str) -> Refused:
        env, agent = slot // per_env, self.behaviour.agents[slot % per_env]
        path = f"{self.behaviour.name}/{agent}" + "".join(f"/{key}" for key in leaf.path)
        if say:
            return Refused("OUT_OF_RANGE", f"action {value} of environment {env}, agent {agent}; the space takes {say}", env=env, path=path)
        return Refused("NON_FINITE", f"action {value} of environment {env}, agent {agent}; send finite numbers", env=env, path=path)

    def action(self, slot: int):
        """The action of `slot` as its environment wants it."""
        if self.number:
            return self.number(self.actions[0][slot])
        parts = []
        for leaf, view in zip(self.actions_layout.leaves, self.actions):
            part = view[slot]
            parts.append(leaf.space.dtype.type(part) if part.ndim == 0 and not isinstance(leaf.space, spaces.Box) else part.astype(leaf.space.dtype))
        return self.actions_layout.build(parts)


def _short(bounds: np.ndarray) -> str:
    flat = np.unique(bounds)
    return str(flat[0]) if flat.size == 1 else f"{np.ravel(bounds).tolist()}"[:80]


class Batch:
    """The environments of one session and the buffer that holds what is known of them."""

    def __init__(self, world: World, envs: list, first_seed: int | None, warn):
        self.world, self.envs, self.first_seed, self.warn = world, envs, first_seed, warn
        self.autoreset, count = "same_step", len(envs)
        offset = HEADER.size + 8
        for behaviour in world.behaviours:
            offset = wire.align(_Rows.offsets(behaviour, offset)[3])
        self.buffer = bytearray(offset)
        self.parts, offset, at = [], HEADER.size + 8, wire.align(8 + count)
        self.request = bytearray(self.step_bytes(world))
        for behaviour in world.behaviours:
            rows = _Rows(behaviour, self.buffer, offset)
            rows.actions = behaviour.action.views(self.request, behaviour.slots, at)
            at = wire.align(at + behaviour.slots * behaviour.action.row_bytes)
            offset = wire.align(rows.end)
            self.parts.append(rows)
        self.size = offset
        self.all_ones = b"\1" * count
        self.over = [False] * count  # the episode is over and the next one has not begun
        self.broken = [True] * count  # needs a RESET before a STEP
        self.started = False
        self.infos: list[tuple[int, dict]] = []
        self.final_infos: list[tuple[int, dict]] = []
        self.dropped: set[str] = set()

    @staticmethod
    def step_bytes(world: World) -> int:
        """Bytes of a STEP's payload."""
        end = 8 + world.environments
        for behaviour in world.behaviours:
            end = wire.align(end) + behaviour.slots * behaviour.action.row_bytes
        return wire.align(end)

    @staticmethod
    def largest_result(world: World) -> int:
        """Bytes of the largest RESULT's payload, infos apart."""
        end = 8
        for behaviour in world.behaviours:
            end = wire.align(_Rows.offsets(behaviour, wire.align(end))[3]) + behaviour.slots * behaviour.observation.row_bytes
        return end

    def close(self) -> None:
        for env in self.envs:
            try:
                env.close()
            except Exception as error:
                self.warn(f"an environment did not close: {type(error).__name__}: {error}")

    # -- requests

    def reset(self, payload) -> None:
        count = len(self.envs)
        if len(payload) < 8 + count:
            raise Refused("WRONG_SIZE", f"a RESET of {len(payload)} bytes; {8 + count} are the least for {count} environments")
        flags, zero = _TWO_U32.unpack_from(payload)
        if flags & ~(wire.WITH_SEEDS | wire.WITH_OPTIONS) or zero:
            raise Refused("MALFORMED", f"a RESET with flags {flags:#x} and {zero} where 0 belongs; flags are 1 (seeds) and 2 (options)")
        chosen = self._chosen(bytes(payload[8:8 + count]), "RESET")
        end, seeds, options = 8 + count, None, None
        if flags & wire.WITH_SEEDS:
            at, end = wire.align(end), wire.align(end) + 8 * count
            if len(payload) < end:
                raise Refused("WRONG_SIZE", f"a RESET of {len(payload)} bytes; with seeds it has {end} or more")
            seeds = struct.unpack_from(f"<{count}q", payload, at)
        if flags & wire.WITH_OPTIONS:
            at = wire.align(end)
            length = _U32.unpack_from(payload, at)[0] if len(payload) >= at + 4 else 0
            end = at + 4 + length
            if len(payload) == wire.align(end):
                options = wire.load_json(payload[at + 4:end])
        if len(payload) != wire.align(end):
            raise Refused("WRONG_SIZE", f"a RESET of {len(payload)} bytes; by its flags it has {wire.align(end)}")
        if not self.started and len(chosen) != count:
            raise Refused("BAD_STATE", f"the first RESET resets {len(chosen)} of {count} environments; reset all of them first")
        for env in chosen if seeds else ():
            if seeds[env] < 0:
                raise Refused("OUT_OF_RANGE", f"seed {seeds[env]} of environment {env}; seeds are 0 or more", env=env)
        self._forget(every=True)
        for env in chosen:
            self.broken[env] = True
        for env in chosen:
            seed = seeds[env] if seeds else None if self.started or self.first_seed is None else self.first_seed + env
            self._guard(env, self._begin, env, seed, options)
            self.broken[env] = False
        self.started = True

    def step(self, payload) -> None:
        if len(payload) != len(self.request):
            raise Refused("WRONG_SIZE", f"a STEP of {len(payload)} bytes; with these spaces and {len(self.envs)} environments it has {len(self.request)}")
        chosen = self._chosen(bytes(payload[8:8 + len(self.envs)]), "STEP")
        if payload[:8] != bytes(8):
            raise Refused("MALFORMED", f"a STEP begins {bytes(payload[:8]).hex()}; its first 8 bytes are 0")
        for env in chosen:
            if self.broken[env] or self.over[env] and self.autoreset == "disabled":
                raise Refused("RESET_REQUIRED", f"environment {env} {'failed' if self.broken[env] else 'has ended its episode'}; reset it before it is stepped", env=env)
        self.request[:] = payload
        for rows in self.parts:
            agents, states, at = len(rows.behaviour.agents), self.buffer, rows.states_at
            slots = [slot for env in chosen for slot in range(env * agents, env * agents + agents) if states[at + slot] & ACTIVE]
            if slots:
                rows.check(slots, agents)
        self._forget(every=len(chosen) != len(self.envs))
        for index, env in enumerate(chosen):
            try:
                if self.over[env]:
                    self._begin(env, None, None)
                else:
                    self._advance(env)
            except Exception as error:
                for lost in chosen[:index + 1]:
                    self.broken[lost] = True
                raise self._failed(env, error) from error

    def render(self, request: dict) -> bytes:
        env = request.get("env", 0)
        if not isinstance(env, int) or not 0 <= env < len(self.envs):
            raise Refused("OUT_OF_RANGE", f"RENDER of environment {env!r}; there are 0 to {len(self.envs) - 1}")
        if not self.started:
            raise Refused("BAD_STATE", "RENDER before a first RESET; reset first")
        try:
            image = np.asarray(self.envs[env].render())
        except Exception as error:
            raise Refused("UNSUPPORTED", f"the environment cannot draw: {type(error).__name__}: {error}", env=env) from error
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise Refused("UNSUPPORTED", f"the environment draws {image.dtype} of shape {image.shape}; wanted are bytes of height x width x 3", env=env)
        return _TWO_U32.pack(*image.shape[:2]) + image.tobytes()

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

    def _guard(self, env: int, act, *arguments) -> None:
        try:
            act(*arguments)
        except Exception as error:
            raise self._failed(env, error) from error

    def _failed(self, env: int, error: Exception) -> Refused:
        self.broken[env] = True
        return Refused("ENV_FAILED", f"environment {env} failed: {type(error).__name__}: {error}; reset it and those stepped with it", env=env)

    # -- one environment with one agent

    def _begin(self, env: int, seed, options) -> None:
        rows = self.parts[0]
        observation, info = self._reset(env, seed, options)
        rows.write(env, observation)
        rows.write_mask(env, info)
        rows.rewards[env] = 0
        self.buffer[rows.states_at + env] = FIRST | ACTIVE
        self.over[env] = False
        if info:
            self.infos.append((env, info))

    def _reset(self, env: int, seed, options):
        return self.envs[env].reset(seed=seed) if options is None else self.envs[env].reset(seed=seed, options=options)

    def _advance(self, env: int) -> None:
        rows = self.parts[0]
        observation, reward, terminated, truncated, info = self.envs[env].step(rows.action(env))
        rows.write(env, observation)
        state = ACTIVE
        if terminated or truncated:
            state = (TERMINATED if terminated else 0) | (TRUNCATED if truncated else 0)
            if self.autoreset == "same_step":
                rows.finals.append((env, rows.row(env)))
                if info:
                    self.final_infos.append((env, info))
                observation, info = self._reset(env, None, None)
                rows.write(env, observation)
                state |= FINAL | FIRST | ACTIVE
            else:
                self.over[env] = True
        rows.rewards[env] = reward
        self.buffer[rows.states_at + env] = state
        if info:
            self.infos.append((env, info))
        if rows.masks is not None:
            rows.write_mask(env, info)

    # -- the answer

    def result(self, request: int, session: int, crc: bool) -> bytes | memoryview:
        """The RESULT frame; a view of the buffer where nothing of changing size belongs to it."""
        with_finals = any(rows.finals for rows in self.parts)
        infos = self._infos_json() if self.infos or self.final_infos else b""
        flags = wire.FLAG_CRC if crc else 0
        if not with_finals and not infos and not crc:
            HEADER.pack_into(self.buffer, 0, wire.MAGIC, wire.RESULT, 0, self.size - HEADER.size, 0, request, session, 0)
            return memoryview(self.buffer)[:self.size]
        out = bytearray(_TWO_U32.pack((wire.PART_FINALS if with_finals else 0) | (wire.PART_INFOS if infos else 0), 0))
        for rows in self.parts:
            _pad(out)
            out += memoryview(self.buffer)[rows.begin:rows.end]
        for rows in self.parts:
            _pad(out)
            out += b"".join(row for _, row in sorted(rows.finals))
        _pad(out)
        if infos:
            out += _U32.pack(len(infos)) + infos
            _pad(out)
        return wire.pack(wire.Frame(wire.RESULT, out, request, session, flags))

    def _infos_json(self) -> bytes:
        said, masked = {}, any(rows.masks is not None for rows in self.parts)
        for name, of in (("infos", self.infos), ("final_infos", self.final_infos)):
            columns: dict = {}
            for slot, info in of:
                for key, value in info.items():
                    if masked and key == "action_mask":
                        continue
                    try:
                        value = _plain(value)
                    except TypeError as error:
                        self._drop(str(key), f"is {error}, which JSON has not")
                        continue
                    column = columns.setdefault(str(key), {"slots": [], "values": []})
                    column["slots"].append(slot)
                    column["values"].append(value)
            if columns:
                said[name] = columns
        text = wire.dump_json(said) if said else b""
        if len(text) > wire.LARGEST_JSON:
            self._drop("", f"are {len(text)} bytes of JSON, at most {wire.LARGEST_JSON} are sent")
            return b""
        return text

    def _drop(self, key: str, why: str) -> None:
        if key not in self.dropped:
            self.dropped.add(key)
            self.warn(f"info {key!r} {why}; it is not sent" if key else f"the infos {why}; they are not sent")


def _pad(out: bytearray) -> None:
    out += bytes(wire.align(len(out)) - len(out))


class AgentBatch(Batch):
    """Environments with several agents, in PettingZoo's parallel form."""

    def __init__(self, world: World, envs: list, first_seed: int | None, warn):
        super().__init__(world, envs, first_seed, warn)
        self.place, self.first_slot, total = {}, [], 0
        for rows in self.parts:
            self.first_slot.append(total)
            total += rows.behaviour.slots
            for place, agent in enumerate(rows.behaviour.agents):
                self.place[world.ids[agent]] = (len(self.first_slot) - 1, place)
        self.ended: list[set] = [set() for _ in envs]  # agents whose episode is over

    def _slot(self, env: int, agent) -> tuple[_Rows, int, int]:
        part, place = self.place[agent]
        rows = self.parts[part]
        slot = env * len(rows.behaviour.agents) + place
        return rows, slot, self.first_slot[part] + slot

    def _begin(self, env: int, seed, options) -> None:
        observations, infos = self._reset(env, seed, options)
        for agent in self.place:
            rows, slot, number = self._slot(env, agent)
            rows.rewards[slot] = 0
            rows.states[slot] = FIRST | ACTIVE if agent in observations else 0
            if agent in observations:
                self._show(rows, slot, number, observations[agent], infos.get(agent) or {}, self.infos)
        self.ended[env] = set()
        self.over[env] = False

    def _show(self, rows: _Rows, slot: int, number: int, observation, info: dict, infos: list) -> None:
        rows.write(slot, observation)
        rows.write_mask(slot, info)
        if info:
            infos.append((number, info))

    def _advance(self, env: int) -> None:
        actions = {}
        for agent in self.place:
            rows, slot, _ = self._slot(env, agent)
            if rows.states[slot] & ACTIVE:
                actions[agent] = rows.action(slot)
        observations, rewards, terminations, truncations, infos = self.envs[env].step(actions)
        ended_now, seen, going_on = [], [], False
        for agent in self.place:
            rows, slot, number = self._slot(env, agent)
            took_part = agent in actions or agent in observations and agent not in self.ended[env]
            rows.states[slot] = 0
            rows.rewards[slot] = rewards.get(agent, 0) if took_part else 0
            if not took_part:
                continue
            if agent in observations:
                self._show(rows, slot, number, observations[agent], infos.get(agent) or {}, seen)
            terminated, truncated = terminations.get(agent, False), truncations.get(agent, False)
            gone = agent not in observations and not (terminated or truncated)
            if terminated or truncated or gone:
                rows.states[slot] = (TERMINATED if terminated or gone else 0) | (TRUNCATED if truncated else 0)
                self.ended[env].add(agent)
                ended_now.append((rows, slot))
            else:
                rows.states[slot] = ACTIVE
                going_on = True
        if going_on:
            self.infos += seen
            return
        if self.autoreset != "same_step":
            self.infos += seen
            self.over[env] = True
            return
        self.final_infos += seen
        said = [(rows, slot, int(rows.states[slot]), float(rows.rewards[slot])) for rows, slot in ended_now]
        for rows, slot in ended_now:
            rows.finals.append((slot, rows.row(slot)))
        self._begin(env, None, None)
        for rows, slot, state, reward in said:
            rows.states[slot] |= state | FINAL
            rows.rewards[slot] = reward


# ---- connections

class _Connection:
    """A socket that frames are read from and written to, with deadlines."""

    def __init__(self, sock: socket.socket, limits: Limits):
        self.sock, self.limits, self.limit = sock, limits, wire.LARGEST_BEFORE_WELCOME
        self.buffer = bytearray(65536)
        self.view = memoryview(self.buffer)
        self.start = self.end = 0
        self.heard = time.monotonic()
        self.pings = 0
        self.closing = threading.Event()
        self.crc = False
        self.spins = False
        self.request = 0  # number of the request that is being carried out
        self.lock = threading.Lock()  # held while a frame is written
        self.wrote = time.monotonic()
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(False)

    def read(self, look) -> tuple:
        """(type, request, session, payload) of the next frame; `look` is called now and then while none is there."""
        while True:
            have = self.end - self.start
            if have >= 4 and self.buffer[self.start:self.start + 4] != b"\xC0NSC":
                wire.unpack_header(bytes(self.view[self.start:self.end]).ljust(HEADER.size, b"\0"), self.limit)
            if have >= HEADER.size:
                frame, length, crc = wire.unpack_header(self.view[self.start:self.end], self.limit)
                total = HEADER.size + length
                if have >= total:
                    payload = self.view[self.start + HEADER.size:self.start + total]
                    self.start += total
                    if self.start == self.end:
                        self.start = self.end = 0
                    if frame.flags:
                        frame.payload = payload
                        wire.check_crc(frame, crc)
                    return frame.type, frame.request, frame.session, payload
                self._make_room(total)
            else:
                self._make_room(HEADER.size)
            self._receive(look)

    def _make_room(self, total: int) -> None:
        """Room for more of a frame of `total` bytes, never more than twice what has come of it."""
        if self.end < len(self.buffer) and (self.start == 0 or self.start + total <= len(self.buffer)):
            return
        have = self.end - self.start
        fresh = bytearray(len(self.buffer) if have < len(self.buffer) else min(total, 2 * len(self.buffer)))
        fresh[:have] = self.view[self.start:self.end]
        self.buffer, self.view, self.start, self.end = fresh, memoryview(fresh), 0, have

    def _receive(self, look) -> None:
        room, began = self.view[self.end:], time.monotonic()
        while True:
            try:
                count = self.sock.recv_into(room)
                break
            except BlockingIOError:
                if self.spins and time.monotonic() - began < self.limits.spin_s:
                    continue
            except OSError as error:
                raise _Gone(f"the connection broke: {error}") from None
            self.spins = False
            if not self.wait(TICK):
                look()
        if count == 0:
            raise _Gone("the peer closed")
        self.end += count
        self.heard, self.pings = time.monotonic(), 0
        self.spins = self.heard - began < self.limits.spin_s

    def wait(self, seconds: float, write: bool = False) -> bool:
        """Whether the socket is ready within `seconds`."""
        try:
            return any(select.select([] if write else [self.sock], [self.sock] if write else [], [], seconds))
        except (OSError, ValueError) as error:
            raise _Gone(f"the connection broke: {error}") from None

    def write(self, data) -> None:
        """All of `data`, or _Gone when the peer does not take it in time."""
        with self.lock:
            self._write(data)
            self.wrote = time.monotonic()

    def _write(self, data) -> None:
        deadline, view = None, data
        while True:
            try:
                sent = self.sock.send(view)
                if sent == len(view):
                    return
                view = memoryview(view)[sent:]
            except BlockingIOError:
                pass
            except OSError as error:
                raise _Gone(f"the connection broke: {error}") from None
            deadline = deadline or time.monotonic() + self.limits.write_s
            if time.monotonic() > deadline:
                raise _Gone(f"the peer takes no bytes for {self.limits.write_s:g} s")
            self.wait(TICK, write=True)

    def pack(self, kind: int, payload=b"", request: int = 0, session: int = 0) -> bytes:
        return wire.pack(wire.Frame(kind, payload, request, session, wire.FLAG_CRC if self.crc else 0))

    def heartbeat(self) -> None:
        """PING to a peer that has been silent; after three it is gone."""
        silent = time.monotonic() - self.heard
        if silent > (self.pings + 1) * self.limits.heartbeat_s:
            if self.pings >= 3:
                raise _Gone(f"no sign of life for {silent:.0f} s")
            self.pings += 1
            self.write(self.pack(wire.PING))

    def reassure(self) -> None:
        """PING to a peer that waits for a long request; called from another thread, never waits."""
        if self.request == 0 or time.monotonic() - self.wrote < self.limits.heartbeat_s or not self.lock.acquire(blocking=False):
            return
        try:
            data = self.pack(wire.PING)
            if self.sock.send(data) != len(data):
                self.sock.shutdown(socket.SHUT_RDWR)
            self.wrote = time.monotonic()
        except OSError:
            pass
        finally:
            self.lock.release()

    def finish(self) -> None:
        """Closes so that the last words still arrive, though the peer may be sending."""
        try:
            self.sock.shutdown(socket.SHUT_WR)
            self.sock.settimeout(0.2)
            deadline = time.monotonic() + 1
            while time.monotonic() < deadline and self.sock.recv(65536):
                pass
        except OSError:
            pass
        self.sock.close()


class _Session:
    """Environments and the last answer; it may outlive a connection."""

    def __init__(self, number: int):
        self.number, self.token = number, secrets.token_urlsafe(24)
        self.lock = threading.Lock()  # held by the thread that serves it
        self.connection: _Connection | None = None
        self.lost_at = 0.0
        self.last_request = 0
        self.answer: bytes | memoryview = b""
        self.batch: Batch | None = None
        self.configured = False
        self.renders = False
        self.deadline: float | None = None  # for CONFIGURE


class Server:
    """Serves environments from `make_env`, a callable, or a Gymnasium id, on `host`:`port` (0: a free one)."""

    def __init__(self, make_env, envs: int = 1, *, host: str = "127.0.0.1", port: int = 0, token: str = "", protocol: str = "auto",
                 training_length: int = 0, model_name: str = "", seed: int | None = None, sessions: int = 0, name: str = "",
                 limits: Limits = Limits(), log=None):
        if protocol not in ("auto", "text1", "2"):
            raise ValueError(f"protocol {protocol!r}; it is auto, text1 or 2")
        if not token and not _is_loopback(host):
            raise ValueError(f"{host} can be reached from other machines, so an access token is needed: set --token, or bind 127.0.0.1")
        if envs < 1 or training_length < 0 or sessions < 0:
            raise ValueError(f"envs {envs}, training length {training_length}, sessions {sessions}; envs is 1 or more, the others 0 or more")
        self.make_env = _factory(make_env) if isinstance(make_env, str) else make_env
        self.token, self.protocol, self.limits, self.seed, self.sessions_wanted = token, protocol, limits, seed, sessions
        self.training_length, self.model_name = training_length, model_name
        self._log = log or (lambda line: None)
        self.world = World.probe(self.make_env, envs, name)
        self.text_misfit = self._text_misfit()
        if protocol == "text1" and self.text_misfit:
            raise ValueError(f"text protocol 1 cannot carry this: {self.text_misfit}")
        largest = max(Batch.largest_result(self.world), Batch.step_bytes(self.world))
        if largest > limits.max_frame:
            raise ValueError(f"{envs} environments make frames of {largest} bytes, over {limits.max_frame}; use fewer of them")
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._listener = socket.create_server((host, port), family=family, backlog=64)
        self._listener.settimeout(TICK)
        self.host, self.port = host, self._listener.getsockname()[1]
        self._lock = threading.Lock()
        self._sessions: dict[int, _Session] = {}
        self._connections: dict[_Connection, threading.Thread] = {}
        self._next_session, self._finished = 1, 0
        self._text_lock = threading.Lock()  # held by the one trainer of text protocol 1
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> "Server":
        """Serves from a thread of its own."""
        self._thread = threading.Thread(target=self.run, name=f"consac-serve-{self.port}", daemon=True)
        self._thread.start()
        return self

    def run(self) -> None:
        """Serves until `close`, or until the wanted number of sessions is over."""
        while not self._stop.is_set():
            try:
                sock, _ = self._listener.accept()
            except (TimeoutError, socket.timeout):
                self._forget_lost()
                for connection in list(self._connections):
                    connection.reassure()
                if self.sessions_wanted and self._finished >= self.sessions_wanted:
                    self._stop.set()
                continue
            except OSError:
                break
            connection = _Connection(sock, self.limits)
            with self._lock:
                if len(self._connections) >= 2 * self.limits.max_sessions + 16:
                    sock.close()
                    continue
                thread = threading.Thread(target=self._serve, args=(connection,), daemon=True)
                self._connections[connection] = thread
            thread.start()
        self._shut_down()

    def close(self) -> None:
        """Answers what is under way, says GOAWAY and closes; more than once does no harm."""
        self._stop.set()
        try:
            self._listener.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(5)
        elif self._thread is None:
            self._shut_down()

    def __enter__(self) -> "Server":
        return self if self._thread is not None else self.start()

    def __exit__(self, *_) -> None:
        self.close()

    def _shut_down(self) -> None:
        self._listener.close()
        with self._lock:
            connections = list(self._connections.items())
        for connection, _ in connections:
            connection.closing.set()
            try:
                connection.sock.shutdown(socket.SHUT_RD)
            except OSError:
                pass
        deadline = time.monotonic() + 2
        for _, thread in connections:
            thread.join(max(0, deadline - time.monotonic()))
        with self._lock:
            left, self._sessions = list(self._sessions.values()), {}
        for session in left:
            if session.batch and session.lock.acquire(timeout=0.1):
                session.batch.close()

    def _forget_lost(self) -> None:
        now = time.monotonic()
        with self._lock:
            lost = [session for session in self._sessions.values() if session.connection is None and now - session.lost_at > self.limits.resume_s]
            for session in lost:
                del self._sessions[session.number]
        for session in lost:
            self._end(session, "was not taken up again")

    def _end(self, session: _Session, why: str) -> None:
        with self._lock:
            self._sessions.pop(session.number, None)
            self._finished += 1
        if session.batch:
            session.batch.close()
        self._log(f"session {session.number} {why}")

    # -- one connection

    def _serve(self, connection: _Connection) -> None:
        session = None
        try:
            if self.protocol == "text1" or self._hears_nothing(connection):
                self._serve_text(connection)
                return
            session = self._shake_hands(connection)
            if session is not None:
                self._serve_session(connection, session)
        except (WireError, Refused) as error:
            self._last_word(connection, connection.pack(wire.ERROR, _error_json(error.code, error.message, **getattr(error, "extra", {})),
                                                        connection.request, session=session.number if session else 0))
            self._log(f"closed a connection: {error}")
        except _Gone as error:
            if connection.closing.is_set():
                self._last_word(connection, connection.pack(wire.GOAWAY, wire.dump_json({"reason": "the server shuts down"}),
                                                            session=session.number if session else 0))
            elif session:
                self._log(f"session {session.number}: {error}; it can be resumed for {self.limits.resume_s:g} s")
        finally:
            connection.finish()
            if session is not None:
                self._detach(connection, session)
            with self._lock:
                self._connections.pop(connection, None)

    def _last_word(self, connection: _Connection, data: bytes) -> None:
        try:
            connection.write(data)
        except _Gone:
            pass

    def _detach(self, connection: _Connection, session: _Session) -> None:
        with self._lock:
            if session.connection is connection:
                session.connection, session.lost_at = None, time.monotonic()
        session.lock.release()

    def _hears_nothing(self, connection: _Connection) -> bool:
        if self.protocol == "2":
            return False
        if connection.wait(self.limits.grace_s):
            return False
        if self.text_misfit:
            self._log(f"a silent trainer; text protocol 1 is not served: {self.text_misfit}")
        return not self.text_misfit

    def _look(self, connection: _Connection, deadline: float | None) -> None:
        if connection.closing.is_set():
            raise _Gone("the server shuts down")
        if deadline is not None and time.monotonic() > deadline:
            self._last_word(connection, connection.pack(wire.GOAWAY, wire.dump_json({"reason": f"no HELLO and CONFIGURE within {self.limits.handshake_s:g} s"})))
            raise _Gone("the handshake took too long")
        if deadline is None:
            connection.heartbeat()

    def _shake_hands(self, connection: _Connection) -> _Session | None:
        """Everything up to WELCOME; the session is then this thread's."""
        deadline = time.monotonic() + self.limits.handshake_s
        while True:
            connection.request = 0
            kind, request, number, payload = connection.read(lambda: self._look(connection, deadline))
            self._check_deadline(connection, deadline)
            connection.request = request
            if kind == wire.HELLO:
                hello = wire.load_json(payload)
                if number == 0 and (request <= 1 or hello.get("resume")):
                    session = self._welcome(connection, request, hello)
                    session.deadline = None if session.configured else deadline
                    return session
                why = f"HELLO has request {request} and session {number}; a new session begins with request 1 (or 0) and session 0"
                connection.write(connection.pack(wire.ERROR, _error_json("BAD_STATE", why), request))
                continue
            if kind == wire.BYE:
                return None
            if not self._aside(connection, kind, payload, 0):
                code, message = "UNKNOWN_MESSAGE", f"a frame of type {kind} is not known here"
                if kind <= wire.FRAME:
                    code, message = "BAD_STATE", f"a frame of type {kind} before HELLO; send HELLO first"
                connection.write(connection.pack(wire.ERROR, _error_json(code, message), request))

    def _check_deadline(self, connection: _Connection, deadline: float) -> None:
        if time.monotonic() > deadline:
            self._look(connection, deadline)

    def _aside(self, connection: _Connection, kind: int, payload, session: int) -> bool:
        """Frames that are no requests: true when it was one."""
        if kind == wire.PING:
            if len(payload) > 64:
                raise WireError("MALFORMED", f"a PING of {len(payload)} bytes; at most 64 are taken")
            connection.write(connection.pack(wire.PONG, bytes(payload), 0, session))
            return True
        return kind == wire.PONG or kind & wire.OPTIONAL != 0

    def _welcome(self, connection: _Connection, request: int, hello: dict) -> _Session:
        versions = hello.get("protocol")
        if not (isinstance(versions, list) and len(versions) == 2 and all(type(version) is int for version in versions)):
            raise WireError("MALFORMED", f"HELLO has protocol {versions!r}; it is [lowest, highest]")
        given = hello.get("token", "")
        if self.token and not hmac.compare_digest(str(given).encode(), self.token.encode()):
            raise Refused("AUTH_FAILED", "this server asks for a token and HELLO's is " + ("another; check it" if given else "missing; add it"))
        if not versions[0] <= wire.VERSION <= versions[1]:
            raise Refused("UNSUPPORTED_VERSION", f"the client speaks protocols {versions[0]} to {versions[1]}, this server {wire.VERSION}; update one of them",
                          protocol=[wire.VERSION, wire.VERSION])
        offered, most = hello.get("capabilities", []), hello.get("max_frame", self.limits.max_frame)
        if not isinstance(offered, list) or type(most) is not int or most < wire.LARGEST_BEFORE_WELCOME:
            raise WireError("MALFORMED", f"HELLO has capabilities {offered!r} and max_frame {most!r}; a list and at least {wire.LARGEST_BEFORE_WELCOME}")
        if self._stop.is_set():
            raise Refused("SHUTTING_DOWN", "the server shuts down; try again later", retry_after_s=5)
        capabilities = [name for name in ("render", "crc") if name in offered and (name != "render" or self.world.renders)]
        session, resumed = self._take_up(connection, hello["resume"]) if hello.get("resume") else self._open(connection, request)
        connection.crc, connection.limit = "crc" in capabilities, min(most, self.limits.max_frame)
        session.renders = "render" in capabilities
        answer = connection.pack(wire.WELCOME, wire.dump_json({
            "protocol": wire.VERSION, "server": "consac-python 0.1.0", "session": session.number, "resume": session.token, "capabilities": capabilities,
            "max_frame": connection.limit, "heartbeat_s": self.limits.heartbeat_s, "last_request": session.last_request, "resumed": resumed}), request, session.number)
        if not resumed:
            session.answer = answer
        try:
            connection.write(answer)
        except _Gone:
            self._detach(connection, session)
            raise
        return session

    def _open(self, connection: _Connection, request: int) -> tuple[_Session, bool]:
        with self._lock:
            if len(self._sessions) >= self.limits.max_sessions:
                lost = [session.lost_at for session in self._sessions.values() if session.connection is None]
                wait = max(1.0, min(lost) + self.limits.resume_s - time.monotonic()) if lost else 10.0
                raise Refused("CAPACITY", f"all {self.limits.max_sessions} sessions are taken; close one, or start the server with more --max-sessions",
                              retry_after_s=round(wait, 1))
            session = _Session(self._next_session)
            self._next_session += 1
            self._sessions[session.number] = session
            session.connection, session.last_request = connection, request
            session.lock.acquire()
        return session, False

    def _take_up(self, connection: _Connection, token) -> tuple[_Session, bool]:
        with self._lock:
            session = next((known for known in self._sessions.values() if hmac.compare_digest(known.token.encode(), str(token).encode())), None)
            if session is None:
                raise Refused("AUTH_FAILED", "no session has this resume token, or it has expired; begin a new one")
            before, session.connection = session.connection, connection
        if before is not None:
            try:
                before.sock.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
        if not session.lock.acquire(timeout=self.limits.handshake_s):
            with self._lock:
                session.connection = before
            raise Refused("CAPACITY", f"session {session.number} is still at work on request {session.last_request + 1}; try again", retry_after_s=1)
        return session, True

    def _serve_session(self, connection: _Connection, session: _Session) -> None:
        look = lambda: self._look(connection, session.deadline)
        while True:
            connection.request = 0
            kind, request, number, payload = connection.read(look)
            connection.request = request
            if session.deadline is not None:
                self._check_deadline(connection, session.deadline)
            if kind == wire.BYE:
                self._end(session, "said BYE")
                return
            if self._aside(connection, kind, payload, session.number):
                continue
            if request != session.last_request + 1 or number != session.number:
                if request == session.last_request != 0 and number == session.number:
                    connection.write(session.answer)
                    continue
                why = f"request {request} after {session.last_request}; the next is {session.last_request + 1}"
                if number != session.number:
                    why = f"session {number} on the connection of session {session.number}"
                connection.write(connection.pack(wire.ERROR, _error_json("BAD_STATE", why), request, session.number))
                continue
            if connection.closing.is_set():
                raise Refused("SHUTTING_DOWN", "the server shuts down; this request was not carried out", retry_after_s=5)
            try:
                answer = self._carry_out(connection, session, kind, request, payload)
            except Refused as error:
                if error.code in CONNECTION_ERRORS:
                    raise
                answer = connection.pack(wire.ERROR, _error_json(error.code, error.message, **error.extra), request, session.number)
            session.last_request, session.answer = request, answer
            connection.write(answer)
            if connection.closing.is_set():
                raise _Gone("the server shuts down")

    def _carry_out(self, connection: _Connection, session: _Session, kind: int, request: int, payload):
        batch = session.batch
        if kind == wire.STEP or kind == wire.RESET:
            if not session.configured:
                raise Refused("BAD_STATE", f"{'STEP' if kind == wire.STEP else 'RESET'} before CONFIGURE; configure first")
            if kind == wire.RESET:
                batch.reset(payload)
            elif not batch.started:
                raise Refused("BAD_STATE", "STEP before a first RESET; reset first")
            else:
                batch.step(payload)
            answer = batch.result(request, session.number, connection.crc)
            if len(answer) - HEADER.size > connection.limit:
                batch.infos, batch.final_infos = [], []
                batch._drop("", "make the RESULT larger than the client takes")
                answer = batch.result(request, session.number, connection.crc)
            return answer
        if kind == wire.CONFIGURE:
            return connection.pack(wire.SPEC, self._configure(connection, session, wire.load_json(payload)), request, session.number)
        if kind == wire.RENDER:
            if not session.renders:
                raise Refused("UNSUPPORTED", "RENDER without the capability `render`" + ("" if self.world.renders else "; this server's environments do not draw"))
            if batch is None:
                raise Refused("BAD_STATE", "RENDER before CONFIGURE; configure first")
            image = batch.render(wire.load_json(payload))
            if len(image) > connection.limit:
                raise Refused("UNSUPPORTED", f"an image of {len(image)} bytes, over the client's max_frame {connection.limit}; raise it")
            return connection.pack(wire.FRAME, image, request, session.number)
        if kind == wire.HELLO:
            raise Refused("BAD_STATE", "HELLO twice on one connection; go on with CONFIGURE or RESET")
        raise Refused("UNKNOWN_MESSAGE", f"a frame of type {kind} is not {'sent by a client' if kind <= wire.FRAME else 'known here'}")

    def _configure(self, connection: _Connection, session: _Session, wanted: dict) -> bytes:
        if session.batch is not None and session.batch.started:
            raise Refused("BAD_STATE", "CONFIGURE after a RESET; begin a new session")
        autoreset, transport = wanted.get("autoreset", "same_step"), wanted.get("transport", "tcp")
        if autoreset not in AUTORESETS:
            raise Refused("UNSUPPORTED", f"autoreset {autoreset!r}; there are {', '.join(AUTORESETS)}", path="autoreset")
        if transport != "tcp":
            raise Refused("UNSUPPORTED", f"transport {transport!r}; this server has tcp", path="transport")
        spec = self.world.to_json(autoreset, self.training_length, self.model_name)
        if "expect" in wanted:
            difference = wire.first_difference(wanted["expect"], spec["behaviours"], "behaviours")
            if difference:
                path, expected, found = difference
                path = "/".join(part for part in path.split("/") if part not in ("spaces", "space"))
                both = [wire.dump_json(value).decode()[:400] for value in (expected, found)]
                raise Refused("SPEC_MISMATCH", f"{path}: the client expects {both[0]}, the engine has {both[1]}", path=path)
        text = wire.dump_json(spec)
        largest = max(Batch.largest_result(self.world), Batch.step_bytes(self.world), len(text))
        if largest > connection.limit:
            raise Refused("UNSUPPORTED", f"this world's frames have up to {largest} bytes, over max_frame {connection.limit}; raise it or serve fewer environments")
        if session.batch is None:
            session.batch = self._make_batch()
        session.batch.autoreset = autoreset
        session.configured, session.deadline = True, None
        return text

    def _make_batch(self) -> Batch:
        envs: list = []
        try:
            for _ in range(self.world.environments):
                envs.append(self.make_env())
        except Exception as error:
            for env in envs:
                env.close()
            raise Refused("ENV_FAILED", f"environment {len(envs)} cannot be made: {type(error).__name__}: {error}", env=len(envs)) from error
        return (AgentBatch if self.world.multi_agent else Batch)(self.world, envs, self.seed, self._log)

    # -- text protocol 1

    def _text_misfit(self) -> str:
        """Why text protocol 1 cannot carry this world, or nothing."""
        if self.token:
            return "it has no access token"
        if self.world.multi_agent:
            return "there are several agents"
        if self.training_length == 0 and not self.model_name:
            return "it needs a training length (--steps) or a model's name"
        for what, space in (("action", self.world.behaviours[0].action.space), ("observation", self.world.behaviours[0].observation.space)):
            discrete = isinstance(space, spaces.Discrete) and space.start == 0 and space.n <= 65536
            box = isinstance(space, spaces.Box) and len(space.shape) == 1 and space.dtype == np.float32 and 1 <= space.shape[0] <= 65536
            if not discrete and not box:
                return f"the {what} space is {space}; it takes Discrete from 0 and flat float32 Box"
        return ""

    def _serve_text(self, connection: _Connection) -> None:
        if not self._text_lock.acquire(timeout=self.limits.grace_s):  # a trainer that just closed may be coming back
            self._last_word(connection, b"busy: this engine serves another trainer; try again later\n")
            return
        env = None
        try:
            env = self.make_env()
            self._play_text(connection, env)
        except _Gone as error:
            self._log(f"text protocol 1: {error}")
        except Exception as error:
            self._last_word(connection, f"error: {' '.join(str(error).split())}\n".encode())
            self._log(f"text protocol 1: {error}")
        finally:
            self._text_lock.release()
            if env is not None:
                env.close()
            with self._lock:
                self._finished += 1

    def _play_text(self, connection: _Connection, env) -> None:
        reader = _TextReader(connection, env.action_space, self.limits)
        say = lambda text: connection.write(text.encode() + b"\n")
        name = f"#{self.model_name}" if self.model_name else ""
        say(f"{_text_space(env.action_space)}#{_text_space(env.observation_space)}#{self.training_length}{name}")
        observation, _ = env.reset(seed=self.seed)
        say(f"{_text_row(observation)}#0#0")
        done = 0
        while True:
            try:
                action = reader.next(connection)
            except _Gone as error:
                if self.training_length and done < self.training_length:
                    raise _Gone(f"{error}; {self.training_length - done} of {self.training_length} steps are missing") from None
                self._log(f"text protocol 1: training completed, {done} steps")
                return
            observation, reward, terminated, truncated, _ = env.step(action)
            done += 1
            over = bool(terminated or truncated)
            say(f"{_text_row(observation)}#{_text_number(reward)}#{int(over)}")
            if over:
                observation, _ = env.reset()
                say(f"{_text_row(observation)}#0#0")


class _TextReader:
    """Actions of text protocol 1, with or without terminators."""

    def __init__(self, connection: _Connection, space: spaces.Space, limits: Limits):
        self.space, self.limits, self.data = space, limits, b""

    def next(self, connection: _Connection):
        deadline = time.monotonic() + self.limits.text_s
        while True:
            self.data = self.data.lstrip(b"\r\n")
            line, terminator, rest = self.data.partition(b"\n")
            if terminator:
                self.data = rest
                return self._value(line.rstrip(b"\r"))
            if len(self.data) > 1 << 20:
                raise ValueError("an action of over 1 MiB without an end")
            if isinstance(self.space, spaces.Discrete) and self.space.n <= 10 and len(self.data) == 1 and self.data.isdigit():
                line, self.data = self.data, b""
                return self._value(line)
            if not connection.wait(self.limits.quiet_s if self.data else TICK):
                if self.data:
                    line, self.data = self.data, b""
                    return self._value(line)
                if connection.closing.is_set():
                    raise _Gone("the server shuts down")
                if time.monotonic() > deadline:
                    raise _Gone(f"no action for {self.limits.text_s:g} s")
                continue
            try:
                more = connection.sock.recv(65536)
            except OSError as error:
                raise _Gone(f"the connection broke: {error}") from None
            if not more:
                raise _Gone("the trainer closed")
            self.data += more

    def _value(self, line: bytes):
        text = line.decode("utf-8", "replace")
        shown = text if len(text) <= 60 else text[:60] + "..."
        if isinstance(self.space, spaces.Discrete):
            if not (text.isascii() and text.isdigit()) or int(text) >= self.space.n:
                raise ValueError(f"action '{shown}'; expected a whole number from 0 to {self.space.n - 1}")
            return self.space.dtype.type(int(text))
        try:
            values = [float(field) for field in text.split(",")]
        except ValueError:
            raise ValueError(f"action '{shown}'; expected {self.space.shape[0]} numbers") from None
        if len(values) != self.space.shape[0] or not np.isfinite(values).all():
            raise ValueError(f"action '{shown}'; expected {self.space.shape[0]} finite numbers")
        return np.clip(np.array(values, np.float32), self.space.low, self.space.high)


def _text_space(space: spaces.Space) -> str:
    if isinstance(space, spaces.Discrete):
        return f"D#{space.n}#0"
    bounds = np.concatenate([space.low, space.high])
    return f"B#{space.shape[0]}#" + ",".join(_text_number(np.float32(bound)) if np.isfinite(bound) else f"{'-' if bound < 0 else ''}{UNBOUNDED}" for bound in bounds)


def _text_row(observation) -> str:
    return ",".join(map(_text_number, observation)) if np.ndim(observation) else str(int(observation))


def _text_number(number) -> str:
    if not np.isfinite(number):
        raise ValueError(f"the environment gave {number}, which text protocol 1 never sends")
    text = str(number) if isinstance(number, np.floating) else repr(float(number))
    return text[:-2] if text.endswith(".0") else text


# ---- command line

def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _factory(name: str, render: bool = True):
    """Makes environments by Gymnasium id, or by `module:attribute` where the attribute is callable."""
    module, colon, attribute = name.partition(":")
    if colon and attribute.isidentifier():
        found = getattr(importlib.import_module(module), attribute, None)
        if callable(found):
            return found
    spec = gymnasium.spec(name)
    modes = getattr(gymnasium.envs.registration.load_env_creator(spec.entry_point), "metadata", {}).get("render_modes", []) if isinstance(spec.entry_point, str) else []
    mode = "rgb_array" if render and "rgb_array" in modes else None
    return lambda: gymnasium.make(name, render_mode=mode, disable_env_checker=True)


def _pettingzoo_factory(name: str, render: bool = True):
    module = importlib.import_module(name)

    def make():
        return module.parallel_env(render_mode="rgb_array") if render else module.parallel_env()

    return make


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="python -m consac.serve", description="Serves any Gymnasium or PettingZoo environment to CONSAC's trainers.")
    parser.add_argument("world", nargs="?", help="Gymnasium id, or module:attribute of a callable that makes an environment")
    parser.add_argument("--pettingzoo", metavar="MODULE", help="a module with parallel_env, as pettingzoo.mpe.simple_spread_v3")
    parser.add_argument("--envs", type=int, default=1, help="environments of each session")
    parser.add_argument("--host", default="127.0.0.1", help="address to bind; another than loopback needs --token")
    parser.add_argument("--port", type=int, default=5005, help="0 takes a free one")
    parser.add_argument("--port-file", metavar="F", help="the port is written here once it is open")
    parser.add_argument("--token", default=os.environ.get("CONSAC_TOKEN", ""), help="that clients must have; or set CONSAC_TOKEN")
    parser.add_argument("--steps", type=int, default=0, metavar="N", help="training length that is asked for")
    parser.add_argument("--model", default="", metavar="NAME", help="model that the trainer saves or finds")
    parser.add_argument("--seed", type=int, help="of the first reset, where the client gives none")
    parser.add_argument("--sessions", type=int, default=0, metavar="N", help="end after so many sessions; 0: never")
    parser.add_argument("--max-sessions", type=int, default=8, metavar="N", help="at once")
    parser.add_argument("--protocol", choices=["auto", "text1", "2"], default="auto")
    parser.add_argument("--no-render", action="store_true", help="make environments that do not draw")
    options = parser.parse_args(arguments)
    if (options.world is None) == (options.pettingzoo is None):
        parser.error("name one world: a Gymnasium id, module:attribute, or --pettingzoo MODULE")
    try:
        factory = _factory(options.world, not options.no_render) if options.world else _pettingzoo_factory(options.pettingzoo, not options.no_render)
        server = Server(factory, options.envs, host=options.host, port=options.port, token=options.token, protocol=options.protocol,
                        training_length=options.steps, model_name=options.model, seed=options.seed, sessions=options.sessions,
                        limits=Limits(max_sessions=options.max_sessions), log=lambda line: print(line, file=sys.stderr, flush=True))
    except Exception as error:  # an environment's constructor may raise anything
        print(f"consac.serve: {type(error).__name__}: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: server._stop.set())
    if options.port_file:
        fresh = f"{options.port_file}.{os.getpid()}"
        with open(fresh, "w") as file:
            file.write(f"{server.port}\n")
        os.replace(fresh, options.port_file)
    print(f"serving {server.world.name}, {options.envs} environment{'s' * (options.envs > 1)} per session, on {options.host}:{server.port}", flush=True)
    server.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
