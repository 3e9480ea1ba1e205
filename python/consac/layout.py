"""Spaces as SPEC writes them, where each leaf lies in a row of a batch, and what SPEC says of a behaviour."""
from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from gymnasium import spaces

from .names import quote
from .wire import DTYPES, NAMES, WireError, shown

# ---- spaces

def space_to_json(space: spaces.Space) -> dict:
    """A Gymnasium space as SPEC writes it; TypeError names a kind that has no form there."""
    if isinstance(space, spaces.Discrete):
        return {"type": "discrete", "n": int(space.n), "start": int(space.start), "dtype": _dtype_name(space)}
    if isinstance(space, spaces.Box):
        return {"type": "box", "shape": list(space.shape), "dtype": _dtype_name(space), "low": _bounds(space.low), "high": _bounds(space.high)}
    if isinstance(space, spaces.MultiDiscrete):
        out = {"type": "multi_discrete", "nvec": [int(n) for n in np.ravel(space.nvec)], "dtype": _dtype_name(space)}
        if np.any(space.start):
            raise TypeError(f"{space} starts at {space.start}; MultiDiscrete must start at 0, so wrap it")
        return out if space.nvec.ndim == 1 else out | {"shape": list(space.nvec.shape)}
    if isinstance(space, spaces.MultiBinary):
        out = {"type": "multi_binary", "n": int(np.prod(space.shape))}
        return out if len(space.shape) == 1 else out | {"shape": list(space.shape)}
    if isinstance(space, (spaces.Dict, spaces.Tuple)) and not space.spaces:
        raise TypeError(f"the space {space} is empty; put a Box, Discrete, MultiDiscrete or MultiBinary in it, or leave it out")
    if isinstance(space, spaces.Dict):
        return {"type": "dict", "spaces": [{"name": name, "space": space_to_json(space.spaces[name])} for name in sorted(space.spaces, key=str.encode)]}
    if isinstance(space, spaces.Tuple):
        return {"type": "tuple", "spaces": [{"name": str(i), "space": space_to_json(child)} for i, child in enumerate(space.spaces)]}
    raise TypeError(f"{space} cannot be sent; use Box, Discrete, MultiDiscrete, MultiBinary, Dict or Tuple of them")


def _dtype_name(space: spaces.Space) -> str:
    if np.dtype(space.dtype) not in NAMES:
        raise TypeError(f"{space} has numbers of {space.dtype}, which cannot be sent; use one of {', '.join(map(str, NAMES))}")
    return NAMES[np.dtype(space.dtype)]


def _bounds(bounds: np.ndarray):
    flat = np.ravel(bounds.astype(np.uint8) if bounds.dtype == np.bool_ else bounds)  # 0 and 1 are numbers, truths are not
    if flat.size > 1 and not np.isinf(flat[0]) and (flat == flat[0]).all():
        return flat[0].item()
    return [None if np.isinf(bound) else bound.item() for bound in flat]


def numbers_in(value: dict, one_hot: bool = False) -> int:
    """How many numbers a space's value has, before anything of that size is made; with `one_hot` each choice counts as many as it offers.

    `value`, here and in `bytes_in`, is what spec_check.check_space took."""
    kind = value["type"]
    if kind in ("dict", "tuple"):
        return sum(numbers_in(child["space"], one_hot) for child in value["spaces"])
    shape, choices = value.get("shape", []), [value["n"]] if kind in ("discrete", "multi_binary") else value["nvec"] if kind == "multi_discrete" else []
    if kind == "box":
        shape = value["shape"]
    numbers = choices[0] if kind == "multi_binary" else sum(choices) if one_hot else len(choices)
    return max(numbers, math.prod(shape) if shape or kind == "box" else 0)


def bytes_in(value: dict) -> int:
    """Bytes of a space's value in a row, without padding."""
    if value["type"] in ("dict", "tuple"):
        return sum(bytes_in(child["space"]) for child in value["spaces"])
    size = np.dtype(DTYPES[value["dtype"]]).itemsize if value["type"] == "box" else 1 if value["type"] == "multi_binary" else 4
    return size * numbers_in(value)


