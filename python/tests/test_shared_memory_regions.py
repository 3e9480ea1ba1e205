"""Shared memory that cannot be, and engines that write nonsense there."""
import struct
import threading
import time

import pytest

import consac
from consac import shared_memory, wire
from consac.errors import ConnectionLost, EngineError, ProtocolError
from consac.serve import Server
from regions import Nonsense, Region, changed, good, plain


# ---- a region of our own making

@pytest.mark.parametrize("change", [
    {"bytes": 4097}, {"bytes": 1 << 40}, {"bytes": -1}, {"bytes": 1.5}, {"request_offset": 191}, {"request_offset": 64}, {"result_offset": 1217}, {"result_offset": 1000}, {"result_offset": 64},
    {"request_bytes": 99}, {"result_bytes": 199}, {"result_bytes": 3000}, {"request_bytes": 1 << 62}, {"path": "/etc/passwd"}, {"path": "/proc/self/fd/0"}, {"path": "/proc/1/fd/0\n"},
    {"path": None}, {"spin_us": "long"}, {"request_bytes": None},
], ids=str)
def test_a_region_that_cannot_be_is_not_mapped(change):
    region = Region()
    shared_memory.open_channel(region.spec, 100, 200)
    with pytest.raises(shared_memory.Unavailable):
        shared_memory.open_channel(region.spec | change, 100, 200)


@pytest.mark.parametrize("region", [{"seals": 0}, {"magic": 1}, {"seals": 4}], ids=str)
def test_a_region_that_may_shrink_or_holds_something_else_is_not_used(region):
    kept = Region(**region)
    with pytest.raises(shared_memory.Unavailable):
        shared_memory.open_channel(kept.spec, 100, 200)


def test_no_turn_is_missed_whether_its_reader_spins_or_sleeps():
    """Frames go to and fro between two threads, with and without sleep between them, and none is missed."""
    region = Region()
    client = shared_memory.open_channel(region.spec, 100, 200)
    server = shared_memory.Channel(region.memory, (128, 1216, 2000), (64, 192, 1000), 50)

    def echo():
        for i in range(2000):
            while not server.wait(0.02):
                pass
            frame, _ = server.receive()
            if i % 100 == 0:
                time.sleep(0.001)
            server.send(wire.pack(wire.Frame(wire.RESULT, bytes(frame.payload), frame.request)))

    thread = threading.Thread(target=echo)
    thread.start()
    for i in range(2000):
        client.send(wire.pack(wire.Frame(wire.STEP, struct.pack("<I", i), i)))
        while not client.wait(0.02):
            pass
        frame, _ = client.receive()
        assert (frame.type, frame.request, bytes(frame.payload)) == (wire.RESULT, i, struct.pack("<I", i))
        if i % 100 == 50:
            time.sleep(0.001)
    thread.join()
    assert not client.wait(0)


# ---- an engine that writes nonsense there

def test_a_toy_engine_in_memory():
    with Nonsense(good) as server, consac.make(server.url) as env:
        assert env.connection.in_memory
        env.reset()
        assert env.step(0)[1] == 1.0


@pytest.mark.parametrize("write, code", [
    (lambda frame: b"\0" * 40, "BAD_MAGIC"),
    (lambda frame: plain(frame.request + 1), "MALFORMED"),
    (lambda frame: plain(frame.request, kind=wire.SPEC), "MALFORMED"),
    (lambda frame: plain(frame.request, tail=bytes(8)), "WRONG_SIZE"),
    (lambda frame: plain(frame.request)[:-8].replace(struct.pack("<I", 56), struct.pack("<I", 48), 1), "WRONG_SIZE"),
    (lambda frame: plain(frame.request, parts=1, state=wire.FINAL | wire.ACTIVE), "WRONG_SIZE"),
    (lambda frame: plain(frame.request, parts=2, tail=struct.pack("<I", 1 << 30) + bytes(4)), "WRONG_SIZE"),
    (lambda frame: plain(frame.request, parts=4), "WRONG_SIZE"),
    (lambda frame: wire.HEADER.pack(wire.MAGIC, wire.RESULT, 0, 1 << 30, 0, frame.request, 0, 0), "FRAME_TOO_LARGE"),
    (lambda frame: changed(plain(frame.request)), "CRC_MISMATCH"),
], ids=["no frame", "another request", "another type", "too long", "too short", "a final row that is not there", "infos that are not there", "unknown parts", "beyond the region", "another CRC"])
def test_nonsense_in_memory_is_an_error_and_no_more(write, code):
    answers = iter([good, write])
    with Nonsense(lambda frame: next(answers)(frame)) as server, consac.make(server.url) as env:
        env.reset()
        with pytest.raises(ProtocolError, match=code):
            env.step(0)
        with pytest.raises(ConnectionLost):
            env.step(0)


def test_our_server_looks_at_a_crc_in_memory_too():
    with Server("CartPole-v1") as server, consac.make(f"tcp://127.0.0.1:{server.port}") as env:
        assert env.connection.in_memory
        env.reset(seed=1)
        connection, channel = env.connection, env.connection._channel
        sent = []
        connection._channel = type("Once", (), {"__getattr__": lambda _, name: getattr(channel, name),
                                                "send": lambda _, frame: (sent.append(1), channel.send(changed(bytes(frame))))})()
        with pytest.raises(EngineError, match="CRC_MISMATCH"):
            env.step(0)
        assert sent


def test_deadlines_stop_while_the_engine_is_paused():
    def write(frame):
        if frame.type == wire.STEP:
            server.open[-1].sendall(wire.pack(wire.Frame(wire.PAUSED)))
            time.sleep(1.3)
            server.open[-1].sendall(wire.pack(wire.Frame(wire.RESUMED)))
        return good(frame)

    with Nonsense(write) as server, consac.make(server.url) as env:
        env.reset()
        env.connection.timeout = 1.0
        assert env.step(0)[1] == 1.0 and env.connection.in_memory
