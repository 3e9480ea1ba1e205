"""RELABEL: what steps would have paid had other goals been wanted, asked of an environment's compute_reward (Gymnasium's worlds with goals)."""
from __future__ import annotations

import struct

import numpy as np
from gymnasium import spaces

from consac.goals import ACHIEVED, DESIRED, has_goals
from consac.layout import Behaviour, Layout, align

from .refusal import FAILURES, Refused, describe

ROOM = 1 << 18  # bytes of a RELABEL that shared memory has room for; larger ones go over TCP
_WORDS = struct.Struct("<II")


def reward_function(env):
    """compute_reward(achieved_goal, desired_goal, info) of an environment or of what it wraps; None where there is none."""
    try:
        found = env.get_wrapper_attr("compute_reward") if hasattr(env, "get_wrapper_attr") else env.compute_reward
    except AttributeError:
        return None
    return found if callable(found) else None


class Goals:
    """The prices of one session's environments, which are alike: the first is asked."""

    def __init__(self, behaviours: list[Behaviour], env):
        self.behaviours, self._reward = behaviours, reward_function(env)
        self._all_at_once: bool | None = None  # whether it takes many goals in one call; None: not known yet

    def answer(self, payload, limit: int, failures) -> bytes:
        """REWARDS' payload, of at most `limit` bytes; Refused."""
        if len(payload) < 8:
            raise Refused("WRONG_SIZE", f"a RELABEL of {len(payload)} bytes; its first words alone have 8")
        place, count = _WORDS.unpack_from(payload)
        if place >= len(self.behaviours):
            raise Refused("OUT_OF_RANGE", f"RELABEL of behaviour {place}; there are {len(self.behaviours)}")
        layout = self.behaviours[place].observation
        if not has_goals(layout.space):
            raise Refused("UNSUPPORTED", f"observations of {self.behaviours[place].name} have no {ACHIEVED} and {DESIRED}")
        size = align(8 + count * layout.row_bytes)
        if len(payload) != size:
            raise Refused("WRONG_SIZE", f"a RELABEL of {len(payload)} bytes; with {count} rows it has {size}")
        if 8 * count > limit:
            raise Refused("UNSUPPORTED", f"REWARDS of {8 * count} bytes, over max_frame {limit}; ask for fewer rows at a time")
        rows = layout.views(bytearray(payload), count, 8)  # a copy: who shares their memory could write there meanwhile
        _check(layout, rows)
        if count == 0:
            return b""
        try:
            prices = self._prices(layout, rows, count)
        except FAILURES as error:
            failures.tell(error)
            raise Refused("ENV_FAILED", f"compute_reward failed: {describe(error)}") from error
        if not np.isfinite(prices).all():
            row = int(np.argmin(np.isfinite(prices)))
            raise Refused("NON_FINITE", f"compute_reward gave {prices[row]} for row {row} of RELABEL")
        return prices.astype("<f8").tobytes()

    def _prices(self, layout: Layout, rows: list[np.ndarray], count: int) -> np.ndarray:
        seen = layout.build([view.astype(leaf.space.dtype) for leaf, view in zip(layout.leaves, rows)])
        achieved, desired = seen[ACHIEVED], seen[DESIRED]

        def one(row: int) -> float:
            return float(self._reward(_row(achieved, row), _row(desired, row), {}))

        prices = None
        if self._all_at_once or count > 1 and self._all_at_once is None:
            prices = self._price_all(achieved, desired, count)
        if count > 1 and self._all_at_once is None:  # many may be rounded otherwise than one
            self._all_at_once = prices is not None and all(np.isclose(prices[row], one(row)) for row in (0, count - 1))
        if not self._all_at_once or prices is None:
            prices = np.array([one(row) for row in range(count)], np.float64)
        return prices

    def _price_all(self, achieved, desired, count: int) -> np.ndarray | None:
        """Of all rows in one call; None where it is not made for that, which its shape or what it raises shows."""
        try:
            prices = np.asarray(self._reward(achieved, desired, [{}] * count), np.float64)
        except FAILURES:
            if self._all_at_once:
                raise
            return None
        return prices if prices.shape == (count,) else None


def _check(layout: Layout, rows: list[np.ndarray]) -> None:
    """Refuses goals outside their space; boxes are not judged by their bounds, nor what else a row holds (R93)."""
    for leaf, view in zip(layout.leaves, rows):
        if leaf.path[0] not in (ACHIEVED, DESIRED):
            continue
        space, path = leaf.space, "/".join(map(str, leaf.path))
        if isinstance(space, spaces.Box):
            if view.dtype.kind == "f" and not np.isfinite(view).all():
                raise Refused("NON_FINITE", f"NaN or infinity in {path} of RELABEL; send finite numbers")
            continue
        low, high = (int(space.start), int(space.start) + int(space.n)) if isinstance(space, spaces.Discrete) else (0, space.nvec if isinstance(space, spaces.MultiDiscrete) else 2)
        if not ((view >= low) & (view < high)).all():
            raise Refused("OUT_OF_RANGE", f"a value outside {space} in {path} of RELABEL")


def _row(part, row: int):
    if isinstance(part, dict):
        return {name: _row(child, row) for name, child in part.items()}
    return tuple(_row(child, row) for child in part) if isinstance(part, tuple) else part[row]