def space_from_json(value: dict) -> spaces.Space:
    """The reverse of space_to_json, of what spec_check.check_space took."""
    kind = value["type"]
    called = value.get("dtype")
    dtype = DTYPES.get(called, np.int64) if isinstance(called, str) else np.int64
    if kind == "discrete":
        return spaces.Discrete(value["n"], start=value.get("start", 0), dtype=dtype)
    if kind == "box":
        shape, dtype = tuple(value["shape"]), DTYPES[value["dtype"]]

        def side(bounds, unbounded):
            listed = bounds if isinstance(bounds, list) else [bounds] * int(np.prod(shape, dtype=np.int64))
            floats = np.dtype(dtype).kind == "f"  # beyond its ends counts as they
            least, most = (0, 1) if dtype is np.bool_ else (float(np.finfo(dtype).min), float(np.finfo(dtype).max)) if floats else (np.iinfo(dtype).min, np.iinfo(dtype).max)
            return np.array([unbounded if bound is None else min(max(bound if floats else int(bound), least), most) for bound in listed], dtype=dtype).reshape(shape)

        return spaces.Box(side(value["low"], -np.inf), side(value["high"], np.inf), shape, dtype)
    if kind == "multi_discrete":
        return spaces.MultiDiscrete(np.array(value["nvec"], dtype=np.int64).reshape(value.get("shape", [-1])), dtype=dtype)
    if kind == "multi_binary":
        return spaces.MultiBinary(value.get("shape", value["n"]))
    if kind == "dict":
        return spaces.Dict({child["name"]: space_from_json(child["space"]) for child in value["spaces"]})
    return spaces.Tuple([space_from_json(child["space"]) for child in value["spaces"]])


# ---- rows

@dataclass
class Leaf:
    """Where one leaf of a space lies in a row."""

    path: tuple  # keys and indices from the root
    space: spaces.Space
    dtype: np.dtype  # in the row
    shape: tuple  # of one value
    offset: int = 0


