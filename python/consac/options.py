"""What every way of opening an engine takes, checked before anything is opened."""
from __future__ import annotations

import difflib
import os
from typing import Any, TypedDict

from . import wire

TOKEN = "CONSAC_TOKEN"  # the environment's variable: other users see command lines
LONGEST_S = 1e9


class Options(TypedDict, total=False):
    """Keyword arguments of consac.make and all the others."""

    token: str | None  # that the engine asks for; without one CONSAC_TOKEN
    timeout: float  # seconds for an answer
    wait: float  # seconds in which a port that refuses is tried again
    resume_s: float  # seconds in which a lost connection is taken up
    shared_memory: bool  # where both ends can
    crc: bool  # checks every frame; slow
    max_frame: int  # bytes
    expect: list[Any] | None  # behaviours as in SPEC: the engine refuses others


_KNOWN = frozenset({*Options.__annotations__, "protocol"})
_PROTOCOLS = ("auto", "text1", 2)


def check(options: dict[str, Any]) -> None:
    """TypeError and ValueError name what is unknown or out of range. Called once, by client.open_engine."""
    for name in options:
        if name not in _KNOWN:
            near = difflib.get_close_matches(name, _KNOWN, 1)
            raise TypeError(f"unknown argument {name!r}" + (f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(sorted(_KNOWN))}"))
    if options.get("protocol", 2) not in _PROTOCOLS:
        raise ValueError(f'protocol={options["protocol"]!r}; it is "auto", "text1" or 2')
    for name, least in (("timeout", 1e-3), ("wait", 0.0), ("resume_s", 0.0)):
        value = options.get(name, least)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= LONGEST_S:
            raise ValueError(f"{name}={value!r}; it is a number of seconds from {least:g} to {LONGEST_S:g}")
    most = options.get("max_frame", wire.LARGEST_FRAME)
    if type(most) is not int or not wire.LARGEST_BEFORE_WELCOME <= most <= wire.LARGEST_FRAME:
        raise ValueError(f"max_frame={most!r}; it is a number of bytes from {wire.LARGEST_BEFORE_WELCOME} to {wire.LARGEST_FRAME}")
    token = options.get("token")
    if token is not None and not isinstance(token, str):
        raise TypeError(f"token is a text, not a {type(token).__name__}")


def token_of(token: str | None) -> str | None:
    """The token to be shown to an engine: the given one, else that of CONSAC_TOKEN."""
    return token if token is not None else os.environ.get(TOKEN) or None
