"""What an engine says of itself in SPEC, checked before anything of its size is made."""
from __future__ import annotations

import math
from dataclasses import dataclass

from . import wire
from .errors import ProtocolError
from .names import check_names_apart, check_names_together, printable_line

MOST_BEHAVIOURS = 1024
MOST_NUMBERS = 1 << 24  # in the spaces of all behaviours together
_SLOT_BYTES = 9  # of a RESULT beside its row


@dataclass(frozen=True)
class Offer:
    """An engine's worlds. `spec` is all that it said."""

    spec: dict
    environments: int
    behaviours: list[wire.Behaviour]
    deterministic: bool
    max_episode_steps: int
    id: str


def read_spec(spec: dict, autoreset: str, limit: int) -> Offer:
    """The offer that a SPEC describes, asked for with `autoreset`; ProtocolError where it cannot be, `limit` bounds the bytes of all rows."""
    try:
        environments, values = wire.member(spec, "environments", int), wire.member(spec, "behaviours", list)
        if environments < 1 or not values:
            raise ValueError(f"{environments} environments and {len(values)} behaviours")
        _check_budget(environments, values, limit)
        begins = wire.member(spec, "autoreset", str, "same_step")
        if begins != autoreset:
            raise ValueError(f"autoreset {begins!r}, asked for was {autoreset!r}")
        check_names_together("behaviour", [value["name"] for value in values])
        for value in values:
            check_names_apart("agent", value["agents"])
        return Offer(spec, environments, [wire.Behaviour.from_json(value, environments) for value in values], wire.member(spec, "deterministic", bool, False),
                     wire.member(spec, "max_episode_steps", int, 0), printable_line(spec.get("id", ""), 255))
    except wire.WireError as error:
        raise ProtocolError(error.code, error.message) from None
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError, AssertionError) as error:  # Gymnasium asserts what it does not take
        raise ProtocolError("MALFORMED", f"SPEC cannot be used: {type(error).__name__}: {str(error)[:300]}") from None


def _check_budget(environments: int, behaviours: list, limit: int) -> None:
    """A small SPEC must not make large arrays, nor many small ones."""
    if len(behaviours) > MOST_BEHAVIOURS:
        raise ValueError(f"{len(behaviours)} behaviours, at most {MOST_BEHAVIOURS} are taken")
    numbers = actions = results = 0
    for value in behaviours:
        slots = environments * len(value["agents"])
        numbers += wire.numbers_in(value["observation"]) + wire.numbers_in(value["action"])
        actions += slots * wire.bytes_in(value["action"])
        results += slots * (wire.bytes_in(value["observation"]) + _SLOT_BYTES)
    if numbers > MOST_NUMBERS:
        raise ValueError(f"spaces of {numbers} numbers, at most {MOST_NUMBERS} are taken")
    if max(actions, results) > limit:
        raise ValueError(f"frames of {max(actions, results)} bytes for {environments} environments, max_frame is {limit}; raise it or take fewer environments")
