"""All environments of an engine as a Gymnasium VectorEnv: one message steps them all."""
from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from . import wire
from .errors import ConsacError
from .env import REMOTE_ID, mask_value, pick, put, row_reader, take_parameters
from .face import RENDER_FPS, Face
from .layout import Layout, Leaf
from .model_file import Array

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import Options

_WIRE_MODES = {AutoresetMode.NEXT_STEP: "next_step", AutoresetMode.SAME_STEP: "same_step", AutoresetMode.DISABLED: "disabled"}
_ANY_WAY = ("next_step", "same_step")
_TERMINATED, _TRUNCATED = (np.array([state & bit != 0 for state in range(256)]) for bit in (wire.TERMINATED, wire.TRUNCATED))  # by state: faster than bits


class ConsacVectorEnv(VectorEnv[Any, Any, Any]):
    """An engine's environments, one agent each, as `consac.make_vec` returns them.

    Without an autoreset_mode it is Gymnasium's default, NEXT_STEP, or SAME_STEP where the engine knows no other way.
    With copy=False observations are views of the receive buffer, which hold until the next step. Other arguments are in options.py."""

    def __init__(self, url: str, autoreset_mode: str | AutoresetMode | None = None, render_mode: str | None = None, copy: bool = True, **options: Unpack[Options]) -> None:
        ways = _ANY_WAY if autoreset_mode is None else (_WIRE_MODES[autoreset_mode_of(autoreset_mode)],)
        face = Face(ways, text1="which has one environment; use consac.make")
        self.connection: Any
        self.connection, modes = face.open(url, render_mode, {**options})
        connection = self.connection
        mode = next(known for known, name in _WIRE_MODES.items() if name == connection.autoreset)
        behaviour = connection.behaviours[0]
        self.num_envs, self.copy, self.autoreset_mode, self.render_mode = connection.environments, copy, mode, render_mode
        self.metadata = {"render_modes": modes, "render_fps": RENDER_FPS, "autoreset_mode": mode}
        self.spec = EnvSpec(REMOTE_ID, "consac.env:ConsacEnv", nondeterministic=not connection.deterministic, max_episode_steps=connection.max_episode_steps or None,
                            order_enforce=False, kwargs={"url": url})
        self.single_observation_space, self.single_action_space = behaviour.observation.space, behaviour.action.space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._behaviour, self._rows, self._actions = behaviour, connection.rows[0], connection.actions[0]
        self._write, self.read = batch_writer(behaviour.action, self._actions), batch_reader(behaviour.observation, self._rows.observations, copy)

    def reset(self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        if options is not None and "reset_mask" in options:
            options = dict(options)
            mask = reset_mask(options.pop("reset_mask"), self.num_envs)
        else:
            mask = None
        self.connection.reset(mask, self._seeds(seed), take_parameters(self.connection, options))
        return self.read(), self._infos(mask)

    def step(self, actions: Any) -> tuple[Any, Array, Array, Array, dict[str, Any]]:
        self._write(actions)
        connection = self.connection
        connection.step()
        rows = self._rows
        infos = self._infos() if connection.parts or rows.masks is not None else {}
        return self.read(), rows.rewards.copy(), _TERMINATED.take(rows.states), _TRUNCATED.take(rows.states), infos

    def render(self) -> tuple[Any, ...] | None:
        return tuple(self.connection.render(env) for env in range(self.num_envs)) if self.render_mode == "rgb_array" else None

    def close_extras(self, **_: Any) -> None:
        self.connection.close()

    def _seeds(self, seed: Any) -> list[int] | None:
        if seed is None:
            return None
        if isinstance(seed, (int, np.integer)):
            return [int(seed) + i for i in range(self.num_envs)]
        if isinstance(seed, (str, bytes)) or not hasattr(seed, "__len__") or len(seed) != self.num_envs:
            raise ValueError(f"seed={seed!r} for {self.num_envs} environments; it is a whole number, or a list of one for each")
        if all(one is None for one in seed):
            return None
        return [int(self.np_random.integers(1 << 31)) if one is None else one for one in seed]

    def _infos(self, mask: Array | None = None) -> dict[str, Any]:
        connection, rows, count = self.connection, self._rows, self.num_envs
        infos: dict[str, Any] = {}
        if connection.parts & wire.PART_FINALS:
            slots, final = rows.final_slots, np.full(count, None, object)
            for place, slot in enumerate(slots):
                final[slot] = row_reader(self._behaviour.observation, rows.finals, place)()
            ended = np.zeros(count, np.bool_)
            ended[slots] = True
            infos |= {"final_obs": final, "_final_obs": ended, "final_info": columns(connection.final_infos, count), "_final_info": ended.copy()}
        infos |= columns(connection.infos, count)
        if rows.masks is not None:
            given = np.ones(count, np.bool_) if mask is None else mask.copy()
            if isinstance(self.single_action_space, spaces.Discrete):
                masks = rows.masks.astype(np.int8)
                masks[~given] = 0
            else:
                masks = np.full(count, None, object)
                for i in np.flatnonzero(given):
                    masks[i] = mask_value(self.single_action_space, rows.masks[i])
            infos |= {"action_mask": masks, "_action_mask": given}
        return infos


def make_vec(url: str, *, autoreset_mode: str | AutoresetMode | None = None, render_mode: str | None = None, copy: bool = True, **options: Unpack[Options]) -> ConsacVectorEnv:
    """All environments that an engine offers at `url`."""
    return ConsacVectorEnv(url, autoreset_mode, render_mode, copy, **options)


def autoreset_mode_of(mode: str | AutoresetMode) -> AutoresetMode:
    """Gymnasium's value, or its name as "next_step" or "NextStep"."""
    for known in AutoresetMode:
        if mode in (known, known.value, known.name.lower()):
            return known
    raise ConsacError(f"autoreset_mode={mode!r} is unknown; use {', '.join(repr(known.name.lower()) for known in AutoresetMode)}")


def reset_mask(mask: Any, count: int) -> Array:
    """The mask if it is what Gymnasium's vector environments take."""
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"options['reset_mask'] must be a numpy array of bool, got {mask!r}")
    if mask.shape != (count,) or not mask.any():
        raise ValueError(f"options['reset_mask'] must have the shape ({count},) and one True at least, got {mask!r}")
    return mask


