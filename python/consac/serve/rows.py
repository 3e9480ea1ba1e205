"""One behaviour's rows in a RESULT, and its actions from a STEP."""
from __future__ import annotations

import numpy as np
from gymnasium import spaces

from consac.layout import Behaviour, Leaf, align

from .refusal import Refused
from .world import flat_mask


class Rows:
    """One behaviour's part of a RESULT buffer, and its actions from a STEP."""

    def __init__(self, behaviour: Behaviour, buffer, offset: int):
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
    def offsets(behaviour: Behaviour, offset: int) -> tuple[int, int, int, int]:
        """Where rewards, states, masks and the end lie."""
        rewards = align(offset + behaviour.slots * behaviour.observation.row_bytes)
        states = rewards + 8 * behaviour.slots
        end = states + behaviour.slots
        if not behaviour.masks_actions:
            return rewards, states, end, end
        masks = align(end)
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
        flat = flat_mask(mask)
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

    def _outside(self, slot: int, per_env: int, leaf: Leaf, value, say: str) -> Refused:
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
