"""The client of protocol 2 before an engine that dies, drips, is silent, pauses, or says what is no protocol 2."""
import struct
import threading
import time
import tracemalloc

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import consac
from consac import client, wire
from consac.errors import ConnectionLost, ConsacError, DeadlineExceeded, ProtocolError
from played import box, frame, play
from toy_server import ToyServer
from waiting import ENDS_S, until


def cut_at(at, connections):
    def fault(number, sent, data):
        return data[:max(0, at - sent)] if number <= connections and sent + len(data) > at else None
    return fault


def sent_bytes():
    with ToyServer() as server:
        sent = []
        server.fault = lambda number, before, data: sent.append(len(data))
        expected = play(server.url)
        return expected, sent


def test_an_engine_that_dies_at_any_byte():
    _, sent = sent_bytes()
    with ToyServer(keep=False) as server:
        for at in range(sum(sent)):
            server.fault = cut_at(at, 1 << 30)
            with pytest.raises(ConnectionLost):
                play(server.url)
        assert not server.errors


def test_a_connection_that_breaks_at_any_byte_is_taken_up_and_every_step_happens_once():
    expected, sent = sent_bytes()
    handshake = sent[0]
    for at in range(handshake, sum(sent), 3):
        with ToyServer(fault=cut_at(at, 1)) as server:
            assert (play(server.url) == expected).all()
            assert server.steps == 3 and server.connections == 2 and not server.errors


def test_a_step_that_never_arrived_is_carried_out_once():
    expected, _ = sent_bytes()

    def before(server, sock, frame):
        if frame.type == wire.STEP and server.connections < 4:
            raise ConnectionError("lost on the way")
    with ToyServer(before=before) as server:
        assert (play(server.url) == expected).all()
        assert server.steps == 3 and server.connections == 4


@pytest.mark.parametrize("shared_memory", [False, True])
def test_consac_serve_takes_a_session_up(serve_env, shared_memory):
    env = consac.make(serve_env("CartPole-v1"), protocol=2, shared_memory=shared_memory)
    stock = gymnasium.make("CartPole-v1")
    assert (env.reset(seed=1)[0] == stock.reset(seed=1)[0]).all()
    for step in range(9):
        if step % 3 == 1:
            env.unwrapped.connection._socket.shutdown(2)
        assert (env.step(step % 2)[0] == stock.step(step % 2)[0]).all()
    env.close()


def test_a_session_that_is_forgotten_is_lost():
    with ToyServer(keep=False) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        for sock in server.open:
            sock.shutdown(2)
        with pytest.raises(ConnectionLost, match="AUTH_FAILED"):
            env.step(1)
        with pytest.raises(ConnectionLost, match="is closed"):
            env.step(1)

BAD_ANSWERS = {
    "text": (b"busy: later\n" * 8, "BAD_MAGIC"),
    "another magic": (b"\xc0NSD" + bytes(28), "BAD_MAGIC"),
    "reserved bits": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 0, 0, 0, 3, 0, 1), "MALFORMED"),
    "unknown flags": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 4, 0, 0, 3, 0, 0), "MALFORMED"),
    "a length over the limit": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 0, 0xFFFFFFFF, 0, 3, 0, 0), "FRAME_TOO_LARGE"),
    "a length over what RESULT can have": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 0, 32 << 20, 0, 3, 0, 0), "WRONG_SIZE"),
    "an empty RESULT": (frame(wire.RESULT), "WRONG_SIZE"),
    "a RESULT too short": (frame(wire.RESULT, bytes(40)), "WRONG_SIZE"),
    "a RESULT too long": (frame(wire.RESULT, bytes(80)), "WRONG_SIZE"),
    "final rows that are not there": (frame(wire.RESULT, struct.pack("<II", 1, 0) + bytes(40) + b"\x05"), "WRONG_SIZE"),
    "infos that are not there": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48)), "WRONG_SIZE"),
    "infos longer than the frame": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48) + struct.pack("<I", 1 << 30)), "WRONG_SIZE"),
    "infos that are no JSON": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48) + struct.pack("<I", 4) + b"{{{{"), "MALFORMED"),
    "infos of a slot that is not there": (frame(wire.RESULT, struct.pack("<II", 2, 0) + bytes(48) + struct.pack("<I", 43) + b'{"infos":{"a":{"slots":[1],"values":[true]}}}'[:43]), "MALFORMED"),
    "an ERROR that is no JSON": (frame(wire.ERROR, b"no"), "MALFORMED"),
    "an ERROR without code": (frame(wire.ERROR, b'{"severity": "connection", "message": "no"}'), "MALFORMED"),
    "an ERROR without message": (frame(wire.ERROR, b'{"code": "CAPACITY", "severity": "connection"}'), "MALFORMED"),
    "an ERROR of a later time": (frame(wire.ERROR, b'{"code": "CAPACITY", "severity": "connection", "message": "no", "retry_after_s": "soon"}'), "MALFORMED"),
    "another request's answer": (frame(wire.RESULT, bytes(49), 99), "UNKNOWN_MESSAGE"),
    "another kind of answer": (frame(wire.SPEC, b"{}"), "MALFORMED"),
    "an unknown type": (frame(77), "UNKNOWN_MESSAGE"),
    "a CRC that is wrong": (struct.pack("<IHHIIQII", wire.MAGIC, wire.RESULT, 1, 1, 7, 3, 0, 0) + b"x", "CRC_MISMATCH"),
}