def columns(said: dict[str, Any] | None, count: int) -> dict[str, Any]:
    """Infos in Gymnasium's column form: for each key an array over environments, and a mask `_key`."""
    infos: dict[str, Any] = {}
    for key, column in (said or {}).items():
        _add(infos, key, column["slots"], column["values"], count)
    return infos


def _add(infos: dict[str, Any], key: str, slots: list[int], values: list[Any], count: int) -> None:
    kind = type(values[0]) if values else object
    if kind is dict and all(type(value) is dict for value in values):
        array: Any = {}
        inner: dict[str, tuple[list[int], list[Any]]] = {}
        for slot, value in zip(slots, values):
            for name, part in value.items():
                column = inner.setdefault(name, ([], []))
                column[0].append(slot)
                column[1].append(part)
        for name, (below, parts) in inner.items():
            _add(array, name, below, parts, count)
    else:
        array = _numbers(slots, values, count) if kind in (int, float, bool) else None
        if array is None:
            array = np.full(count, None, object)
            for slot, value in zip(slots, values):
                array[slot] = value
    given = np.zeros(count, np.bool_)
    given[slots] = True
    infos[key], infos[f"_{key}"] = array, given


def _numbers(slots: list[int], values: list[Any], count: int) -> Array | None:
    """An array of the first value's type, as Gymnasium has it; None where others do not fit that."""
    array = np.zeros(count, type(values[0]))
    try:
        array[slots] = values
    except (TypeError, ValueError, OverflowError):
        return None
    return array


def batch_writer(layout: Layout, views: list[Array]) -> Callable[[Any], None]:
    """A function that writes a batch of actions."""
    if len(views) == 1 and not layout.leaves[0].path:
        rows, leaf, shape, dtype = views[0], layout.leaves[0], views[0].shape, views[0].dtype

        def write(actions: Any) -> None:
            if type(actions) is np.ndarray and actions.dtype == dtype and actions.shape == shape:
                rows[...] = actions
            else:
                put(rows, actions, leaf)

        return write

    def write_leaves(actions: Any) -> None:
        for rows, leaf in zip(views, layout.leaves):
            put(rows, pick(layout, actions, leaf), leaf)

    return write_leaves


def batch_reader(layout: Layout, views: list[Array], copy: bool) -> Callable[[], Any]:
    """A function that returns the batch of observations; fresh ones with `copy`."""

    def reader(leaf: Leaf, view: Array) -> Callable[[], Any]:
        dtype = leaf.space.dtype
        if view.dtype == dtype:
            return view.copy if copy else lambda: view
        return lambda: view.astype(dtype)

    readers = [reader(leaf, view) for leaf, view in zip(layout.leaves, views)]
    if len(readers) == 1 and not layout.leaves[0].path:
        return readers[0]
    return lambda: layout.build([read() for read in readers])
