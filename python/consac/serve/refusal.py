"""What a server says no with."""
from __future__ import annotations

from consac import wire

CONNECTION_ERRORS = {"BAD_MAGIC", "MALFORMED", "FRAME_TOO_LARGE", "CRC_MISMATCH", "UNSUPPORTED_VERSION", "AUTH_FAILED", "CAPACITY", "SHUTTING_DOWN"}


class Refused(Exception):
    """A request that is answered with ERROR; `extra` are further members of it."""

    def __init__(self, code: str, message: str, **extra):
        super().__init__(f"{code}: {message}")
        self.code, self.message, self.extra = code, message, extra


class Gone(Exception):
    """The peer closed, fell silent or does not read."""


def error_json(code: str, message: str, **extra) -> bytes:
    severity = "connection" if code in CONNECTION_ERRORS else "request"
    return wire.dump_json({"code": code, "severity": severity, "message": message[:2000], **extra})
