"""The trainer's end of one connection: frames as they come, and those that answer nothing (PING, PAUSED, GOAWAY ...) dealt with.

client.py makes requests of it. What is lost here is taken up there."""
from __future__ import annotations

import socket
import struct
import sys
import threading
import time

import numpy as np

from . import shared_memory, wire
from .address import ready
from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineError, ProtocolError
from .frames import read_json
from .names import printable_line

HANDSHAKE_S = 5.0
MISSED_PINGS = 3
GOAWAY_S = 2.0  # so long after it an answer may still come

DONT_WAIT = getattr(socket, "MSG_DONTWAIT", 0)
_PREFIX = struct.pack("<I", wire.MAGIC)
_ANSWERS = frozenset((wire.WELCOME, wire.SPEC, wire.RESULT, wire.FRAME, wire.REWARDS, wire.ERROR))


class Line:
    """One socket and the receive buffer. Whoever uses it holds the lock."""

    url: str
    timeout: float

    def __init__(self):
        self.paused = False
        self._deserted: float | None = None  # since then nobody takes part
        self.goaway: str | None = None  # why the engine takes no further requests
        self.session = 0
        self.max_frame, self.heartbeat_s = wire.LARGEST_BEFORE_WELCOME, 10.0
        self._left = b""  # bytes that came after the last answer
        self._channel: shared_memory.Channel | None = None  # while frames go through shared memory
        self._lock = threading.RLock()  # of one owner: whoever was interrupted while holding it can take it again
        self._heard = self._pinged = time.monotonic()
        self._missed = 0
        self._greeted = False  # WELCOME has come on this socket
        self._broken: Exception | None = None  # the socket is lost; the next request takes the session up
        self._socket: socket.socket | None = None
        self._reserve(wire.LARGEST_JSON)

    def _reserve(self, size: int) -> None:
        """A buffer for what comes over TCP. `rows` lie over `_in`, which is the same where no memory is shared."""
        self._in = np.empty(size + wire.HEADER.size, np.uint8)  # pages that are never written cost nothing
        self._in_view = memoryview(self._in)

    def _hold(self, sock: socket.socket, end: float) -> None:
        """From now on `sock` is the connection; the handshake on it ends at `end`."""
        self._drop()
        self._socket, self._left, self.paused, self._missed = sock, b"", False, 0
        self._broken, self.goaway, self._greeted = None, None, False
        self._heard = time.monotonic()
        sock.setblocking(True)
        set_timeouts(sock, min(0.1, max(0.005, end - time.monotonic())))
        self._send, self._recv_into = sock.send, sock.recv_into

    def _drop(self) -> None:
        sock, self._socket = self._socket, None
        self._channel = None  # a session that is taken up goes on over TCP
        if sock is not None:
            sock.close()

    def _part(self) -> None:
        """BYE, where a session is there and it can still be said (R85)."""
        if self._socket is None or isinstance(self._broken, OSError) or not self._greeted or self.goaway is not None:
            return
        try:
            self._socket.send(wire.pack(wire.Frame(wire.BYE, session=self.session)))
        except OSError:
            pass

    def _await(self, have: int, request: int, answer: int, end: float, channel: shared_memory.Channel | None = None) -> memoryview:
        """The payload of the frame that answers `request`; `have` bytes are in the receive buffer. Other frames are dealt with.

        With `channel` the answer is waited for there, and the connection is looked at now and then."""
        view = self._in_view
        begin, left = 0, end - time.monotonic()  # of the bytes that are no frame yet; of the deadline, while paused
        while True:
            while have - begin >= wire.HEADER.size or (have > begin and not _PREFIX.startswith(view[begin:min(have, begin + 4)])):
                try:
                    frame, length, crc = wire.unpack_header(bytes(view[begin:min(have, begin + wire.HEADER.size)]).ljust(wire.HEADER.size, b"\0"), self.max_frame)
                    total = wire.HEADER.size + length
                    if begin and (begin + total > len(view) or frame.type == wire.RESULT):  # whose rows are read where they belong
                        begin, have = self._move_down(view, begin, have)
                    if total > len(view):
                        view = self._larger(view[:have], frame.type, total)
                    if have - begin < total:
                        break
                    frame.payload = view[begin + wire.HEADER.size:begin + total]
                    wire.check_crc(frame, crc)
                except wire.WireError as error:
                    raise ProtocolError(error.code, error.message) from None
                begin += total
                self._greeted = self._greeted or frame.type == wire.WELCOME  # whatever it holds: the engine has a session now (R85)
                if frame.type == wire.ERROR or (frame.type in _ANSWERS and frame.request == request):
                    self._left = bytes(view[begin:have])
                    return self._answer(frame, request, answer)
                was_paused = self.paused
                self._control(frame)
                if self.paused and not was_paused:
                    left = end - time.monotonic()
                elif was_paused and not self.paused:
                    end = time.monotonic() + left
                if self.goaway is not None:
                    end = min(end, time.monotonic() + GOAWAY_S)
                self._check_deadline(end, request)  # for each frame: a flood of them must not defeat it
            begin, have = self._move_down(view, begin, have)
            try:
                if channel is not None and channel.wait(shared_memory.LOOK_S):
                    self._left, self._heard = bytes(view[:have]), time.monotonic()
                    return self._answer_in_memory(channel, request, answer)
                count = self._recv_into(view[have:], 0, DONT_WAIT if channel is not None else 0)
                if not count:
                    raise ConnectionLost("the engine closed the connection" + (f": {self.goaway}" if self.goaway else ""))
                have += count
                self._heard, self._missed = time.monotonic(), 0
            except BlockingIOError:
                if request:
                    self._beat()
            self._check_deadline(end, request)

    def _move_down(self, view: memoryview, begin: int, have: int) -> tuple[int, int]:
        """The bytes from `begin` now lie at the buffer's start: where they begin and end there."""
        if begin:
            view[:have - begin] = bytes(view[begin:have])
        return 0, have - begin

    def _check_deadline(self, end: float, request: int) -> None:
        if not self.paused and time.monotonic() > end:
            if self.goaway is not None:
                raise DeadlineExceeded(f"{self.url} ends the session and did not answer any more: {self.goaway}")
            raise DeadlineExceeded(f"{self.url} did not answer within {self.timeout:g} s; is the engine stopped? A longer time: timeout=..." if request else
                                   f"{self.url} did not answer HELLO within {HANDSHAKE_S:g} s; is it an engine?")

    def _answer(self, frame: wire.Frame, request: int, answer: int) -> memoryview:
        if frame.type == wire.ERROR:
            error = EngineError.from_json(read_json(frame.payload))
            if not error.fatal and frame.request != request:
                raise ProtocolError("MALFORMED", f"an ERROR refuses request {frame.request}; under way is {request} (R15): {error}")
            raise error
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
            self._deserted = None  # nor did its empty worlds grow older (R83)
        elif frame.type == wire.GOAWAY:
            value = read_json(frame.payload)
            after = value.get("retry_after_s")
            self.goaway = printable_line(value.get("reason", "no reason given"), 400) + (f" (try again after {after:g} s)" if isinstance(after, float) or type(after) is int and after < 1 << 31 else "")
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

    def _read_idle(self) -> None:
        """Between requests: answers PINGs, so that a long computation of the trainer does not cost the session. Holds the lock."""
        if self._broken is not None or self._socket is None:
            return
        try:
            if ready(self._socket, 0):  # once: a flood must not keep the lock
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
            if isinstance(error, wire.WireError):
                error = ProtocolError(error.code, error.message)
            self._broken = error  # what the engine says wrongly is the end, what is lost is taken up


def set_timeouts(sock: socket.socket, receive: float, send: float = 10.0) -> None:
    """The kernel keeps the time, so that a receive is one system call; it ends in BlockingIOError."""
    for option, seconds in ((socket.SO_RCVTIMEO, receive), (socket.SO_SNDTIMEO, send)):
        value = int(seconds * 1000) if sys.platform == "win32" else struct.pack("@ll", int(seconds), int(seconds % 1 * 1e6))
        sock.setsockopt(socket.SOL_SOCKET, option, value)