@pytest.mark.parametrize("kind", BAD_ANSWERS)
def test_answers_that_are_no_protocol_2(kind):
    data, code = BAD_ANSWERS[kind]

    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(data)
            return True
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        with pytest.raises(ProtocolError) as told:
            env.step(1)
        assert told.value.code == code
        with pytest.raises(ConnectionLost):
            env.step(1)


def test_a_peer_that_is_no_engine():
    with ToyServer(first=b"HTTP/1.1 400 Bad Request\r\n\r\n") as server:
        with pytest.raises(ProtocolError, match='BAD_MAGIC: .* An engine of text protocol 1 wants protocol="text1"'):
            consac.make(server.url, protocol=2)
    with pytest.raises(ConnectionLost, match="start it first"):
        consac.make(server.url, protocol=2)
    for wrong in ("udp://a:1", "tcp://a", "tcp://:4", "tcp://a:x"):
        with pytest.raises(ConsacError, match="tcp://host:port"):
            consac.make(wrong)


def with_deadline(url, seconds):
    """After its first reset, which takes as long as it takes."""
    env = consac.make(url, protocol=2)
    env.reset()
    env.unwrapped.connection.timeout = seconds
    return env


def test_an_engine_that_is_silent():
    with ToyServer(before=lambda server, sock, frame: frame.type == wire.STEP) as server:
        env = with_deadline(server.url, 0.2)
        begun = time.monotonic()
        with pytest.raises(DeadlineExceeded, match="0.2 s"):
            env.step(1)
        assert 0.2 <= time.monotonic() - begun < 30  # the deadline of others
        with pytest.raises(ConnectionLost, match="is closed"):
            env.step(1)


def test_an_engine_that_drips_is_given_up_too():
    def before(server, sock, got):
        if got.type == wire.STEP:
            for byte in frame(wire.RESULT, bytes(49)):
                sock.sendall(bytes([byte]))
                time.sleep(0.02)
            return True
    with ToyServer(before=before) as server:
        env = with_deadline(server.url, 0.3)
        with pytest.raises(DeadlineExceeded):
            env.step(1)


def test_a_pause_stops_the_deadline():
    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.PAUSED, request=0))
            time.sleep(1.3)
            sock.sendall(frame(wire.RESUMED, request=0) + frame(wire.OPTIONAL | 99, b"news", 0))
    with ToyServer(before=before) as server:
        env = with_deadline(server.url, 1.0)
        assert env.step(1)[1] == 1.0
        env.close()


def test_after_a_pause_the_deadline_goes_on():
    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.PAUSED, request=0))
            resumed.append(time.monotonic() + 1.3)
            time.sleep(1.3)
            sock.sendall(frame(wire.RESUMED, request=0))
            return True
    resumed = []
    with ToyServer(before=before) as server:
        env = with_deadline(server.url, 1.0)
        with pytest.raises(DeadlineExceeded):
            env.step(1)
        assert time.monotonic() > resumed[0]


