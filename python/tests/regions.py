"""Shared memory of the tests' own making, and an engine that writes there what the test wants."""
import mmap
import os
import struct
import threading

from consac import shared_memory, wire
from toy_server import ToyServer


# ---- a region of our own making

class Region:
    """What an engine might share, right or wrong."""

    def __init__(self, size=4096, seals=7, magic=wire.MAGIC):
        self.descriptor = os.memfd_create("test", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.ftruncate(self.descriptor, size)
        import fcntl

        fcntl.fcntl(self.descriptor, fcntl.F_ADD_SEALS, seals)
        self.memory = mmap.mmap(self.descriptor, size)
        struct.pack_into("<II", self.memory, 0, magic, 2)
        self.spec = {"path": f"/proc/{os.getpid()}/fd/{self.descriptor}", "bytes": size, "request_offset": 192, "request_bytes": 1000, "result_offset": 1216, "result_bytes": 2000, "spin_us": 50}


# ---- an engine that writes nonsense there

class Nonsense(ToyServer):
    """Shares a region; `write(memory, request)` answers every RESET and STEP in it."""

    def __init__(self, write, **options):
        self.region = Region(1 << 16)
        self.region.spec |= {"result_bytes": (1 << 16) - 1216}
        super().__init__(capabilities=["shm"], spec={"shm": self.region.spec}, **options)
        self.write, self.stop = write, False
        threading.Thread(target=self._answer, daemon=True).start()

    def _answer(self):
        channel = shared_memory.Channel(self.region.memory, (128, 1216, (1 << 16) - 1216), (64, 192, 1000), 50)
        while not self.stop:
            if channel.wait(0.02):
                frame, _ = channel.receive()
                channel.send(self.write(frame))

    def __exit__(self, *_):
        self.stop = True
        super().__exit__()


def plain(request, parts=0, state=wire.ACTIVE, tail=b"", kind=wire.RESULT, reward=1.0):
    """A RESULT of one world with 8 floats."""
    return wire.pack(wire.Frame(kind, struct.pack("<II", parts, 0) + bytes(32) + struct.pack("<dB7x", reward, state) + tail, request))


def changed(frame):
    """The same frame with a CRC that is another's."""
    return frame[:6] + struct.pack("<H", wire.FLAG_CRC) + frame[8:12] + struct.pack("<I", wire.crc32c(frame[32:]) ^ 1) + frame[16:]


def good(frame):
    """The answer to a RESET or a STEP."""
    return plain(frame.request, state=wire.FIRST | wire.ACTIVE, reward=0.0) if frame.type == wire.RESET else plain(frame.request)
