"""A socket that frames are read from and written to, with deadlines."""
from __future__ import annotations

import socket
import threading
import time

from consac import shared_memory, wire
from consac.address import peer_of, ready
from consac.errors import said
from consac.wire import HEADER, WireError

from .limits import TICK, Limits
from .refusal import Gone


class Connection:
    """A socket that frames are read from and written to, with deadlines, and memory that may be shared beside it."""

    def __init__(self, sock: socket.socket, limits: Limits):
        self.sock, self.limits, self.limit = sock, limits, wire.LARGEST_BEFORE_WELCOME
        self.buffer = bytearray(65536)
        self.view = memoryview(self.buffer)
        self.start = self.end = 0
        self.since = self.heard = time.monotonic()
        self.has_spoken = self.given_up = False
        self.stepped = False  # an action of text protocol 1 was carried out
        self.peer = peer_of(sock)
        self.pings = 0
        self.closing = threading.Event()
        self.crc = False
        self.shares = False  # capability `shm`
        self.channel: shared_memory.Channel | None = None
        self.in_memory = False  # the request that is being carried out came that way
        self.spins = False
        self.request = 0  # number of the request that is being carried out
        self.lock = threading.Lock()  # held while a frame is written
        self.wrote = time.monotonic()
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        sock.setblocking(False)

    def read(self, look) -> tuple:
        """(type, request, session, payload) of the next frame; `look` is called now and then while none is there."""
        while True:
            have = self.end - self.start
            if have >= 4 and self.buffer[self.start:self.start + 4] != b"\xC0NSC":
                wire.unpack_header(bytes(self.view[self.start:self.end]).ljust(HEADER.size, b"\0"), self.limit)
            if have >= HEADER.size:
                frame, length, crc = wire.unpack_header(self.view[self.start:self.end], self.limit)
                total = HEADER.size + length
                if have >= total:
                    payload = self.view[self.start + HEADER.size:self.start + total]
                    self.start += total
                    if self.start == self.end:
                        self.start = self.end = 0
                    self.in_memory = False
                    if frame.flags:
                        frame.payload = payload
                        wire.check_crc(frame, crc)
                    return frame.type, frame.request, frame.session, payload
                self._make_room(total)
            else:
                self._make_room(HEADER.size)
            if self.channel is not None and self._await_turn(self.channel, look):
                return self._from_memory(self.channel)
            self._receive(look)

    def _await_turn(self, channel: shared_memory.Channel, look) -> bool:
        """True once a frame lies in memory, false when something comes over the connection first."""
        while not channel.wait(shared_memory.LOOK_S):
            if self.wait(0):
                return False
            look()
        return True

    def _from_memory(self, channel: shared_memory.Channel) -> tuple:
        frame, crc = channel.receive()
        frame.payload = bytes(frame.payload)  # there it might change while it is looked at
        wire.check_crc(frame, crc)
        self.in_memory, self.heard, self.pings = True, time.monotonic(), 0
        return frame.type, frame.request, frame.session, frame.payload

    def answer(self, data) -> None:
        """Sends an answer the way its request came, where it fits there."""
        if self.in_memory and self.channel is not None and len(data) <= self.channel.room:
            self.channel.send(data)
            self.wrote = time.monotonic()
        else:
            self.write(data)

    def _make_room(self, total: int) -> None:
        """Room for more of a frame of `total` bytes, never more than twice what has come of it."""
        if self.end < len(self.buffer) and (self.start == 0 or self.start + total <= len(self.buffer)):
            return
        have = self.end - self.start
        fresh = bytearray(len(self.buffer) if have < len(self.buffer) else min(total, 2 * len(self.buffer)))
        fresh[:have] = self.view[self.start:self.end]
        self.buffer, self.view, self.start, self.end = fresh, memoryview(fresh), 0, have

    def _receive(self, look) -> None:
        room, began = self.view[self.end:], time.monotonic()
        while True:
            try:
                count = self.sock.recv_into(room)
                break
            except BlockingIOError:
                if self.spins and time.monotonic() - began < self.limits.spin_s:
                    continue
            except OSError as error:
                raise Gone(f"the connection broke: {said(error)}") from None
            self.spins = False
            if not self.wait(TICK):
                look()
        if count == 0:
            raise Gone("the peer closed")
        self.end += count
        self.has_spoken = True
        self.heard, self.pings = time.monotonic(), 0
        self.spins = self.heard - began < self.limits.spin_s

    def wait(self, seconds: float, write: bool = False) -> bool:
        """Whether the socket is ready within `seconds`."""
        try:
            return ready(self.sock, seconds, write)
        except (OSError, ValueError) as error:
            raise Gone(f"the connection broke: {said(error)}") from None

    def write(self, data) -> None:
        """All of `data`, or Gone when the peer does not take it in time."""
        with self.lock:
            self._write(data)
            self.wrote = time.monotonic()

    def _write(self, data) -> None:
        deadline, view = None, data
        while True:
            try:
                sent = self.sock.send(view)
                if sent == len(view):
                    return
                view = memoryview(view)[sent:]
            except BlockingIOError:
                pass
            except OSError as error:
                raise Gone(f"the connection broke: {said(error)}") from None
            deadline = deadline or time.monotonic() + self.limits.write_s
            if time.monotonic() > deadline:
                raise Gone(f"the peer takes no bytes for {self.limits.write_s:g} s")
            self.wait(TICK, write=True)

    def pack(self, kind: int, payload=b"", request: int = 0, session: int = 0) -> bytes:
        return wire.pack(wire.Frame(kind, payload, request, session, wire.FLAG_CRC if self.crc else 0))

    def aside(self, kind: int, payload, session: int) -> bool:
        """Frames that are no requests: true when it was one."""
        if kind == wire.PING:
            if len(payload) > 64:
                raise WireError("MALFORMED", f"a PING of {len(payload)} bytes; at most 64 are taken")
            self.write(self.pack(wire.PONG, bytes(payload), 0, session))
            return True
        return kind == wire.PONG or kind & wire.OPTIONAL != 0

    def last_word(self, data: bytes) -> None:
        """`data`, if the peer still takes it."""
        try:
            self.write(data)
        except Gone:
            pass

    def heartbeat(self) -> None:
        """PING to a peer that has been silent; after three it is gone."""
        silent = time.monotonic() - self.heard
        if silent > (self.pings + 1) * self.limits.heartbeat_s:
            if self.pings >= 3:
                raise Gone(f"no sign of life for {silent:.0f} s")
            self.pings += 1
            self.write(self.pack(wire.PING))

    def reassure(self) -> None:
        """PING to a peer that waits for a long request; called from another thread, never waits."""
        if self.request == 0 or time.monotonic() - self.wrote < self.limits.heartbeat_s or not self.lock.acquire(blocking=False):
            return
        try:
            data = self.pack(wire.PING)
            if self.sock.send(data) != len(data):
                self.sock.shutdown(socket.SHUT_RDWR)
            self.wrote = time.monotonic()
        except OSError:
            pass
        finally:
            self.lock.release()

    def is_silent(self) -> bool:
        """Whether it has never said anything, and its place may go to another."""
        try:
            return not self.has_spoken and not self.given_up and not self.wait(0)
        except Gone:
            return False

    def give_up(self, last_word: bytes = b"") -> None:
        """From another thread: the one that serves it finds it closed. Never waits."""
        self.given_up = True
        try:
            if last_word and self.lock.acquire(blocking=False):
                try:
                    self.sock.send(last_word)
                finally:
                    self.lock.release()
            self.sock.shutdown(socket.SHUT_RD)
        except OSError:
            pass

    def finish(self) -> None:
        """Closes so that the last words still arrive, though the peer may be sending."""
        self.channel = None
        try:
            self.sock.shutdown(socket.SHUT_WR)
            self.sock.settimeout(0.2)
            deadline = time.monotonic() + 1
            while time.monotonic() < deadline and self.sock.recv(65536):
                pass
        except OSError:
            pass
        self.sock.close()
