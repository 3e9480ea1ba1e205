"""What a server says no with."""
from __future__ import annotations

import importlib
import os
import threading
import time
import traceback

import gymnasium

import consac
from consac import wire
from consac.errors import said
from consac.names import printable_line

CONNECTION_ERRORS = {"BAD_MAGIC", "MALFORMED", "FRAME_TOO_LARGE", "CRC_MISMATCH", "UNSUPPORTED_VERSION", "AUTH_FAILED", "CAPACITY", "SHUTTING_DOWN"}

# What an environment may raise in the thread of a session, where no Ctrl-C of a person's arrives: anything, and sys.exit() or a KeyboardInterrupt of its own
# ends the environment alone, not the thread that serves it without a word.
FAILURES = BaseException
INTERRUPTIBLE = (Exception, SystemExit)  # the same where it may be the main thread


class Refused(Exception):
    """A request that is answered with ERROR; `extra` are further members of it."""

    def __init__(self, code: str, message: str, **extra):
        super().__init__(f"{code}: {message}")
        self.code, self.message, self.extra = code, message, extra


class Gone(Exception):
    """The peer closed, fell silent or does not read."""


class Refusals:
    """Lines about connections that are not served, or environments that fail: the first few in full, then one every few seconds, so that a flood of them fills no disk."""

    IN_FULL, EVERY_S = 5, 5.0

    def __init__(self, log):
        self._log, self._lock = log, threading.Lock()
        self._in_full = self._counted = 0
        self._latest, self._tell_at = "", 0.0

    def say(self, line: str, before: tuple[str, ...] = ()) -> None:
        """Logs `line`, with the lines `before` it, or counts it where there have been many."""
        self.look()
        with self._lock:
            if self._in_full == self.IN_FULL:
                self._latest, self._counted = line, self._counted + 1
                return
            self._in_full, self._tell_at = self._in_full + 1, time.monotonic() + self.EVERY_S
        for one in (*before, line):
            self._log(one)

    def tell(self, error: BaseException) -> None:
        """The whole traceback of what an environment raised."""
        lines = traceback_of(error)
        self.say(lines[-1], tuple(lines[:-1]))

    def look(self, last: bool = False) -> None:
        """Tells of those that were counted, once it is time or this is the `last` call; to be called now and then."""
        with self._lock:
            if not last and (self._in_full == 0 or time.monotonic() < self._tell_at):
                return
            counted, self._counted = self._counted, 0
            self._in_full = self._in_full if counted else 0
            self._tell_at = time.monotonic() + self.EVERY_S
        if counted:
            self._log(self._latest + (f" (and {counted - 1} more like it)" if counted > 1 else ""))


def describe(error: BaseException) -> str:
    """An error in one line; of an environment's, its class and the place in its code where it was raised."""
    place = place_of(error)
    try:
        text = f"{type(error).__name__}: {error}" if place else said(error)
    except Exception:  # of their own
        text = f"{type(error).__name__}, which cannot be shown"
    return printable_line(text, 1000).replace("\\x0a", " ") + printable_line(place, 400)


def place_of(error: BaseException) -> str:
    """Where in an environment's code it was raised, at best in what is not installed; nothing where only ours or Python's is to blame."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(_NOT_THEIRS) and not _of_python(frame.filename)]
    own = [frame for frame in frames if "site-packages" not in frame.filename] or frames
    return f" ({os.path.basename(own[-1].filename)}, line {own[-1].lineno}, in {own[-1].name})" if own else ""


def _of_python(file: str) -> bool:
    return file.startswith(os.path.dirname(os.__file__) + os.sep) and "-packages" not in file


def traceback_of(error: BaseException) -> list[str]:
    """The lines of the whole traceback."""
    return "".join(traceback.format_exception(error)).splitlines()


_NOT_THEIRS = (os.path.dirname(consac.__file__) + os.sep, gymnasium.envs.registration.__file__, importlib.__file__, "<frozen ")


def error_json(code: str, message: str, **extra) -> bytes:
    severity = "connection" if code in CONNECTION_ERRORS else "request"
    message = printable_line(message)
    extra = {name: value[:300] if name == "path" else value for name, value in extra.items()}  # for people, and no longer than R17 allows
    while len(said := wire.dump_json({"code": code, "severity": severity, "message": message, **extra})) > wire.LARGEST_BEFORE_WELCOME and message:
        message = message[:-max(1, (len(said) - wire.LARGEST_BEFORE_WELCOME) // 12)]  # R17; a character has 12 bytes of JSON at most
    return said
