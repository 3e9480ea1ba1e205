"""Frames of protocol 2 through memory that two processes of one host share (spec/protocol2.md, "Shared memory").

Both ends use it, client.py and serve; the TCP connection beside it tells of everything else. It is there on Linux with
x86-64 only: that machine keeps plain stores in order, which is all that Python can write. Elsewhere frames go over TCP.
"""
from __future__ import annotations

import ctypes
import mmap
import os
import platform
import re
import struct
import sys
import threading
import time
import weakref
from typing import Any

from . import wire
from .layout import align

LOOK_S = 0.02  # between looks at the connection, while a turn is waited for
SPIN_US = 50  # that our server tells its clients
REQUEST_TURN, RESULT_TURN, REQUESTS = 64, 128, 192  # offsets in a region
LARGEST_REGION = 1 << 31
AVAILABLE = sys.platform == "linux" and platform.machine() == "x86_64" and struct.calcsize("P") == 8

_SYS_FUTEX, _FUTEX_WAIT, _FUTEX_WAKE = 202, 0, 1  # of x86-64
_SEALS = 0x1 | 0x2 | 0x4  # F_SEAL_SEAL, F_SEAL_SHRINK, F_SEAL_GROW
_SHRINK = 0x2
_HEAD = struct.Struct("<II")  # magic, version
_BURST = range(64)  # looks between two looks at the clock
_LONGEST_SPIN_S = 1e-3
_FULL_SPIN_EVERY = 64  # sleeps, in case the peer has become fast
_SEVERAL_CORES = (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1) > 1

if AVAILABLE:
    import fcntl

    _futex = ctypes.CDLL(None).syscall
    _futex.restype = ctypes.c_long
    _futex.argtypes = [ctypes.c_long, ctypes.c_void_p, ctypes.c_int, ctypes.c_uint32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32]


class Unavailable(Exception):
    """Memory cannot be shared; the message says why. Frames go over TCP."""


class Turn:
    """A counter in a region: whoever has written a frame takes a turn, the other end sees it rise. One writer, one reader."""

    def __init__(self, memory: mmap.mmap, at: int, spin_us: float):
        self._words = memoryview(memory)[at:at + 8].cast("I")  # the count; 1 while its reader sleeps. An item is one load or store
        self._pinned = ctypes.c_uint32.from_buffer(memory, at)
        self._address = ctypes.addressof(self._pinned)
        self._fence = threading.Lock()  # x86-64: taking a lock orders a store before a later load
        self._time = (ctypes.c_long * 2)()
        self._seen = self._words[0]
        self._longest = self._spin = min(spin_us * 1e-6, _LONGEST_SPIN_S) if _SEVERAL_CORES else 0.0
        self._sleeps = 0

    def take(self) -> None:
        """Writer: what was written before is there now; wakes a sleeping reader."""
        words = self._words
        words[0] = words[0] + 1 & 0xFFFFFFFF
        with self._fence:
            pass
        if words[1]:
            _futex(_SYS_FUTEX, self._address, _FUTEX_WAKE, 1, None, None, 0)

    def wait(self, seconds: float) -> bool:
        """Reader: whether a turn was taken since `saw`. Spins, then sleeps, at most `seconds` in all."""
        words, seen = self._words, self._seen
        if words[0] != seen:
            return True
        if self._spin > 0:
            end = time.perf_counter() + min(self._spin, seconds)
            while True:
                for _ in _BURST:
                    if words[0] != seen:
                        self._spin = self._longest
                        return True
                if time.perf_counter() >= end:
                    break
            # A spin that did not help makes the next one shorter: two ends that share a core must not burn it.
            self._sleeps += 1
            self._spin = self._longest if self._sleeps % _FULL_SPIN_EVERY == 0 else max(self._spin * 0.5, 1e-6)
        if seconds > 0:
            self._time[0], self._time[1] = int(seconds), int(seconds % 1 * 1e9)
            try:
                words[1] = 1
                with self._fence:
                    pass
                if words[0] == seen:
                    _futex(_SYS_FUTEX, self._address, _FUTEX_WAIT, seen, ctypes.addressof(self._time), None, 0)
            finally:
                words[1] = 0
        return words[0] != seen

    def saw(self) -> None:
        """Reader: the frame is taken; the next `wait` is for the next one."""
        self._seen = self._words[0]


