"""What environments say beside rewards, as the infos of a RESULT have it (R7 and R74 of spec/protocol2.md)."""
from __future__ import annotations

import math

import numpy as np

from consac import wire

_AROUND = 4  # objects and lists around a value: the outermost, `infos`, its member, `values`


class NotJson(Exception):
    """Says what a value is that JSON has no form for."""


def plain_info(info, whose: str, leave_out, beside: str | None = None) -> dict:
    """A copy of an info as JSON has it. Its member `beside` has another place; one without a form there is left out: `leave_out` is told its name and why.

    TypeError where `info` is no dict; raises what its members raise."""
    check_info(info, whose)
    out = {}
    for key, value in info.items():
        name = key if isinstance(key, str) else str(key)
        if name == beside:
            continue
        try:
            _check_text(name)
            out[name] = _Plain().of(value, _AROUND)
        except NotJson as why:
            leave_out(name, f"is {why}, which JSON of a message has not")
        except RecursionError:  # of an array that is its only element
            leave_out(name, "is nested too deep")
    return out


def check_info(info, whose: str) -> None:
    """Raises TypeError where what an environment gave beside an observation is no dict."""
    if not isinstance(info, dict):
        raise TypeError(f"{whose} is a {type(info).__name__}, expected a dict")


def _check_text(text: str) -> None:
    try:
        str.encode(text)
    except UnicodeEncodeError:
        raise NotJson("a text with half of a surrogate pair") from None


class _Plain:
    """One value, with the number of those within it bounded: lists that are in others many times grow beyond any memory."""

    def __init__(self):
        self._left = wire.MOST_JSON_VALUES

    def of(self, value, depth: int):
        """`value`, inside `depth` objects and lists, as JSON has it; NotJson."""
        self._left -= 1
        if self._left < 0:
            raise NotJson(f"over {wire.MOST_JSON_VALUES} values")
        if value is None or isinstance(value, bool):
            return value
        if isinstance(value, str):
            _check_text(value)
            return value
        if isinstance(value, int):
            try:
                int.__float__(value)
            except OverflowError:
                raise NotJson(f"a whole number of {int.bit_length(value)} bits") from None
            return value
        if isinstance(value, (float, np.floating)):
            return float(value) if math.isfinite(value) else None
        if isinstance(value, (np.generic, np.ndarray)) and not isinstance(value, np.complexfloating):  # the longest of which is no number of Python's
            return self.of(value.tolist(), depth)
        if isinstance(value, (list, tuple, dict)):
            if depth == wire.DEEPEST_JSON:
                raise NotJson(f"nested over {wire.DEEPEST_JSON - _AROUND} deep")
            if not isinstance(value, dict):
                return [self.of(item, depth + 1) for item in value]
            out = {}
            for key, item in value.items():
                name = key if isinstance(key, str) else str(key)
                _check_text(name)
                out[name] = self.of(item, depth + 1)
            return out
        raise NotJson(f"a {type(value).__name__}")
