"""A second judge of RESULTs, made from spec/protocol2.md alone: which rule a payload breaks, None for none."""
import math
import struct

import numpy as np
from gymnasium import spaces

from consac import wire
from consac.layout import Behaviour, align

ENDS, BEGINS = wire.TERMINATED | wire.TRUNCATED, wire.FIRST | wire.ACTIVE


class ResultCheck:
    """The RESULTs of one session. `ask` before each RESET and STEP, then `judge`."""

    def __init__(self, spec, autoreset, agreed=()):
        self.groups, self.known = len(spec["groups"]) if "groups" in agreed else 0, 3 | 4 * ("statistics" in agreed) | 8 * ("groups" in agreed)
        self.environments, self.autoreset = spec["environments"], autoreset
        self.behaviours = [Behaviour.from_json(value, self.environments) for value in spec["behaviours"]]
        self.states = [bytes(behaviour.slots) for behaviour in self.behaviours]
        self.before, self.step, self.chosen = None, False, b"\1" * self.environments

    def ask(self, step, chosen):
        self.step, self.chosen = step, bytes(chosen)

    def over(self, environment):
        """No agent takes part there."""
        return not any(states[slot] & wire.ACTIVE for states, behaviour in zip(self.states, self.behaviours) for slot in self._slots(behaviour, environment))

    @staticmethod
    def _slots(behaviour, environment):
        agents = len(behaviour.agents)
        return range(environment * agents, (environment + 1) * agents)

    def _took_part(self, environment):
        return self.step and self.chosen[environment] and any(was[slot] & wire.ACTIVE for behaviour, was in zip(self.behaviours, self.states) for slot in self._slots(behaviour, environment))

    def judge(self, payload):
        try:
            self._judge(bytes(payload))
        except Broken as broken:
            return broken.args[0]
        return None

    def _judge(self, payload):
        blocks, at = [], 8
        for behaviour in self.behaviours:
            sizes = [behaviour.slots * behaviour.observation.row_bytes, 8 * behaviour.slots, behaviour.slots]
            sizes.append(behaviour.slots * behaviour.action.mask_bytes if behaviour.masks_actions else 0)
            block = []
            for size in sizes:
                block.append((at, at + size))
                at = align(at + size)
            blocks.append(block)
        need("R60", len(payload) >= at)
        parts, = struct.unpack_from("<I", payload)
        need("R61", parts & ~self.known == 0)
        states = [payload[block[2][0]:block[2][1]] for block in blocks]
        finals = []
        for behaviour, said in zip(self.behaviours, states):
            rows = sum(1 for state in said if state & wire.FINAL)
            finals.append((at, at + rows * behaviour.observation.row_bytes))
            at = align(finals[-1][1])
        need("R61", any(begin < end for begin, end in finals) == bool(parts & 1))
        paid, texts = at, {}
        if parts & 8:
            at += 8 * self.environments * self.groups
        for part in (4, 2):
            if parts & part:
                need("R60", len(payload) >= at + 4)
                length, = struct.unpack_from("<I", payload, at)
                texts[part] = (at + 4, at + 4 + length)
                at = align(at + 4 + length)
        need("R60", len(payload) == at)
        for begin, end in [piece for block in blocks for piece in block] + finals + list(texts.values()):
            need("R62", not any(payload[end:align(end)]))
        for behaviour, block, said, was, final in zip(self.behaviours, blocks, states, self.states, finals):
            at = final[0]
            for slot in range(behaviour.slots):
                self._judge_slot(payload, behaviour, block, slot, was[slot], said[slot])
                if said[slot] & wire.FINAL:
                    judge_row(behaviour, payload, at)
                    at += behaviour.observation.row_bytes
        if parts & 8:
            for index, reward in enumerate(struct.unpack_from(f"<{self.environments * self.groups}d", payload, paid)):
                need("R107", math.isfinite(reward) and (reward == 0 or self._took_part(index // self.groups)))
        if 4 in texts:
            judge_statistics(payload[slice(*texts[4])])
        if 2 in texts:
            self._judge_infos(payload[slice(*texts[2])], b"".join(states))
        self.states, self.before = states, payload

    def _judge_slot(self, payload, behaviour, block, slot, was, state):
        need("R63", state < 32)
        need("R64", not state & wire.FIRST or state & wire.ACTIVE)
        reward, = struct.unpack_from("<d", payload, block[1][0] + 8 * slot)
        chosen = self.chosen[slot // len(behaviour.agents)]
        plays = chosen and self.step and was & wire.ACTIVE
        need("R65", plays or reward == 0 and not state & (ENDS | wire.FINAL))
        need("R75", math.isfinite(reward))
        size = behaviour.observation.row_bytes
        row = block[0][0] + slot * size
        mask = block[3][0] + slot * behaviour.action.mask_bytes, block[3][0] + (slot + 1) * behaviour.action.mask_bytes
        if not chosen:
            need("R70", state == was & BEGINS)
            if not state & wire.ACTIVE:
                return
            need("R70", payload[row:row + size] == self.before[row:row + size])
            need("R70", not behaviour.masks_actions or payload[mask[0]:mask[1]] == self.before[mask[0]:mask[1]])
            return
        if not plays:
            need("R66", not state & wire.ACTIVE or state & wire.FIRST)
        elif not state & ENDS:
            need("R67", state == wire.ACTIVE)
        elif self.autoreset != "same_step":
            need("R69", not state & ~ENDS)
        else:
            need("R68", state & wire.FINAL or state == wire.TRUNCATED)
            need("R68", bool(state & wire.ACTIVE) == bool(state & wire.FIRST))
        if state & wire.ACTIVE and behaviour.masks_actions:
            judge_mask(behaviour, payload[mask[0]:mask[1]])
        if state & (wire.ACTIVE | ENDS):
            judge_row(behaviour, payload, row)

    def _judge_infos(self, text, states):
        try:
            said = wire.load_json(text)
            for part, bits in (("infos", 255), ("final_infos", wire.FINAL)):
                for column in said.get(part, {}).values():
                    slots = column["slots"]
                    need("R74", len(slots) == len(column["values"]) == len(set(slots)) and all(type(slot) is int and 0 <= slot < len(states) for slot in slots))
                    need("R74", bits == 255 or all(states[slot] & bits for slot in slots))
        except (wire.WireError, AttributeError, KeyError, TypeError):
            raise Broken("R74") from None


class Broken(Exception):
    """A rule is."""


def need(rule, holds):
    if not holds:
        raise Broken(rule)


def judge_row(behaviour, payload, at):
    for leaf in behaviour.observation.leaves:
        values = np.frombuffer(payload, leaf.dtype, int(np.prod(leaf.shape, dtype=int)), at + leaf.offset)
        space = leaf.space
        if isinstance(space, spaces.Box):
            need("R75", values.dtype.kind != "f" or np.isfinite(values).all())
        elif isinstance(space, spaces.Discrete):
            need("R73", space.start <= values[0] < space.start + space.n)
        elif isinstance(space, spaces.MultiDiscrete):
            need("R73", (values >= 0).all() and (values < space.nvec.ravel()).all())
        else:
            need("R73", (values <= 1).all())


def judge_mask(behaviour, mask):
    need("R71", all(byte <= 1 for byte in mask))
    for leaf in behaviour.action.leaves:
        space = leaf.space
        counts = [space.n] if isinstance(space, spaces.Discrete) else space.nvec.ravel() if isinstance(space, spaces.MultiDiscrete) else [2] * int(np.prod(leaf.shape)) if isinstance(space, spaces.MultiBinary) else []
        for count in counts:
            need("R72", any(mask[:count]))
            mask = mask[count:]


def judge_statistics(text):
    try:
        said = wire.load_json(text)
    except wire.WireError:
        raise Broken("R105") from None
    for name, values in said.items():
        need("R105", name.isprintable() and 0 < len(name.encode()) < 256)
        need("R105", isinstance(values, list) and values and all(type(value) in (int, float) for value in values))