class Channel:
    """One end of a region. `room`, `incoming_room`: bytes of the largest frame that it sends and receives.

    Not for several threads at once. What `receive` returns lies in the region, which holds until the next `send`."""

    def __init__(self, memory: mmap.mmap, out: tuple[int, int, int], incoming: tuple[int, int, int], spin_us: float):
        """`out` and `incoming`: where a turn lies, and offset and bytes of its frames."""
        self._memory = memory
        whole = memoryview(memory)
        self._out_turn, self._turn = Turn(memory, out[0], spin_us), Turn(memory, incoming[0], spin_us)
        self._out, self.incoming = whole[out[1]:out[1] + out[2]], whole[incoming[1]:incoming[1] + incoming[2]]
        self.room, self.incoming_room = out[2], incoming[2]
        self.wait, self.saw = self._turn.wait, self._turn.saw

    def send(self, frame: bytes | bytearray | memoryview) -> None:
        """Writes a whole frame of at most `room` bytes and takes the turn."""
        self._out[:len(frame)] = frame
        self._out_turn.take()

    def receive(self) -> tuple[wire.Frame, int]:
        """The frame that `wait` told of, its payload in place, and its CRC; WireError where it is none."""
        self.saw()
        frame, length, crc = wire.unpack_header(bytes(self.incoming[:wire.HEADER.size]), self.incoming_room - wire.HEADER.size)
        frame.payload = self.incoming[wire.HEADER.size:wire.HEADER.size + length]
        return frame, crc


def open_channel(spec: dict[str, Any], request_bytes: int, result_bytes: int) -> Channel:
    """The client's end of what SPEC's `shm` describes, with room for frames of so many bytes; Unavailable says why not."""
    if not AVAILABLE:
        raise Unavailable("shared memory is there on Linux with x86-64 only")
    try:
        path = str(spec["path"])
        size, request_offset, requests, result_offset, results = (_whole(spec[key]) for key in ("bytes", "request_offset", "request_bytes", "result_offset", "result_bytes"))
        spin_us = float(spec.get("spin_us", SPIN_US))
    except (KeyError, TypeError, ValueError) as error:
        raise Unavailable(f"SPEC's shm cannot be read: {type(error).__name__}: {error}") from None
    apart = request_offset + requests <= result_offset or result_offset + results <= request_offset
    if not (size <= LARGEST_REGION and request_offset >= REQUESTS and result_offset >= REQUESTS and request_offset % 8 == result_offset % 8 == 0 and apart
            and requests >= request_bytes and results >= result_bytes and max(request_offset + requests, result_offset + results) <= size):
        raise Unavailable(f"SPEC describes shared memory that cannot be: {spec}")
    # Somebody else's text: nothing but a descriptor of a process is opened.
    if not re.fullmatch(r"/proc/[0-9]+/fd/[0-9]+", path):
        raise Unavailable(f"{path!r} is no shared memory; expected /proc/PROCESS/fd/NUMBER")
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NONBLOCK)
        try:
            # What might shrink under a reader would kill it.
            if not fcntl.fcntl(descriptor, fcntl.F_GET_SEALS) & _SHRINK or os.fstat(descriptor).st_size < size:
                raise Unavailable(f"the shared memory {path} is smaller than {size} bytes, or may yet shrink")
            memory = mmap.mmap(descriptor, size)
        finally:
            os.close(descriptor)
    except (OSError, ValueError) as error:
        raise Unavailable(f"the shared memory {path} cannot be mapped: {error}") from None
    if _HEAD.unpack_from(memory) != (wire.MAGIC, wire.VERSION):
        raise Unavailable(f"{path} holds no frames of protocol 2")
    return Channel(memory, (REQUEST_TURN, request_offset, requests), (RESULT_TURN, result_offset, results), spin_us)


def create_channel(request_bytes: int, result_bytes: int) -> tuple[Channel, dict[str, Any]]:
    """The server's end of a new region with room for frames of so many bytes, and what SPEC says of it; OSError where there is none.

    The client can open the region as long as the channel lives."""
    result_offset = -(-(REQUESTS + request_bytes) // 64) * 64
    size = result_offset + align(result_bytes)
    descriptor = os.memfd_create("consac", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    try:
        os.ftruncate(descriptor, size)
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, _SEALS)
        memory = mmap.mmap(descriptor, size)
    except BaseException:
        os.close(descriptor)
        raise
    _HEAD.pack_into(memory, 0, wire.MAGIC, wire.VERSION)
    channel = Channel(memory, (RESULT_TURN, result_offset, size - result_offset), (REQUEST_TURN, REQUESTS, request_bytes), SPIN_US)
    weakref.finalize(channel, os.close, descriptor)
    return channel, {"path": f"/proc/{os.getpid()}/fd/{descriptor}", "bytes": size, "request_offset": REQUESTS, "request_bytes": request_bytes,
                     "result_offset": result_offset, "result_bytes": size - result_offset, "spin_us": SPIN_US}


def _whole(value: object) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"{value!r} is no whole number")
    return value
