"""How a session with an engine begins, and how it is taken up again after a connection broke or a request was interrupted."""
from __future__ import annotations

import logging
import math
import socket
import struct
import threading
import time

from . import __version__, shared_memory, wire
from .address import is_here, open_socket, parse_url
from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProtocolError, said
from .frames import read_json
from .judge import Judge
from .line import HANDSHAKE_S, Line, set_timeouts
from .names import quote

WRITE_S = 10.0
REFUSED_S = 0.5  # so long a port that refuses is tried again: the engine has ended
SESSION_AT = 24  # in a header

_log = logging.getLogger("consac")


class Session(Line):
    """A Line whose other end knows who it is. client.py makes requests of it."""

    _stop: threading.Event  # of the thread that keeps it alive; there once the session has begun
    _out: bytearray  # the frame of a STEP
    spec: dict
    environments: int

    def __init__(self, url: str, timeout: float, resume_s: float, ways: list[str], capabilities: list[str], max_frame: int, token: str | None):
        super().__init__()
        self.closed = False
        self._why = ""  # it is closed
        self.url, self.timeout, self.resume_s = url, timeout, resume_s
        self._ways, self.autoreset = ways, ways[0]
        self.host, self.port = parse_url(url)
        self._hello = {"protocol": [wire.VERSION, wire.VERSION], "client": f"consac-python {__version__}", "capabilities": capabilities,
                       "max_frame": max_frame} | ({"token": token} if token is not None else {})
        self.request = 0  # of the latest that was answered
        self._under_way = False  # a request has begun; if it still has when the next one begins, it was interrupted
        self._configured = True  # unless the session was begun anew and an interrupt came before CONFIGURE
        self.resume: str | None = None
        self.capabilities: list[str] = []
        self._flags = 0  # of every frame
        self._judge: Judge | None = None

    def _ask(self, kind: int, payload: bytes, answer: int) -> memoryview:
        raise NotImplementedError

    def _exchange(self, frame: memoryview, request: int, answer: int) -> memoryview:
        raise NotImplementedError

    def _packed(self, kind: int, payload: bytes, request: int) -> memoryview:
        return memoryview(wire.pack(wire.Frame(kind, payload, request, self.session, self._flags)))

    def _adopt(self, spec: dict, shared: bool = False) -> None:
        raise NotImplementedError

    # ---- it begins

    def _greet(self, sock: socket.socket, end: float) -> dict:
        """HELLO and WELCOME on a new socket; with `self.resume` the session is taken up."""
        self._hold(sock, end)
        hello, before, agreed = self._hello | ({"resume": self.resume} if self.resume else {}), self.session, set(self.capabilities)
        try:
            sock.sendall(wire.pack(wire.Frame(wire.HELLO, wire.dump_json(hello))))
            welcome = read_json(self._await(0, 0, wire.WELCOME, end))
        except OSError as error:
            if isinstance(error, ConsacError):
                raise
            raise ConnectionLost(f"{self.url} closed the connection during the handshake ({said(error)})") from error
        try:
            version = wire.member(welcome, "protocol", int)
            number, self.resume = wire.member(welcome, "session", int), wire.member(welcome, "resume", str, "")
            if 0 < number < 1 << 32:
                self.session = number
            self.max_frame = min(max(wire.member(welcome, "max_frame", int, wire.LARGEST_FRAME), wire.LARGEST_BEFORE_WELCOME), self._hello["max_frame"])
            wire.member(welcome, "last_request", int, 0), wire.member(welcome, "server", str, "")  # of their types, though of no use here
            self.capabilities = wire.texts(welcome, "capabilities")
            unasked = set(self.capabilities) - set(self._hello["capabilities"])
            if unasked:
                raise ValueError(f"it agrees to {', '.join(map(quote, sorted(unasked)))}, which HELLO has not named (R21)")
            self.heartbeat_s = float(wire.member(welcome, "heartbeat_s", float, 10.0))
            resumed = wire.member(welcome, "resumed", bool, False)
            if resumed != ("resume" in hello) or resumed and number != before:
                raise ValueError(f"session {number}{', resumed' * resumed}, to a HELLO that resumes {f'session {before}' if 'resume' in hello else 'none'} (R24)")
            if resumed and set(self.capabilities) != agreed:
                raise ValueError(f"session {number} is taken up with {wire.shown(sorted(self.capabilities))}, it has {wire.shown(sorted(agreed))} (R28)")
            if not (0 < number < 1 << 32 and 0 < self.heartbeat_s < math.inf):
                raise ValueError(f"session is {number} and heartbeat_s is {self.heartbeat_s:g}, expected 1 to 2^32-1 and a number above 0")
        except wire.WireError as error:
            raise ProtocolError(error.code, f"WELCOME: {error.message}") from None
        except (ValueError, OverflowError) as error:
            raise ProtocolError("MALFORMED", f"WELCOME: {error}") from None
        if version != wire.VERSION:
            raise ProtocolError("UNSUPPORTED_VERSION", f"the engine chose protocol {version}, offered was {wire.VERSION}")
        self._flags = wire.FLAG_CRC if "crc" in self.capabilities else 0
        set_timeouts(sock, max(0.005, min(0.5, self.timeout / 4, self.heartbeat_s / 2)), WRITE_S)
        return welcome

    def _configure(self, wanted: dict) -> None:
        """CONFIGURE and SPEC, with the first way of autoreset that the engine knows."""
        for self.autoreset in self._ways:
            try:
                return self._configure_way(wanted | {"autoreset": self.autoreset})
            except EngineError as error:
                if error.fatal or error.code != "UNSUPPORTED" or self.autoreset == self._ways[-1]:
                    raise
                _log.debug("%s: %s", self.url, error)

    def _configure_way(self, wanted: dict) -> None:
        """Over TCP where memory cannot be shared."""
        if "shm" in self.capabilities and shared_memory.AVAILABLE and is_here(self._socket):
            try:
                self._adopt(read_json(self._ask(wire.CONFIGURE, wire.dump_json(wanted | {"transport": "shm"}), wire.SPEC)), shared=True)
                return
            except shared_memory.Unavailable as error:
                _log.debug("%s: %s; going on over TCP", self.url, error)
            except EngineError as error:
                if error.fatal or error.code != "UNSUPPORTED":
                    raise
                _log.debug("%s shares no memory (%s); going on over TCP", self.url, error)
        self._adopt(read_json(self._ask(wire.CONFIGURE, wire.dump_json(wanted | {"transport": "tcp"}), wire.SPEC)))

    # ---- it is taken up again

    def _take_up(self, error: Exception, request: int) -> None:
        """A new socket for the same session, in which `request` is under way, or ConnectionLost."""
        why = said(error)
        if not self.resume:
            self._fail(ConnectionLost(f"{self.url} went away ({why})"))
        welcome = self._connect_again(f"{self.url} was lost ({why})")
        if not welcome.get("resumed") or self._last_request(welcome) not in (request - 1, request):
            self._fail(ConnectionLost(f"{self.url} was lost ({why}); its session began anew and the episode is gone"))

    def _last_request(self, welcome: dict) -> int:
        last = welcome.get("last_request")
        if type(last) is not int or not 0 <= last < 1 << 63:
            self._fail(ProtocolError("MALFORMED", f"WELCOME: last_request is {wire.shown(last)}, expected a whole number from 0"))
        return last

    def _connect_again(self, why: str, anew: bool = False) -> dict:
        """WELCOME on a new socket, of the same session or, with `anew`, of another where the engine does not keep it; else ConnectionLost."""
        begun = time.monotonic()
        while True:
            try:
                left = max(0.05, min(HANDSHAKE_S, begun + self.resume_s - time.monotonic()))
                return self._greet(open_socket(self.host, self.port, left), time.monotonic() + left)
            except EngineBusy as busy:  # it is still at work on the request before, or has not seen yet that the connection is gone
                if time.monotonic() - begun > self.timeout:
                    self._fail(ConnectionLost(f"{why}, and the session cannot be taken up: {busy}"))
            except (EngineError, ProtocolError) as refusal:
                if not (anew and self.resume and isinstance(refusal, EngineError)):
                    self._fail(ConnectionLost(f"{why}, and the session cannot be taken up: {refusal}"))
                self.resume, self._configured = None, False
                continue
            except (ConnectionLost, DeadlineExceeded) as failure:
                elapsed = time.monotonic() - begun
                if elapsed > self.resume_s or (isinstance(failure.__cause__, ConnectionRefusedError) and elapsed > REFUSED_S):
                    self._fail(ConnectionLost(f"{why} and did not come back within {elapsed:.1f} s"))
            time.sleep(0.05)

    def _find_out(self) -> None:
        """An interrupted request may have been sent or not, and its answer read, or a part of it: the engine says, on a new connection, which
        was the last that it got. A session that it does not keep is begun anew, with the same spaces and before its first reset."""
        self._check_open()
        if self._judge is not None:
            self._judge.forget()
        welcome = self._connect_again("a request was interrupted", anew=True)
        self.request = self._last_request(welcome) if welcome.get("resumed") else 0
        if not (welcome.get("resumed") and self._configured):
            self._configure_anew(self.request + 1)

    def _configure_anew(self, request: int) -> None:
        self._configured = False
        wanted = {"autoreset": self.autoreset, "expect": self.spec["behaviours"], "transport": "tcp"}
        try:
            spec = read_json(self._exchange(self._packed(wire.CONFIGURE, wire.dump_json(wanted), request), request, wire.SPEC))
        except (EngineError, ProtocolError) as error:
            self._fail(ConnectionLost(f"{self.url} does not take the session up after an interrupt: {error}"))
        if any(spec.get(name) != self.spec.get(name) for name in ("environments", "behaviours", "parameters", "groups")):
            self._fail(ConnectionLost(f"{self.url} offers another world than before the interrupt; connect anew"))
        struct.pack_into("<I", self._out, SESSION_AT, self.session)
        self.request, self._configured = request, True

    # ---- it is over

    def _check_open(self) -> None:
        if self.closed:
            raise ConnectionLost(f"the connection to {self.url} is closed" + (f": {self._why}" if self._why else ""))

    def _fail(self, error: Exception):
        """The session is over."""
        self._why = str(error)
        self.closed = True
        if hasattr(self, "_stop"):
            self._stop.set()
        self._part()
        self._drop()
        raise error
