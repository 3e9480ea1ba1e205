"""Whether the members of a SPEC are of the kinds and values that its tables allow (R9 of spec/protocol2.md) and its names are names (spec/names.md), before
anything is made of them. Nobody else judges that: what comes after relies on it.

core/src/protocol/protocol2_spec.cpp and core/src/space/space_json.cpp judge the same; spec/conformance/names/specs.json holds both to it."""
from __future__ import annotations

import math
from typing import Any

from .names import check_names_apart, check_names_together, check_optional_name
from .wire import DTYPES, LARGEST_WHOLE, WireError, member, shown, texts

_FURTHEST_START = 1 << 30  # of a discrete space's values, exclusive
_OTHERS = (("id", str), ("model_name", str), ("hash", str), ("autoreset", str), ("deterministic", bool))


def check_spec(spec: dict[str, Any]) -> None:
    """WireError names the first member that is missing, of another kind than it should be, or of no value that it may have; ValueError a name that is none."""
    if member(spec, "environments", int) < 1:
        raise _wrong(spec, "environments", "a whole number from 1")
    for name, kind in _OTHERS:
        member(spec, name, kind, None)
    for name in ("max_episode_steps", "training_length"):
        if member(spec, name, int, 0) < 0:
            raise _wrong(spec, name, "a whole number from 0")
    if "shm" in spec:
        shared = _object(spec, "shm")
        member(shared, "path", str)
        for name in ("bytes", "request_offset", "request_bytes", "result_offset", "result_bytes", "spin_us"):
            member(shared, name, int)
    check_optional_name("environment", spec.get("id", "")), check_optional_name("model", spec.get("model_name", ""))
    if not member(spec, "behaviours", list):
        raise _wrong(spec, "behaviours", "at least one")
    for value in spec["behaviours"]:
        if not isinstance(value, dict):
            raise WireError("MALFORMED", f"a behaviour of SPEC is {shown(value)}, expected an object")
        member(value, "name", str), member(value, "agents", list), texts(value, "agents")
        member(value, "masks_actions", bool, False), member(value, "mask_bytes", int, 0)
        for name in ("observation", "action"):
            check_space(_object(value, name))
        check_names_apart("agent", value["agents"])
        for name in {"observation_row", "action_row"} & value.keys():  # where one is missing, budgets come first
            _object(value, name)
    check_names_together("behaviour", [value["name"] for value in spec["behaviours"]])


def _wrong(value: dict[str, Any], name: str, expected: str) -> WireError:
    return WireError("MALFORMED", f"{name} is {shown(value[name])}, expected {expected}" if name in value else f"{name} is missing")


def _object(value: dict[str, Any], name: str) -> dict[str, Any]:
    if not isinstance(value.get(name), dict):
        raise _wrong(value, name, "an object")
    found: dict[str, Any] = value[name]
    return found


def check_space(space: dict[str, Any]) -> None:
    """The same of a space as SPEC and model files write it; layout.space_from_json makes what passed."""
    kind = member(space, "type", str)
    if kind == "discrete":
        _counts(space, "n")
        if abs(member(space, "start", int, 0)) >= _FURTHEST_START:
            raise _wrong(space, "start", "less than 2^30 from 0")
    elif kind == "box":
        _check_box(space)
    elif kind == "multi_discrete":
        _check_shape(space, len(_counts(space, "nvec")))
    elif kind == "multi_binary":
        _check_shape(space, _counts(space, "n"))
    elif kind in ("dict", "tuple"):
        children = member(space, "spaces", list)
        if not children:
            raise _wrong(space, "spaces", "at least one child")
        for child in children:
            if not isinstance(child, dict):
                raise WireError("MALFORMED", f"spaces holds {shown(child)}, expected objects")
            member(child, "name", str)
            check_space(_object(child, "space"))
        _check_children(kind, [child["name"] for child in children])
    else:
        raise WireError("MALFORMED", f"a space of unknown type {shown(kind)}; use a newer consac")


def _check_children(kind: str, names: list[str]) -> None:
    if kind == "tuple":
        if names != [str(i) for i in range(len(names))]:
            raise WireError("MALFORMED", f"a tuple whose items are named {shown(names, 200)}; their names are \"0\", \"1\", ... in order")
        return
    check_names_apart("leaf", names)
    if names != sorted(names, key=str.encode):
        raise WireError("MALFORMED", f"a dict whose children are not sorted by name: {shown(names, 200)}")


def _counts(space: dict[str, Any], name: str) -> Any:
    """`n`, or the list `nvec`: whole numbers from 1."""
    found = member(space, name, int if name == "n" else list)
    if not found or not all(type(count) is int and count > 0 for count in (found if name == "nvec" else [found])):
        raise _wrong(space, name, "whole numbers from 1" if name == "nvec" else "a whole number from 1")
    return found


def _sizes(space: dict[str, Any]) -> list[int]:
    sizes: list[int] = member(space, "shape", list)
    if not all(type(size) is int and size > 0 for size in sizes):
        raise _wrong(space, "shape", "a list of whole numbers from 1")
    return sizes


def _check_shape(space: dict[str, Any], count: int) -> None:
    if "shape" in space and math.prod(_sizes(space)) != count:
        raise _wrong(space, "shape", f"sizes from 1 that make {count} elements")


def _check_box(box: dict[str, Any]) -> None:
    if member(box, "dtype", str) not in DTYPES:
        raise _wrong(box, "dtype", f"one of {', '.join(DTYPES)}")
    count = math.prod(_sizes(box))
    is_bound, what = (_is_number, "a number or null") if box["dtype"] in ("F32", "F64") else (_is_whole, "a whole number within 2^53 - 1")
    for name in ("low", "high"):
        bounds = box.get(name)
        listed = isinstance(bounds, list) and len(bounds) == count and all(map(is_bound, bounds))
        if name not in box or not (listed or is_bound(bounds)):
            raise _wrong(box, name, f"{what}, or a list of {count} such")


def _is_number(bound: Any) -> bool:
    return bound is None or type(bound) in (int, float)


def _is_whole(bound: Any) -> bool:
    return type(bound) in (int, float) and bool(abs(bound) <= LARGEST_WHOLE and bound == int(bound))
