"""What protocol 2 has beside steps: parameters of the environments, statistics of the game's own, groups of agents (spec/protocol2.md, sections 14 to 16)."""
from __future__ import annotations

import difflib
import math
import struct
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from . import wire
from .errors import ConsacError, ProtocolError
from .names import check_name, check_names_apart, quote

MOST_PARAMETERS = 1024
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True)
class Parameter:
    """A number of a world that its trainer sets."""

    name: str
    default: float
    low: float = -math.inf
    high: float = math.inf
    description: str = ""

    def check(self, value: float) -> None:
        """ValueError where it cannot be that."""
        if not self.low <= value <= self.high or math.isinf(value):  # NaN is within nothing
            raise ValueError(f"parameter {self.name!r} cannot be {value}; it is {self.low:g} to {self.high:g}")

    def to_json(self) -> dict[str, Any]:
        return {"name": self.name, "default": self.default, "low": _bound(self.low), "high": _bound(self.high), "description": self.description}


@dataclass(frozen=True)
class Group:
    """Agents that are rewarded together: (behaviour, agent) each."""

    name: str
    agents: list[tuple[str, str]]


def _bound(value: float) -> float | None:
    return value if math.isfinite(value) else None


def check_parameters(parameters: Sequence[Parameter]) -> None:
    """ValueError where a default lies outside its bounds, or names are none or alike."""
    for one in parameters:
        if not (one.low <= one.default <= one.high and math.isfinite(one.default)):
            raise ValueError(f"parameter {one.name!r} is {one.default} unless it is set, which is not within its {one.low:g} to {one.high:g}")
    check_names_apart("parameter", [one.name for one in parameters])


def read_parameters(spec: dict[str, Any]) -> list[Parameter]:
    """SPEC's, where they were agreed; WireError or ValueError where they are wrong (R100)."""
    parameters: list[Parameter] = []
    for value in _objects(spec, "parameters"):
        if len(parameters) == MOST_PARAMETERS:
            raise ValueError(f"more than {MOST_PARAMETERS} parameters; no more are taken")
        low, high = (none if value.get(name) is None else float(wire.member(value, name, float)) for name, none in (("low", -math.inf), ("high", math.inf)))
        parameters.append(Parameter(wire.member(value, "name", str), float(wire.member(value, "default", float)), low, high, wire.member(value, "description", str, "")))
    check_parameters(parameters)
    return parameters


def read_groups(spec: dict[str, Any]) -> list[Group]:
    """SPEC's, where they were agreed; WireError or ValueError where they are wrong (R106)."""
    known = {(behaviour["name"], agent) for behaviour in spec["behaviours"] for agent in behaviour["agents"]}
    groups: list[Group] = []
    taken: set[tuple[str, str]] = set()
    for value in _objects(spec, "groups"):
        members = [(wire.member(one, "behaviour", str), wire.member(one, "agent", str)) for one in _objects(value, "agents")]
        for one in members:
            if one not in known or one in taken:
                raise ValueError(f"agent {one[1]!r} of {one[0]!r}, of a group, {'is in one already' if one in known else 'is none'}")
            taken.add(one)
        groups.append(Group(wire.member(value, "name", str), members))
    check_names_apart("group", [group.name for group in groups])
    return groups


def _objects(value: dict[str, Any], name: str) -> list[dict[str, Any]]:
    found: list[Any] = wire.member(value, name, list)
    if not found or not all(isinstance(one, dict) for one in found):
        raise ValueError(f"{name} is {wire.shown(found)}, expected a list of one object or more")
    return found


class Setting:
    """Values that go with the next RESET or STEP: [environments, parameters] f64, NaN where nothing is set."""

    def __init__(self, parameters: list[Parameter], environments: int):
        self.parameters = parameters
        self._places = {one.name: place for place, one in enumerate(parameters)}
        self.values = np.full((environments, len(parameters)), np.nan)
        self.due = False

    def set(self, values: dict[str, Any]) -> None:
        """{name: number, or one for each environment (NaN: leave it)}; ConsacError where there is no such parameter, or it cannot be that."""
        if not values:
            return  # an engine that has no parameters is sent none
        new = self.values.copy()
        for name, value in values.items():
            if name not in self._places:
                near = difflib.get_close_matches(str(name), self._places, 1) or list(self._places)[:1]
                raise ConsacError(f"there is no parameter {name!r}" + (f"; there is {near[0]!r}" if near else ": the engine has none, or speaks an older protocol"))
            place, array = self._places[name], np.asarray(value, np.float64)
            if array.shape not in ((), (len(new),)):
                raise ConsacError(f"parameter {name!r} of shape {array.shape}; it is a number, or one for each of {len(new)} environments")
            try:
                for one in np.atleast_1d(array)[~np.isnan(np.atleast_1d(array))]:
                    self.parameters[place].check(float(one))
            except ValueError as error:
                raise ConsacError(str(error)) from None
            new[:, place] = np.where(np.isnan(array), new[:, place], array)
        self.values, self.due = new, True

    def take(self) -> bytes:
        """The block; once its request was answered `arrived` is called."""
        return self.values.astype("<f8").tobytes()

    def arrived(self) -> None:
        self.values[:] = np.nan
        self.due = False


def read_statistics(text: memoryview) -> dict[str, list[float]]:
    """A RESULT's; ProtocolError where they are wrong (R105)."""
    try:
        said = wire.load_json(text)
        for name, values in said.items():
            check_name("statistic", name)
            if not isinstance(values, list) or not values or not all(type(value) in (int, float) for value in values):
                raise ValueError(f"{wire.shown(values)} for {quote(name)}, expected a list of numbers")
    except (wire.WireError, ValueError) as error:
        raise ProtocolError("MALFORMED", f"a RESULT breaks protocol 2: its statistics: {str(error)[:300]} (R105)") from None
    return {name: [float(value) for value in values] for name, values in said.items()}