def test_pings_are_answered_while_waiting_and_between_requests(monkeypatch):
    monkeypatch.setattr(client, "IDLE_TICK_S", 0.02)
    pongs = threading.Semaphore(0)

    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.PING, b"one", 0))
        if got.type == wire.PONG:
            assert got.payload in (b"one", b"two")
            pongs.release()
            return True
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        env.step(1)
        assert pongs.acquire(timeout=ENDS_S)
        data = frame(wire.PING, b"two", 0)
        server.open[0].sendall(data[:20])
        time.sleep(0.1)
        server.open[0].sendall(data[20:])
        assert pongs.acquire(timeout=ENDS_S)
        assert env.step(1)[1] == 2.0
        env.close()
        assert not server.errors


def test_a_peer_that_answers_no_ping_is_gone():
    def before(server, sock, got):
        return server.connections == 1 and got.type in (wire.STEP, wire.PING)
    with ToyServer(before=before, heartbeat_s=0.3) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        begun = time.monotonic()
        assert env.step(1)[1] == 1.0
        assert time.monotonic() - begun < env.unwrapped.connection.timeout / 2 and server.connections == 2 and server.steps == 1
        env.close()


def test_frames_that_come_in_many_pieces():
    space = spaces.Box(0, 255, (300, 300, 3), np.uint8)
    with ToyServer(observation=space) as server:
        first, second = play(server.url), play(server.url)
        assert first.size == 4 * 300 * 300 * 3 + 3 and (first == second).all()


def test_goaway():
    def before(server, sock, got):
        if got.type == wire.STEP:
            sock.sendall(frame(wire.GOAWAY, wire.dump_json({"reason": "the level ends", "retry_after_s": 5}), 0))
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        assert env.step(1)[1] == 1.0
        with pytest.raises(ConnectionLost, match="the level ends"):
            env.step(1)


def test_a_connection_that_is_dropped_ends_its_thread(monkeypatch):
    monkeypatch.setattr(client, "IDLE_TICK_S", 0.02)
    with ToyServer() as server:
        before = set(threading.enumerate())
        env = consac.make(server.url, protocol=2)
        thread, = (thread for thread in set(threading.enumerate()) - before if thread.name == "consac-keepalive")
        del env
        thread.join(ENDS_S)
        assert not thread.is_alive()


@pytest.mark.parametrize("change", [{"environments": 0}, {"environments": 1 << 40}, {"environments": "x"}, {"behaviours": []}, {"behaviours": [{}]}, {"autoreset": "never"}, {"behaviours": 3}])
def test_specs_that_cannot_be(change):
    with ToyServer(spec=change) as server:
        with pytest.raises(ConsacError):
            consac.make(server.url, protocol=2)


@pytest.mark.parametrize("change", [
    {"behaviours": [{"name": "a", "agents": ["b"], "observation": box([1 << 20, 1 << 20]), "action": box([1])}]},
    {"behaviours": [{"name": f"a{i}", "agents": ["b"], "observation": box([1 << 20]), "action": box([1])} for i in range(100)]},
    {"behaviours": [{"name": "a", "agents": ["b"], "observation": box([1 << 24], "F64"), "action": box([1])}]},
    {"behaviours": [{"name": "a", "agents": ["b"], "observation": {"type": "multi_binary", "n": 1 << 40}, "action": box([1])}]},
    {"environments": 1 << 40, "behaviours": [{"name": "a", "agents": [f"b{i}" for i in range(99)], "observation": box([1]), "action": box([1])}]},
], ids=["one space", "a hundred spaces", "wide numbers", "bits", "environments"])
def test_a_small_spec_makes_no_large_arrays(change):
    tracemalloc.start()
    try:
        with ToyServer(spec=change) as server:
            with pytest.raises(ProtocolError, match="max_frame|at most"):
                consac.make(server.url, protocol=2)
        assert tracemalloc.get_traced_memory()[1] < 16 << 20
    finally:
        tracemalloc.stop()


def test_a_forgotten_environment_says_bye():
    with ToyServer() as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        del env
        until(lambda: server.log[-1][1] == wire.BYE, "BYE")


def test_an_interrupted_step_is_not_the_end():
    import _thread

    interrupted = threading.Event()

    def before(server, sock, got):
        if got.type == wire.STEP and server.connections == 1:
            _thread.interrupt_main()
            assert interrupted.wait(ENDS_S)  # the step is not over before
    with ToyServer(before=before) as server:
        env = consac.make(server.url, protocol=2)
        env.reset()
        with pytest.raises(KeyboardInterrupt):
            env.step(1)
        interrupted.set()
        until(lambda: server.steps == 1, "the interrupted step")
        assert env.step(1)[1] == server.steps == 2
        env.close()
