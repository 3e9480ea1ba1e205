"""What a server says no with."""
from __future__ import annotations

import importlib
import os
import traceback

import gymnasium

import consac
from consac import wire
from consac.names import printable_line

CONNECTION_ERRORS = {"BAD_MAGIC", "MALFORMED", "FRAME_TOO_LARGE", "CRC_MISMATCH", "UNSUPPORTED_VERSION", "AUTH_FAILED", "CAPACITY", "SHUTTING_DOWN"}


class Refused(Exception):
    """A request that is answered with ERROR; `extra` are further members of it."""

    def __init__(self, code: str, message: str, **extra):
        super().__init__(f"{code}: {message}")
        self.code, self.message, self.extra = code, message, extra


class Gone(Exception):
    """The peer closed, fell silent or does not read."""


def describe(error: BaseException) -> str:
    """An environment's error in one line, with the place in its code where it was raised."""
    return printable_line(f"{type(error).__name__}: {error}", 1000).replace("\\x0a", " ") + printable_line(place_of(error), 400)


def place_of(error: BaseException) -> str:
    """Where in an environment's code it was raised, at best in what is not installed; nothing where only ours or Python's is to blame."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_NOT_THEIRS)]
    own = [frame for frame in frames if "site-packages" not in frame.filename] or frames
    return f" ({os.path.basename(own[-1].filename)}, line {own[-1].lineno}, in {own[-1].name})" if own else ""


def tell(log, error: BaseException) -> None:
    """The whole traceback, to `log`, which takes lines."""
    for line in "".join(traceback.format_exception(error)).splitlines():
        log(line)


_NOT_THEIRS = (os.path.dirname(consac.__file__) + os.sep, gymnasium.envs.registration.__file__, importlib.__file__, "<frozen ")


def error_json(code: str, message: str, **extra) -> bytes:
    severity = "connection" if code in CONNECTION_ERRORS else "request"
    return wire.dump_json({"code": code, "severity": severity, "message": printable_line(message), **extra})