@dataclass
class Layout:
    """Where every leaf of a space lies in a row of bytes."""

    space: spaces.Space
    leaves: list[Leaf] = field(default_factory=list)
    row_bytes: int = 0
    mask_bytes: int = 0

    @classmethod
    def of(cls, space: spaces.Space) -> "Layout":
        layout = cls(space)
        layout._append(space, ())
        paths = sorted("/".join(map(str, leaf.path)) for leaf in layout.leaves)
        twice = next((path for path, other in zip(paths, paths[1:]) if path == other), None)
        if twice is not None:  # "a/b" beside "a" with a "b" below it
            raise ValueError(f"two leaves at {quote(twice)}; name them differently")
        alignment = max(leaf.dtype.itemsize for leaf in layout.leaves)
        layout.row_bytes = -(-layout.row_bytes // alignment) * alignment
        return layout

    def _append(self, space: spaces.Space, path: tuple) -> None:
        if isinstance(space, spaces.Dict):
            for name in sorted(space.spaces, key=str.encode):
                self._append(space.spaces[name], path + (name,))
            return
        if isinstance(space, spaces.Tuple):
            for index, child in enumerate(space.spaces):
                self._append(child, path + (index,))
            return
        if isinstance(space, spaces.Discrete):
            dtype, shape, masks = np.dtype(np.int32), (), int(space.n)
        elif isinstance(space, spaces.MultiDiscrete):
            dtype, shape, masks = np.dtype(np.int32), space.nvec.shape, int(space.nvec.sum())
        elif isinstance(space, spaces.MultiBinary):
            dtype, shape, masks = np.dtype(np.uint8), space.shape, 2 * int(np.prod(space.shape))
        else:
            dtype, shape, masks = np.dtype(space.dtype), space.shape, 0
        offset = -(-self.row_bytes // dtype.itemsize) * dtype.itemsize
        self.leaves.append(Leaf(path, space, dtype, shape, offset))
        self.row_bytes = offset + dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        self.mask_bytes += masks

    def to_json(self) -> dict:
        """The leaf table of SPEC."""
        return {"bytes": self.row_bytes,
                "leaves": [{"path": "/".join(map(str, leaf.path)), "dtype": NAMES[leaf.dtype], "count": int(np.prod(leaf.shape, dtype=np.int64)), "offset": leaf.offset}
                           for leaf in self.leaves]}

    def views(self, buffer, slots: int, offset: int) -> list[np.ndarray]:
        """For each leaf an array [slots, *shape] over `slots` rows that lie in `buffer` from `offset`: no copy."""
        if slots == 0:  # which may stand at the very end, with no byte left for a leaf to begin at
            return [np.empty((0, *leaf.shape), leaf.dtype) for leaf in self.leaves]
        return [np.ndarray((slots, *leaf.shape), leaf.dtype, buffer, offset + leaf.offset, (self.row_bytes, *_strides(leaf))) for leaf in self.leaves]

    def pick(self, value, leaf: Leaf):
        """The part of a space's value that belongs to `leaf`."""
        for key in leaf.path:
            value = value[key]
        return value

    def build(self, parts: list):
        """A value of the space from one part per leaf, in order; Dict, Tuple or the only part itself."""
        parts = iter(parts)

        def assemble(space):
            if isinstance(space, spaces.Dict):
                built = {name: assemble(space.spaces[name]) for name in sorted(space.spaces, key=str.encode)}
                return {name: built[name] for name in space.spaces}
            if isinstance(space, spaces.Tuple):
                return tuple(assemble(child) for child in space.spaces)
            return next(parts)

        return assemble(self.space)


def _strides(leaf: Leaf) -> tuple:
    strides, size = [], leaf.dtype.itemsize
    for length in reversed(leaf.shape):
        strides.insert(0, size)
        size *= length
    return tuple(strides)


def align(offset: int) -> int:
    """The next multiple of 8."""
    return -(-offset // 8) * 8


# ---- what SPEC says

@dataclass
class Behaviour:
    """One kind of agent of SPEC."""

    name: str
    agents: list[str]
    observation: Layout
    action: Layout
    slots: int
    masks_actions: bool = False

    @classmethod
    def from_json(cls, value: dict, environments: int) -> "Behaviour":
        """Of a behaviour of a SPEC that spec_check.check_spec took; WireError where its rows are not those of its spaces."""
        observation, action = Layout.of(space_from_json(value["observation"])), Layout.of(space_from_json(value["action"]))
        for layout, key in ((observation, "observation_row"), (action, "action_row")):
            if key not in value:
                raise WireError("MALFORMED", f"{key} is missing")
            if first_difference(layout.to_json(), value[key]) or not _says_whole_numbers(value[key]):
                raise WireError("MALFORMED", f"{key} is {shown(value[key], 200)}, expected {shown(layout.to_json(), 200)}")
        masked = value.get("masks_actions", False)
        if value.get("mask_bytes", action.mask_bytes * masked) != action.mask_bytes * masked:
            raise WireError("MALFORMED", f"mask_bytes is {value['mask_bytes']}, expected {action.mask_bytes * masked}")
        return cls(value["name"], value["agents"], observation, action, environments * len(value["agents"]), masked)

    def to_json(self) -> dict:
        return {"name": self.name, "agents": self.agents, "observation": space_to_json(self.observation.space), "action": space_to_json(self.action.space),
                "masks_actions": self.masks_actions, "observation_row": self.observation.to_json(), "action_row": self.action.to_json(),
                "mask_bytes": self.action.mask_bytes if self.masks_actions else 0}


def _says_whole_numbers(row: dict) -> bool:
    """Whether the numbers of a row that equal what they should are written as whole ones (R9): 8.0 is not."""
    return all(type(number) is int for number in (row["bytes"], *(leaf[name] for leaf in row["leaves"] for name in ("count", "offset"))))


def first_difference(expected, found, path: str = "") -> tuple[str, object, object] | None:
    """Path and both values where two JSON values first differ; members that only `found` has do not count."""
    if isinstance(expected, dict) and isinstance(found, dict):
        for key, value in expected.items():
            below = f"{path}/{key}" if path else key
            difference = first_difference(value, found[key], below) if key in found else (below, value, None)
            if difference:
                return difference
        return None
    if isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        for index, (value, other) in enumerate(zip(expected, found)):
            name = value.get("name", index) if isinstance(value, dict) and "space" in value else index
            difference = first_difference(value, other, f"{path}/{name}" if path else str(name))
            if difference:
                return difference
        return None
    return None if expected == found and isinstance(expected, bool) == isinstance(found, bool) else (path, expected, found)
