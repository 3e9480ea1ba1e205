"""Other goals' rewards, asked of an engine: RELABEL and REWARDS of spec/protocol2.md, and compute_reward of Gymnasium's worlds with goals."""
from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from .errors import ConsacError, ProtocolError
from .layout import Behaviour, align
from .wire import LARGEST_RELABEL

if TYPE_CHECKING:
    from .client import Connection
    from .text1 import TextConnection

ACHIEVED, DESIRED = "achieved_goal", "desired_goal"
_WORDS = struct.Struct("<II")


def has_goals(space: spaces.Space[Any]) -> bool:
    """Whether observations have goals, of equal spaces, as Gymnasium's worlds with goals have them."""
    return isinstance(space, spaces.Dict) and ACHIEVED in space.spaces and space.spaces[ACHIEVED] == space.spaces.get(DESIRED)


def relabel_payloads(behaviours: list[Behaviour], place: int, goals: dict[str, Any], rows: int, max_frame: int) -> Iterator[tuple[bytearray, int]]:
    """RELABELs of `rows` rows, as few as an engine takes: each payload and its rows. `goals`: what stands in the dict of an observation, [rows, ...]; the rest is 0, which nobody judges (R93)."""
    layout = behaviours[place].observation
    most = max(1, (min(max_frame, LARGEST_RELABEL) // 8 * 8 - 8) // max(layout.row_bytes, 8))
    for begin in range(0, rows, most):
        some = min(most, rows - begin)
        payload = bytearray(align(8 + some * layout.row_bytes))
        _WORDS.pack_into(payload, 0, place, some)
        for leaf, view in zip(layout.leaves, layout.views(payload, some, 8)):
            if leaf.path[0] in goals:
                view[:] = np.asarray(layout.pick(goals, leaf))[begin:begin + some]
        yield payload, some


def read_rewards(payload: bytes | bytearray | memoryview, rows: int) -> npt.NDArray[np.float64]:
    """[rows] f64 of a REWARDS, or ProtocolError (R94, R95)."""
    if len(payload) != 8 * rows:
        raise ProtocolError("WRONG_SIZE", f"REWARDS of {len(payload)} bytes, expected {8 * rows}: 8 for each row of RELABEL (R94)")
    rewards = np.frombuffer(payload, "<f8").astype(np.float64)
    if not np.isfinite(rewards).all():
        raise ProtocolError("NON_FINITE", f"REWARDS has {rewards[~np.isfinite(rewards)][0]} for row {int(np.argmin(np.isfinite(rewards)))} of RELABEL (R95)")
    return rewards


def require_relabel(connection: Connection | TextConnection) -> None:
    """ConsacError where the engine of `connection` offers no capability `relabel`; over text protocol 1 none does."""
    if "relabel" not in connection.capabilities:
        raise ConsacError(f"{connection.url} cannot say what other goals would have paid: it does not offer the capability `relabel`")


def compute_reward(connection: Connection, achieved_goal: Any, desired_goal: Any, info: object = None) -> Any:
    """What a step would have paid that led to `achieved_goal` had `desired_goal` been wanted, by the engine of `connection`: of one goal (a
    number) or of many along the first axis ([rows]). As Gymnasium's worlds with goals have it; of `info` the engine hears nothing."""
    require_relabel(connection)
    one = np.shape(_first(achieved_goal)) == _first_shape(_goal_space(connection))
    both = {ACHIEVED: achieved_goal, DESIRED: desired_goal}
    if one:
        both = {name: _many(value) for name, value in both.items()}
    rewards = connection.relabel(both, len(_first(both[ACHIEVED])))
    return float(rewards[0]) if one else rewards


def _goal_space(connection: Connection) -> spaces.Space[Any]:
    space: Any = connection.behaviours[0].observation.space
    found: spaces.Space[Any] = space.spaces[ACHIEVED]
    return found


def _first(value: Any) -> Any:
    """A leaf of a goal."""
    while isinstance(value, (dict, tuple)):
        value = next(iter(value.values())) if isinstance(value, dict) else value[0]
    return value


def _first_shape(space: spaces.Space[Any]) -> tuple[int, ...]:
    while isinstance(space, (spaces.Dict, spaces.Tuple)):
        space = next(iter(space.spaces.values())) if isinstance(space, spaces.Dict) else space.spaces[0]
    return space.shape or ()


def _many(value: Any) -> Any:
    """One goal as a batch of one."""
    if isinstance(value, dict):
        return {name: _many(child) for name, child in value.items()}
    return tuple(map(_many, value)) if isinstance(value, tuple) else np.asarray(value)[None]
