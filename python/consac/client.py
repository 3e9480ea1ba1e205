"""The trainer's end of protocol 2: one Connection is one session. What its rows mean to Gymnasium is in env.py, vector.py, ..."""
from __future__ import annotations

import logging
import math
import os
import select
import socket
import struct
import sys
import threading
import time
import weakref

import numpy as np

from . import __version__, shared_memory, wire
from .address import is_here, open_socket, parse_url
from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProtocolError
from .frames import ResultFrame, Rows, StepFrame, read_json, reset_payload

HANDSHAKE_S = 5.0
TEXT_SETUP_S = 0.1  # so long a text setup is waited for before HELLO
WRITE_S = 10.0
MISSED_PINGS = 3
IDLE_TICK_S = 2.0  # how often PINGs are answered while no request is under way
REFUSED_S = 0.5  # so long a port that refuses is tried again: the engine has ended

# A sleeping thread takes some 40 us to wake, more than an engine's step: a short spin first makes a step three times as fast.
_DONT_WAIT = getattr(socket, "MSG_DONTWAIT", 0)
_NO_SPIN = range(0)
_SPIN = range(40 if _DONT_WAIT and (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1) > 1 else 0)

_REQUEST = struct.Struct("<Q")
_HEAD = struct.Struct("<IHHIIQIII")  # a header and the first word of its payload
_WORDS = struct.Struct("<II")


def connect(url: str, protocol="auto", *, wait: float = 0.0, **options):
    """A Connection, or a TextConnection where the engine speaks text protocol 1. `protocol`: "auto", 2 or "text1"."""
    from .text1 import TextConnection

    if protocol not in ("auto", "text1", 2):
        raise ValueError(f'protocol={protocol!r}; it is "auto", "text1" or 2')
    text_options = {key: options[key] for key in ("timeout",) if key in options}  # the others mean nothing to it
    if protocol == "text1":
        return TextConnection(url, wait=wait, **text_options)
    sock = open_socket(*parse_url(url), HANDSHAKE_S, wait)
    if protocol == "auto" and select.select([sock], [], [], TEXT_SETUP_S)[0]:
        first = sock.recv(1, socket.MSG_PEEK)
        if first and first[0] != wire.MAGIC & 0xFF:
            return TextConnection(url, sock=sock, **text_options)
    try:
        return Connection(url, sock=sock, **options)
    except ProtocolError as error:
        if protocol == "auto" and error.code == "BAD_MAGIC":
            return TextConnection(url, **text_options)
        raise


