"""What an engine says of itself in SPEC, checked before anything of its size is made."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Sequence

from . import wire
from .errors import ProtocolError
from .extras import Group, Parameter, read_groups, read_parameters
from .layout import Behaviour, bytes_in, numbers_in
from .spec_check import check_spec

MOST_BEHAVIOURS = 1024
MOST_SLOTS = 1 << 20  # of a behaviour
MOST_NUMBERS = 1 << 24  # elements or choices of a space
MOST_SPACE_BYTES = 256 << 20  # of the spaces of all behaviours together, charged before they are made
_ELEMENT_BYTES, _CHOICE_BYTES, _SPACE_BYTES = 16, 8, 1024
_SLOT_BYTES = 9  # of a RESULT beside its row
_NUMBER_BYTES = 8  # of an environment's parameter or group in a frame


@dataclass(frozen=True)
class Offer:
    """An engine's worlds. `spec` is all that it said."""

    spec: dict[str, Any]
    environments: int
    behaviours: list[Behaviour]
    deterministic: bool
    max_episode_steps: int
    id: str
    parameters: list[Parameter] = field(default_factory=list)  # where that was agreed
    groups: list[Group] = field(default_factory=list)


def read_spec(spec: dict[str, Any], autoreset: str, limit: int, agreed: Sequence[str] = ()) -> Offer:
    """The offer that a SPEC describes, asked for with `autoreset` and these capabilities; ProtocolError where it cannot be, `limit` bounds the bytes of all rows."""
    try:
        check_spec(spec)
        environments, values, begins = spec["environments"], spec["behaviours"], spec.get("autoreset", "same_step")
        results = _check_budget(environments, values, limit)
        if begins != autoreset:
            raise ValueError(f"autoreset is {wire.shown(begins)}, asked for was {autoreset}")
        parameters, groups = read_parameters(spec) if "parameters" in agreed else [], read_groups(spec) if "groups" in agreed else []
        numbers = _NUMBER_BYTES * environments * (len(parameters) + len(groups))
        if results + numbers > limit:
            raise ValueError(f"{numbers} bytes of parameters and groups of {environments} environments, max_frame is {limit}; raise it or take fewer environments")
        return Offer(spec, environments, [Behaviour.from_json(value, environments) for value in values], spec.get("deterministic", False),
                     spec.get("max_episode_steps", 0), spec.get("id", ""), parameters, groups)
    except wire.WireError as error:
        raise ProtocolError(error.code, error.message) from None
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError, AssertionError) as error:  # Gymnasium asserts what it does not take
        raise ProtocolError("MALFORMED", f"SPEC cannot be used: {str(error)[:300] or 'a space cannot be made'}") from None


def _check_budget(environments: int, behaviours: list[Any], limit: int) -> int:
    """A small SPEC must not make large arrays, nor many small ones. The bytes of all rows of a RESULT."""
    if len(behaviours) > MOST_BEHAVIOURS:
        raise ValueError(f"{len(behaviours)} behaviours, at most {MOST_BEHAVIOURS} are taken")
    spaces = actions = results = 0
    for value in behaviours:
        slots = environments * len(value["agents"])
        if not 1 <= slots <= MOST_SLOTS:
            raise ValueError(f"{environments} environments with {len(value['agents'])} agents make {slots} slots; at least 1 and at most {MOST_SLOTS} are taken")
        spaces += _space_bytes(value["observation"]) + _space_bytes(value["action"])
        actions += slots * bytes_in(value["action"])
        results += slots * (bytes_in(value["observation"]) + _SLOT_BYTES)
    if spaces > MOST_SPACE_BYTES:
        raise ValueError(f"spaces that take {spaces} bytes, at most {MOST_SPACE_BYTES} are taken")
    if max(actions, results) > limit:
        raise ValueError(f"frames of {max(actions, results)} bytes for {environments} environments, max_frame is {limit}; raise it or take fewer environments")
    return results


def _space_bytes(value: dict[str, Any]) -> int:
    """What a space is charged: its bounds and copies of them, or its choices."""
    if value["type"] in ("dict", "tuple"):
        return _SPACE_BYTES + sum(_space_bytes(child["space"]) for child in value["spaces"])
    numbers = numbers_in(value, one_hot=True)
    if numbers > MOST_NUMBERS:
        raise ValueError(f"a space of {numbers} numbers or choices, at most {MOST_NUMBERS} are taken")
    return _SPACE_BYTES + numbers * (_ELEMENT_BYTES if value["type"] == "box" else _CHOICE_BYTES)
