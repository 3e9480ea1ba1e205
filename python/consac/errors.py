"""What can go wrong between a trainer and its engine, one class each; all are ConsacError."""
from __future__ import annotations

from typing import Any

from .names import LONGEST_LINE, printable_line, quote
from .wire import WireError, member


def said(error: BaseException) -> str:
    """What an error says to people: a system's without its number, and never nothing."""
    return getattr(error, "strerror", None) or str(error) or "no reason given"


class ConsacError(Exception):
    """Anything that CONSAC raises on purpose. Says it in one line, whoever the words are from."""

    def __init__(self, message: object = "") -> None:
        super().__init__(printable_line(message, 4 * LONGEST_LINE))


class ConnectionLost(ConsacError, ConnectionError):
    """The engine is not there, or no longer, and its session cannot be taken up again."""


class DeadlineExceeded(ConsacError, TimeoutError):
    """The engine is there but did not answer in time; the connection is closed."""


class ProtocolError(ConsacError):
    """The peer sent bytes that its protocol does not allow; the connection is closed."""

    def __init__(self, code: str, message: str) -> None:
        message = printable_line(message)
        super().__init__(f"{code}: {message}")
        self.code, self.message = code, message


class EngineError(ConsacError):
    """An ERROR that the engine sent. `fatal` says that it closed the connection."""

    def __init__(self, code: str, message: str, env: int | None = None, path: str | None = None, retry_after_s: float | None = None, fatal: bool = False) -> None:
        code, message = printable_line(code, 80), printable_line(message)
        place = "".join([f" (environment {env})" if env is not None else "", f" (at {path})" if path else ""])
        super().__init__(f"{code}: {message}{place[:400]}")
        self.code, self.message, self.env, self.path, self.retry_after_s, self.fatal = code, message, env, path, retry_after_s, fatal

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> "EngineError":
        try:
            code, severity, message = (member(value, name, str) for name in ("code", "severity", "message"))
            env, path, later = member(value, "env", int, None), member(value, "path", str, None), member(value, "retry_after_s", float, None)
        except WireError as error:
            raise ProtocolError(error.code, f"ERROR: {error.message}") from None
        if severity not in ("connection", "request"):
            raise ProtocolError("MALFORMED", f"ERROR: severity is {quote(severity)}, expected connection or request")
        return KINDS.get(code, cls)(code, message, env, path, later, severity == "connection")


class Refused(EngineError):
    """The engine does not let this client in: its token or its version."""


class EngineBusy(Refused):
    """The engine serves no further session now; `retry_after_s` may say when."""


class SpecMismatch(EngineError):
    """The engine's spaces are not the expected ones; `path` names the first difference."""


KINDS = {"AUTH_FAILED": Refused, "UNSUPPORTED_VERSION": Refused, "CAPACITY": EngineBusy, "SHUTTING_DOWN": EngineBusy, "SPEC_MISMATCH": SpecMismatch}


class ProgramError(ConsacError):
    """The program `consac` is not there, or ended with a failure; `exit_code` is its own (docs/program.md), None where it did not run."""

    def __init__(self, message: str, exit_code: int | None = None) -> None:
        super().__init__(message)
        self.exit_code = exit_code