class Connection:
    """A session with an engine. Not for several threads at once; a thread of its own answers PINGs between requests.

    `step()` sends what lies in `step_mask` and `actions`; `reset()` takes masks and seeds. Both leave their answer in `rows`,
    `infos` and `final_infos`. A connection that breaks is taken up again, and the request under way is carried out once.
    Of several ways of `autoreset` the first counts that the engine knows.
    With `shared_memory` an engine on this host is stepped through memory where it offers that; `in_memory` says whether it is."""

    def __init__(self, url: str, *, token: str | None = None, timeout: float = 60.0, autoreset: str | tuple[str, ...] = "same_step", expect: list | None = None,
                 wait: float = 0.0, resume_s: float = 10.0, crc: bool = False, max_frame: int = wire.LARGEST_FRAME,
                 shared_memory: bool = True, sock: socket.socket | None = None):
        self.url, self.timeout, self.resume_s = url, timeout, resume_s
        self._ways = [autoreset] if isinstance(autoreset, str) else list(autoreset)
        self.autoreset = self._ways[0]
        self.host, self.port = parse_url(url)
        self._hello = {"protocol": [wire.VERSION, wire.VERSION], "client": f"consac-python {__version__}", "capabilities": ["render"] + ["crc"] * crc + ["shm"] * (shared_memory and not crc),
                       "max_frame": max_frame} | ({"token": token} if token is not None else {})
        self.closed = self.paused = False
        self.goaway: str | None = None  # why the engine takes no further requests
        self.request = self.session = 0
        self.max_frame, self.heartbeat_s, self.resume = wire.LARGEST_BEFORE_WELCOME, 10.0, None
        self.capabilities: list[str] = []
        self.parts, self.infos, self.final_infos = 0, None, None
        self.rows: list[Rows] = []
        self._flags = 0
        self._left = b""  # bytes that came after the last answer
        self._channel: shared_memory.Channel | None = None  # while frames go through shared memory
        self._lock = threading.Lock()
        self._heard = self._pinged = time.monotonic()
        self._missed = self._slow = self._skip = 0
        self._broken: Exception | None = None  # the socket is lost; the next request takes the session up
        self._reserve(wire.LARGEST_JSON)
        self._in_place = True
        self._socket = None
        self._process = os.getpid()  # a fork of it does not say BYE
        try:
            self._greet(sock or open_socket(self.host, self.port, HANDSHAKE_S, wait), time.monotonic() + HANDSHAKE_S)
            self._configure({"expect": expect} if expect is not None else {})
        except BaseException:
            self._drop()
            raise
        self._stop = threading.Event()
        threading.Thread(target=_keep_alive, args=(weakref.ref(self), self._stop), name="consac-keepalive", daemon=True).start()

    # ---- handshake

    def _greet(self, sock: socket.socket, end: float) -> dict:
        """HELLO and WELCOME on a new socket; with `self.resume` the session is taken up."""
        self._drop()
        self._socket, self._left, self.paused, self._missed = sock, b"", False, 0
        self._broken, self.goaway = None, None
        sock.setblocking(True)
        _set_timeouts(sock, min(0.1, max(0.005, end - time.monotonic())), WRITE_S)
        self._send, self._recv_into = sock.send, sock.recv_into
        hello = self._hello | ({"resume": self.resume} if self.resume else {})
        try:
            sock.sendall(wire.pack(wire.Frame(wire.HELLO, wire.dump_json(hello))))
            have, self._heard = 0, time.monotonic()
            welcome = read_json(self._await(have, 0, wire.WELCOME, end))
        except OSError as error:
            if isinstance(error, ConsacError):
                raise
            raise ConnectionLost(f"{self.url} closed the connection during the handshake ({error})") from error
        try:
            self.session, self.resume = int(welcome["session"]), str(welcome["resume"])
            self.max_frame = min(int(welcome["max_frame"]), self._hello["max_frame"])
            self.capabilities = [str(name) for name in welcome.get("capabilities", [])]
            self.heartbeat_s = float(welcome.get("heartbeat_s", 10.0))
        except (KeyError, TypeError, ValueError) as error:
            raise ProtocolError("MALFORMED", f"WELCOME lacks {error}: {welcome}") from None
        if welcome.get("protocol") != wire.VERSION:
            raise ProtocolError("UNSUPPORTED_VERSION", f"the engine chose protocol {welcome.get('protocol')}, offered was {wire.VERSION}")
        self._flags = wire.FLAG_CRC if "crc" in self.capabilities else 0
        _set_timeouts(sock, max(0.005, min(0.5, self.timeout / 4, self.heartbeat_s / 2)), WRITE_S)
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

    def _adopt(self, spec: dict, shared: bool = False) -> None:
        """Buffers and views for the engine's spaces; `shared_memory.Unavailable` where `shared` cannot be."""
        try:
            self.spec = spec
            self.environments = int(spec["environments"])
            for value in spec["behaviours"]:
                self._check_size(value["observation"])
                self._check_size(value["action"])
            self.behaviours = [wire.Behaviour.from_json(value, self.environments) for value in spec["behaviours"]]
            self.deterministic = bool(spec.get("deterministic", False))
            self.max_episode_steps = int(spec.get("max_episode_steps") or 0)
            self.id = str(spec.get("id", ""))
            if self.environments < 1 or not self.behaviours:
                raise ValueError(f"{self.environments} environments and {len(self.behaviours)} behaviours")
            if spec.get("autoreset", self.autoreset) != self.autoreset:
                raise ValueError(f"autoreset {spec['autoreset']!r}, asked for was {self.autoreset!r}")
        except wire.WireError as error:
            raise ProtocolError(error.code, error.message) from None
        except (KeyError, TypeError, ValueError) as error:
            raise ProtocolError("MALFORMED", f"SPEC cannot be used: {type(error).__name__}: {error}") from None

        step, result = StepFrame(self.behaviours, self.environments), ResultFrame(self.behaviours)
        largest = max(step.size, result.largest) - wire.HEADER.size
        if largest > self.max_frame:
            raise ConsacError(f"{self.environments} environments make frames of {largest} bytes, max_frame is {self.max_frame}; raise it or take fewer environments")
        step.begin(self._flags, self.session)
        self._out, self.step_mask, self.actions, self.action_offsets = step.bytes, step.mask, step.actions, step.action_offsets
        self._out_view = memoryview(self._out)
        self._reserve(result.largest + wire.LARGEST_JSON + 16)
        if shared:
            self._channel = shared_memory.open_channel(spec.get("shm"), step.size, result.plain_size)
            self._in = np.frombuffer(self._channel.incoming, np.uint8)
        self._in_place = not shared
        self._result, self._plain_end, self._plain_size = result, result.plain_end, result.plain_size
        self.rows = result.lay_over(self._in)

    def _check_size(self, space: dict) -> None:
        """A small SPEC must not make large arrays."""
        for child in space.get("spaces", ()):
            self._check_size(child["space"])
        if math.prod(map(int, space.get("shape", ()))) > self.max_frame:
            raise ValueError(f"a space of shape {space['shape']}, more than max_frame {self.max_frame}")

    def _reserve(self, size: int) -> None:
        """A buffer for what comes over TCP. `rows` lie over `_in`, which is the same where no memory is shared."""
        self._in = np.empty(size + wire.HEADER.size, np.uint8)  # pages that are never written cost nothing
        self._in_view = memoryview(self._in)

    @property
    def in_memory(self) -> bool:
        """Whether RESET, STEP and RESULT go through shared memory now."""
        return self._channel is not None

    # ---- requests

    def step(self) -> None:
        """Steps the environments of `step_mask` with `actions`; the answer lies in `rows`."""
        with self._lock:
            self.request = request = self.request + 1
            _REQUEST.pack_into(self._out, 16, request)
            if self._broken is not None or self._left or self._flags or self.goaway is not None:
                if self._flags:
                    struct.pack_into("<I", self._out, 12, wire.crc32c(self._out_view[wire.HEADER.size:]))
                payload = self._exchange(self._out_view, wire.RESULT)
            elif self._channel is not None:
                payload = self._step_in_memory(self._channel, request)
            elif self._in_place:
                payload = self._step_over_tcp(request)
            else:
                payload = self._exchange(self._out_view, wire.RESULT)
            if payload is not None:
                self._parse(payload)
            elif self.parts:
                self.parts, self.infos, self.final_infos = 0, None, None

    def _step_in_memory(self, channel: shared_memory.Channel, request: int) -> memoryview | None:
        """None where the answer is a plain one, which lies in its place; else its payload."""
        try:
            channel.send(self._out)
            if channel.wait(shared_memory.LOOK_S):
                magic, kind, flags, length, _, answers, _, _, parts = _HEAD.unpack_from(self._in)
                if answers == request and kind == wire.RESULT and flags == 0 and magic == wire.MAGIC and parts == 0 \
                        and self._plain_end <= length + wire.HEADER.size <= self._plain_size:
                    channel.saw()
                    self._heard = time.monotonic()
                    return None
        except BaseException:
            self._broken = ConnectionLost("interrupted")
            raise
        return self._finish(self._out_view, wire.RESULT, 0, channel)

    def _step_over_tcp(self, request: int) -> memoryview | None:
        """As `_step_in_memory`: one system call each way where nothing unusual comes."""
        have = -1
        try:
            if self._send(self._out) == len(self._out):
                have, receive, view = 0, self._recv_into, self._in_view
                for _ in _NO_SPIN if self._skip else _SPIN:
                    try:
                        have = receive(view, 0, _DONT_WAIT)
                        self._slow = 0
                        break
                    except BlockingIOError:
                        pass
                else:
                    self._rest()
                    have = receive(view)
                magic, kind, flags, length, _, answers, _, _, parts = _HEAD.unpack_from(self._in)
                if have == length + 32 and answers == request and kind == 7 and flags == 0 and magic == wire.MAGIC and parts == 0 \
                        and self._plain_end <= have <= self._plain_size:
                    return None
                if not have:
                    self._broken = ConnectionLost("the engine closed the connection")
            else:
                self._broken = ConnectionLost("a write was cut short")
        except BlockingIOError:
            if have < 0:
                self._broken = ConnectionLost(f"the engine took no bytes for {WRITE_S:g} s")
        except OSError as error:
            self._broken = error
        except BaseException:
            self._broken = ConnectionLost("interrupted")
            raise
        return self._finish(self._out_view, wire.RESULT, max(0, have))

    def _rest(self) -> None:
        """Spinning was of no use: an engine that is slow again and again is waited for asleep, up to 64 steps in a row."""
        if self._skip:
            self._skip -= 1
        else:
            self._slow = min(64, 2 * self._slow + 1)
            self._skip = self._slow

    def reset(self, mask=None, seeds=None, options: dict | None = None) -> None:
        """Begins new episodes where `mask` [environments] is true (everywhere without it); `seeds` are one i64 per environment."""
        payload = reset_payload(self.environments, mask, seeds, options)
        with self._lock:
            self._parse(self._ask(wire.RESET, payload, wire.RESULT))

    def render(self, env: int = 0) -> np.ndarray:
        """The picture [height, width, 3] u8 of one environment; needs capability `render`."""
        if "render" not in self.capabilities:
            raise ConsacError(f"{self.url} cannot draw: it does not offer the capability `render`")
        with self._lock:
            payload = self._ask(wire.RENDER, wire.dump_json({"env": env}), wire.FRAME)
            if len(payload) < 8 or len(payload) != 8 + 3 * int(np.prod(_WORDS.unpack_from(payload), dtype=np.int64)):
                self._fail(ProtocolError("MALFORMED", f"a FRAME of {len(payload)} bytes"))
            height, width = _WORDS.unpack_from(payload)
            return np.frombuffer(payload, np.uint8, offset=8).reshape(height, width, 3).copy()

    def close(self) -> None:
        """BYE; the engine forgets the session. May be called again."""
        if self.closed:
            return
        self.closed = True
        if hasattr(self, "_stop"):
            self._stop.set()
        try:
            if self._socket is not None and self._broken is None and self._process == os.getpid():
                self._socket.send(wire.pack(wire.Frame(wire.BYE, session=self.session)))
        except OSError:
            pass
        self._drop()

    def __del__(self) -> None:
        if hasattr(self, "_process"):
            self.close()

    def __enter__(self) -> "Connection":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    # ---- one request and its answer

    def _ask(self, kind: int, payload: bytes, answer: int) -> memoryview:
        self.request += 1
        if len(payload) > self.max_frame:
            self.request -= 1
            raise ConsacError(f"a request of {len(payload)} bytes; the engine takes {self.max_frame}")
        frame = wire.Frame(kind, payload, self.request, self.session, self._flags)
        return self._exchange(memoryview(wire.pack(frame)), answer)

    def _exchange(self, request: memoryview, answer: int) -> memoryview:
        if self.closed:
            self.request -= 1
            raise ConnectionLost(f"the connection to {self.url} is closed")
        if self.goaway is not None:
            self._fail(ConnectionLost(f"{self.url} takes no further requests: {self.goaway}"))
        channel = self._channel if self._broken is None and answer == wire.RESULT else None
        if channel is not None and len(request) <= channel.room:
            channel.send(request)
            return self._finish(request, answer, 0, channel)
        if self._broken is None:
            try:
                self._socket.sendall(request)
            except OSError as error:
                self._broken = error
        return self._finish(request, answer, 0)

    def _finish(self, request: memoryview, answer: int, have: int, channel: shared_memory.Channel | None = None) -> memoryview:
        """Waits for the answer to `request`, which was sent, and repeats it on a new connection where the old one is lost."""
        if self.closed:
            self.request -= 1
            raise ConnectionLost(f"the connection to {self.url} is closed")
        tries = 0
        while True:
            try:
                if self._broken is not None:
                    raise self._broken
                if self._left:
                    data, self._left = self._left, b""
                    self._in_view[have:have + len(data)] = data
                    have += len(data)
                return self._await(have, self.request, answer, time.monotonic() + self.timeout, channel)
            except EngineError as error:
                if error.fatal or isinstance(error, EngineBusy):
                    self._fail(error)
                raise
            except (ProtocolError, DeadlineExceeded) as error:
                self._fail(error)
            except (KeyboardInterrupt, SystemExit):
                self._broken = ConnectionLost("interrupted")
                raise
            except OSError as error:
                have, tries, channel = 0, tries + 1, None
                if tries > 5:
                    self._fail(ConnectionLost(f"{self.url} was lost again and again ({error})"))
                self._take_up(error)
                try:
                    self._socket.sendall(request)
                except OSError as again:
                    self._broken = again

    def _take_up(self, error: Exception) -> None:
        """A new socket for the same session, or ConnectionLost."""
        why = str(error) or type(error).__name__
        if not self.resume:
            self._fail(ConnectionLost(f"{self.url} went away ({why})"))
        begun = time.monotonic()
        last = self.request - 1
        while True:
            try:
                left = begun + self.resume_s - time.monotonic()
                welcome = self._greet(open_socket(self.host, self.port, max(0.05, min(HANDSHAKE_S, left))), time.monotonic() + max(0.05, min(HANDSHAKE_S, left)))
                break
            except (EngineError, ProtocolError) as refusal:
                self._fail(ConnectionLost(f"{self.url} was lost ({why}) and does not take its session up: {refusal}"))
            except (ConnectionLost, DeadlineExceeded) as failure:
                elapsed = time.monotonic() - begun
                if elapsed > self.resume_s or (isinstance(failure.__cause__, ConnectionRefusedError) and elapsed > REFUSED_S):
                    self._fail(ConnectionLost(f"{self.url} was lost ({why}) and did not come back within {elapsed:.1f} s"))
            time.sleep(0.05)
        if not welcome.get("resumed") or welcome.get("last_request") not in (last, self.request):
            self._fail(ConnectionLost(f"{self.url} was lost ({why}); its session began anew and the episode is gone"))

    def _await(self, have: int, request: int, answer: int, end: float, channel: shared_memory.Channel | None = None) -> memoryview:
        """The payload of the frame that answers `request`; `have` bytes are in the receive buffer. Other frames are dealt with.

        With `channel` the answer is waited for there, and the connection is looked at now and then."""
        view = self._in_view
        left = end - time.monotonic()  # of the deadline, while paused
        while True:
            while have >= wire.HEADER.size or (have and not _PREFIX.startswith(view[:min(have, 4)])):
                try:
                    frame, length, crc = wire.unpack_header(bytes(view[:min(have, wire.HEADER.size)]).ljust(wire.HEADER.size, b"\0"), self.max_frame)
                    total = wire.HEADER.size + length
                    if total > len(view):
                        view = self._larger(view[:have], frame.type, total)
                    if have < total:
                        break
                    frame.payload = view[wire.HEADER.size:total]
                    wire.check_crc(frame, crc)
                except wire.WireError as error:
                    raise ProtocolError(error.code, error.message) from None
                if frame.type == wire.ERROR or (frame.type in _ANSWERS and frame.request == request):
                    self._left = bytes(view[total:have])
                    return self._answer(frame, request, answer)
                was_paused = self.paused
                self._control(frame)
                if self.paused and not was_paused:
                    left = end - time.monotonic()
                elif was_paused and not self.paused:
                    end = time.monotonic() + left
                view[:have - total] = bytes(view[total:have])
                have -= total
            try:
                if channel is not None and channel.wait(shared_memory.LOOK_S):
                    self._left, self._heard = bytes(view[:have]), time.monotonic()
                    return self._answer_in_memory(channel, request, answer)
                count = self._recv_into(view[have:], 0, _DONT_WAIT if channel is not None else 0)
                if not count:
                    raise ConnectionLost("the engine closed the connection" + (f": {self.goaway}" if self.goaway else ""))
                have += count
                self._heard, self._missed = time.monotonic(), 0
            except BlockingIOError:
                if request:
                    self._beat()
            if not self.paused and time.monotonic() > end:
                raise DeadlineExceeded(f"{self.url} did not answer within {self.timeout:g} s; is the engine stopped? A longer time: timeout=..." if request else
                                       f"{self.url} did not answer HELLO within {HANDSHAKE_S:g} s; is it an engine?")

    def _answer(self, frame: wire.Frame, request: int, answer: int) -> memoryview:
        if frame.type == wire.ERROR:
            raise EngineError.from_json(read_json(frame.payload))
        if frame.type != answer or frame.request != request:
            raise ProtocolError("MALFORMED", f"a frame of type {frame.type} answers request {frame.request}, expected type {answer} for request {request}")
        return frame.payload

    def _answer_in_memory(self, channel: shared_memory.Channel, request: int, answer: int) -> memoryview:
        try:
            frame, crc = channel.receive()
            wire.check_crc(frame, crc)
        except wire.WireError as error:
            raise ProtocolError(error.code, error.message) from None
        return self._answer(frame, request, answer)

    def _larger(self, begun: memoryview, kind: int, size: int) -> memoryview:
        """A buffer for a picture that the receive buffer cannot hold."""
        if kind != wire.FRAME:
            raise ProtocolError("WRONG_SIZE", f"a frame of type {kind} has {size} bytes, more than it can")
        larger = memoryview(bytearray(size))
        larger[:len(begun)] = begun
        return larger

    def _control(self, frame: wire.Frame) -> None:
        """A frame that answers nothing."""
        if frame.type == wire.PING:
            if len(frame.payload) > 64:
                raise ProtocolError("MALFORMED", f"a PING of {len(frame.payload)} bytes; at most 64 are taken")
            self._socket.sendall(wire.pack(wire.Frame(wire.PONG, bytes(frame.payload), session=self.session)))
        elif frame.type == wire.PAUSED:
            self.paused = True
        elif frame.type == wire.RESUMED:
            self.paused = False
        elif frame.type == wire.GOAWAY:
            value = read_json(frame.payload)
            after = value.get("retry_after_s")
            self.goaway = f"{value.get('reason', 'no reason given')}" + (f" (try again after {after:g} s)" if isinstance(after, (int, float)) else "")
        elif frame.type != wire.PONG and not frame.type & wire.OPTIONAL:
            raise ProtocolError("UNKNOWN_MESSAGE", f"a frame of type {frame.type} for request {frame.request} that nobody asked for")

    def _beat(self) -> None:
        """A PING when it has been quiet for long; the peer is gone when none is answered."""
        now = time.monotonic()
        if self.paused or not self.session or now - max(self._heard, self._pinged) < self.heartbeat_s:
            return
        if self._missed >= MISSED_PINGS:
            raise ConnectionLost(f"{MISSED_PINGS} PINGs were not answered")
        self._pinged, self._missed = now, self._missed + 1
        self._socket.send(wire.pack(wire.Frame(wire.PING, b"consac", session=self.session)))

    def _idle(self) -> None:
        """Between requests: answers PINGs, so that a long computation of the trainer does not cost the session."""
        if self.closed or not self._lock.acquire(blocking=False):
            return
        try:
            if self._broken is not None or self._socket is None:
                return
            while select.select([self._socket], [], [], 0)[0]:
                data = self._socket.recv(65536)
                if not data:
                    self._broken = ConnectionLost("the engine closed the connection" + (f": {self.goaway}" if self.goaway else ""))
                    return
                self._heard, self._missed = time.monotonic(), 0
                self._left += data
                while len(self._left) >= wire.HEADER.size:
                    frame, length, _ = wire.unpack_header(self._left, 4096)
                    if len(self._left) < wire.HEADER.size + length:
                        break
                    frame.payload, self._left = self._left[wire.HEADER.size:wire.HEADER.size + length], self._left[wire.HEADER.size + length:]
                    self._control(frame)
            self._beat()
        except (OSError, wire.WireError, ConsacError) as error:
            self._broken = error if isinstance(error, OSError) else ConnectionLost(str(error))
        finally:
            self._lock.release()

    def _fail(self, error: Exception):
        """The session is over."""
        self.closed = True
        if hasattr(self, "_stop"):
            self._stop.set()
        self._drop()
        raise error

    def _drop(self) -> None:
        sock, self._socket = getattr(self, "_socket", None), None
        self._channel = None  # a session that is taken up goes on over TCP
        if sock is not None:
            sock.close()

    def _parse(self, payload: memoryview) -> None:
        """What a RESULT says that is no plain one."""
        try:
            in_place = self._in_place or payload.obj is not self._in_view.obj  # else it came over TCP, and `rows` lie in memory that is or was shared
            self.parts, self.infos, self.final_infos = self._result.read(payload, in_place)
        except ProtocolError as error:
            self._fail(error)


_log = logging.getLogger("consac")
_PREFIX = struct.pack("<I", wire.MAGIC)
_ANSWERS = frozenset((wire.WELCOME, wire.SPEC, wire.RESULT, wire.FRAME, wire.ERROR))


def _set_timeouts(sock: socket.socket, receive: float, send: float) -> None:
    """The kernel keeps the time, so that a receive is one system call; it ends in BlockingIOError."""
    for option, seconds in ((socket.SO_RCVTIMEO, receive), (socket.SO_SNDTIMEO, send)):
        value = int(seconds * 1000) if sys.platform == "win32" else struct.pack("@ll", int(seconds), int(seconds % 1 * 1e6))
        sock.setsockopt(socket.SOL_SOCKET, option, value)


def _keep_alive(reference, stop: threading.Event) -> None:
    while not stop.wait(IDLE_TICK_S):
        connection = reference()
        if connection is None or connection.closed:
            return
        connection._idle()
        del connection
