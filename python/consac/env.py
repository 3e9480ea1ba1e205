"""One environment of an engine as a Gymnasium Env."""
from __future__ import annotations

import functools
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.envs.registration import EnvSpec

from . import wire
from .client import Connection
from .face import RENDER_FPS, Face
from .goals import compute_reward, has_goals
from .layout import Layout, Leaf, align
from .model_file import Array

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from .options import Options

REMOTE_ID = "consac/Remote-v0"
_FACE = Face("disabled", environments="use consac.make_vec", protocol="auto")
_INT = struct.Struct("<i")
_TAIL = struct.Struct("<dB")  # reward and state of a single slot


class ConsacEnv(gymnasium.Env[Any, Any]):
    """An engine with one environment and one agent, as `consac.make` returns it.

    `url`: tcp://host:port. `protocol`: "auto", 2 or "text1". The other arguments are in options.py."""

    def __init__(self, url: str, render_mode: str | None = None, protocol: str | int = "auto", **options: Unpack[Options]) -> None:
        self._connection: Any  # of either protocol
        self._connection, modes = _FACE.open(url, render_mode, {"protocol": protocol, **options})
        connection = self._connection
        self.metadata = {"render_modes": modes, "render_fps": RENDER_FPS}
        self.render_mode = render_mode
        self.spec = EnvSpec(REMOTE_ID, "consac.env:ConsacEnv", nondeterministic=not connection.deterministic, max_episode_steps=connection.max_episode_steps or None,
                            order_enforce=False, kwargs={"url": url, "render_mode": render_mode, "protocol": protocol, **options})
        if isinstance(connection, Connection):
            behaviour = connection.behaviours[0]
            self.observation_space, self.action_space = behaviour.observation.space, behaviour.action.space
            self._write: Callable[[Any], None] | None = row_writer(connection)
            self._read = row_reader(behaviour.observation, connection.rows[0].observations, 0)
            self._tail_at = wire.HEADER.size + 8 + align(behaviour.observation.row_bytes)
            self._masked = behaviour.masks_actions
        else:
            self.observation_space, self.action_space = connection.observation_space, connection.action_space
            self._write = None
        if has_goals(self.observation_space):  # checkers take whatever has it for a world with goals
            self.compute_reward = functools.partial(compute_reward, connection)  # not over self, which would then hold itself

    @property
    def connection(self) -> Connection:
        """The session; `connection.spec` is what the engine says of itself."""
        connection: Connection = self._connection
        return connection

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        connection = self._connection
        if self._write is None:
            first: tuple[Any, dict[str, Any]] = connection.reset(seed)
            return first
        connection.reset(None, None if seed is None else [seed], take_parameters(connection, options))
        return self._read(), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        connection = self._connection
        if self._write is None:
            outcome: tuple[Any, float, bool, bool, dict[str, Any]] = connection.step(action)
            return outcome
        self._write(action)
        connection.step()
        reward, state = _TAIL.unpack_from(connection._in, self._tail_at)
        if connection.parts or self._masked:
            return self._read(), reward, state & 1 != 0, state & 2 != 0, self._info()
        return self._read(), reward, state & 1 != 0, state & 2 != 0, {}

    def _info(self) -> dict[str, Any]:
        connection = self._connection
        info = {key: column["values"][0] for key, column in connection.infos.items() if column["values"]} if connection.infos else {}
        if self._masked:
            info["action_mask"] = mask_value(self.action_space, connection.rows[0].masks[0])
        return info

    def render(self) -> Any:
        return self._connection.render(0) if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        if hasattr(self, "_connection"):
            self._connection.close()


def take_parameters(connection: Connection, options: dict[str, Any] | None) -> dict[str, Any] | None:
    """`options` of a reset without "parameters", which are set: {name: number}. An engine without parameters gets all of it as it is."""
    if options is None or not connection.parameters or "parameters" not in options:
        return options
    rest = dict(options)
    connection.set_parameters(rest.pop("parameters"))
    return rest or None


def make(url: str, *, max_episode_steps: int | None = None, render_mode: str | None = None, protocol: str | int = "auto", **options: Unpack[Options]) -> gymnasium.Env[Any, Any]:
    """The environment that an engine offers at `url`; `max_episode_steps` truncates its episodes here."""
    env = ConsacEnv(url, render_mode, protocol, **options)
    return gymnasium.wrappers.TimeLimit(env, max_episode_steps) if max_episode_steps else env


# ---- one value of a space to and from its row

def row_writer(connection: Any) -> Callable[[Any], None]:
    """A function that writes the action of slot 0."""
    layout, views = connection.behaviours[0].action, connection.actions[0]
    if isinstance(layout.space, spaces.Discrete):
        pack, out, at = _INT.pack_into, connection._out, connection.action_offsets[0]

        def write_choice(action: Any) -> None:
            try:
                pack(out, at, action)
            except (struct.error, TypeError):
                put(views[0][0:1].reshape(()), action, layout.leaves[0])

        return write_choice
    return slot_writer(layout, views, 0)


def slot_writer(layout: Layout, views: list[Array], slot: int) -> Callable[[Any], None]:
    """A function that writes a value of the space into one slot's row."""
    rows = [view[slot] if view.ndim > 1 else view[slot:slot + 1].reshape(()) for view in views]
    if len(rows) == 1 and not layout.leaves[0].path:
        row, leaf, shape, dtype = rows[0], layout.leaves[0], rows[0].shape, rows[0].dtype

        def write(action: Any) -> None:
            if type(action) is np.ndarray and action.dtype == dtype and action.shape == shape:
                row[...] = action
            else:
                put(row, action, leaf)

        return write

    def write_leaves(action: Any) -> None:
        for row, leaf in zip(rows, layout.leaves):
            put(row, pick(layout, action, leaf), leaf)

    return write_leaves


def pick(layout: Layout, value: Any, leaf: Leaf) -> Any:
    """The leaf's part of a value; ValueError where the value has no such part."""
    try:
        return layout.pick(value, leaf)
    except (KeyError, IndexError, TypeError):
        raise ValueError(f"the action {value!r} lacks {'/'.join(map(str, leaf.path))}; expected {layout.space}") from None


def put(row: Array, value: Any, leaf: Leaf) -> None:
    """Copies `value` into `row`, which may be one row or all; ValueError where its shape or kind does not fit."""
    try:
        array = np.asarray(value)
    except ValueError:  # lists of different lengths
        raise ValueError(f"an action that is no array: {value!r}") from None
    where = f" for {'/'.join(map(str, leaf.path))}" if leaf.path else ""
    if array.shape != row.shape:
        raise ValueError(f"an action of shape {array.shape}{where}, expected {row.shape}: {value!r}")
    if array.dtype.kind not in ("biuf" if row.dtype.kind == "f" else "biu"):
        raise ValueError(f"an action of type {array.dtype}{where}, expected {row.dtype}: {value!r}")
    row[...] = array
    if row.dtype.kind in "iu" and row.astype(array.dtype).tobytes() != array.tobytes():
        raise ValueError(f"the action {value!r}{where} does not fit {row.dtype}")


def row_reader(layout: Layout, views: list[Array], slot: int) -> Callable[[], Any]:
    """A function that returns a fresh value of the space from one slot's row."""
    readers = [leaf_reader(leaf, view, slot) for leaf, view in zip(layout.leaves, views)]
    if len(readers) == 1 and not layout.leaves[0].path:
        return readers[0]
    return lambda: layout.build([read() for read in readers])


def leaf_reader(leaf: Leaf, view: Array, slot: int) -> Callable[[], Any]:
    """A function that returns a fresh value of one leaf from one slot's row."""
    if isinstance(leaf.space, spaces.Discrete):
        one = view[slot:slot + 1].reshape(())
        return one.item
    one = view[slot:slot + 1].reshape(()) if view.ndim == 1 else view[slot]
    if leaf.dtype == leaf.space.dtype:
        return one.copy
    dtype = leaf.space.dtype
    return lambda: one.astype(dtype)


def mask_value(space: spaces.Space[Any], row: Array) -> Any:
    """A mask row as `space.sample(mask)` takes it, i8."""
    at = 0

    def take(space: spaces.Space[Any]) -> Any:
        nonlocal at
        if isinstance(space, spaces.Dict):
            parts = {name: take(space.spaces[name]) for name in sorted(space.spaces, key=str.encode)}
            return {name: parts[name] for name in space.spaces}
        if isinstance(space, spaces.Tuple):
            return tuple(take(child) for child in space.spaces)
        if isinstance(space, spaces.Discrete):
            begin, at = at, at + int(space.n)
            return row[begin:at].astype(np.int8)
        if isinstance(space, spaces.MultiDiscrete):
            each = []
            for n in space.nvec.ravel():
                begin, at = at, at + int(n)
                each.append(row[begin:at].astype(np.int8))
            return tuple(each)
        if isinstance(space, spaces.MultiBinary):
            begin, at = at, at + 2 * int(np.prod(space.shape))
            pairs = row[begin:at].reshape(*space.shape, 2)
            return np.where(pairs.all(-1), 2, pairs[..., 1]).astype(np.int8)
        return None

    return take(space)


gymnasium.register(REMOTE_ID, entry_point="consac.env:ConsacEnv", order_enforce=False)
