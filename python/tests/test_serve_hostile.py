"""consac.serve spoken to in raw frames: bytes that are none, floods, limits, tokens."""
import json
import struct

import numpy as np
import pytest
from gymnasium import spaces

from consac import wire
from consac.serve import Limits, Server
from consac.serve.refusal import Refusals
from consac.wire import CONFIGURE, ERROR, FRAME, HELLO, RENDER, RESET, RESULT, SPEC, STEP, WELCOME, Frame, pack
from raw_client import Raw, Result, pad, reset_payload, step_payload
from toy_worlds import Counter
from waiting import ENDS_S, until


# ---- what an environment shows

@pytest.mark.parametrize("begins, why", [(b"GET / HTTP", "BAD_MAGIC: a frame begins with 'GET ', expected '\\xc0NSC'; is this protocol 2?"),
                                         (wire.pack(wire.Frame(HELLO, b'{"protocol":"2"}')), "MALFORMED: HELLO has protocol '\"2\"'; it is [lowest, highest]")])
def test_who_was_turned_away_and_why_is_one_plain_line(begins, why):
    said = []
    with Server(Counter, protocol="2", log=said.append) as server:
        client = Raw(server, hello=False)
        client.sock.sendall(begins)
        peer = "127.0.0.1:%d" % client.sock.getsockname()[1]
        client.take()
        until(lambda: said)
    assert said == [f"{peer} was turned away: {why}"]


# ---- states

def test_bad_requests_change_nothing(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2])
    for kind, payload, code in [
            (STEP, b"", "WRONG_SIZE"), (STEP, step_payload(2, [0, 0])[:-1], "WRONG_SIZE"), (STEP, step_payload(2, [0, 0, 0]), "WRONG_SIZE"),
            (STEP, step_payload(2, [0, 3]), "OUT_OF_RANGE"), (STEP, step_payload(2, [-1, 0]), "OUT_OF_RANGE"), (STEP, step_payload(2, [0, 0], [1, 2]), "OUT_OF_RANGE"),
            (RESET, b"", "WRONG_SIZE"), (RESET, reset_payload(2)[:9], "WRONG_SIZE"), (RESET, reset_payload(2, seeds=[1, 2])[:-1], "WRONG_SIZE"),
            (RESET, reset_payload(2, seeds=[1, -2]), "OUT_OF_RANGE"), (RESET, reset_payload(2) + b"\0", "WRONG_SIZE"), (RESET, reset_payload(2, options={})[:-1], "WRONG_SIZE"),
            (RESET, pad(struct.pack("<II", 2, 0) + b"\1\1") + struct.pack("<I", 1 << 31) + b"{}", "WRONG_SIZE"), (RESET, reset_payload(2, [3, 1]), "OUT_OF_RANGE"),
            (RENDER, b'{"env":0}', "UNSUPPORTED")]:
        error = client.error(kind, payload)
        assert (error["code"], error["severity"]) == (code, "request"), (kind, payload)
        assert len(error["message"]) > 20
    assert [row[0] for row in client.step([1, 1]).floats()] == [1, 1]


# ---- limits and security

def test_frames_that_are_refused(counters):
    header = lambda magic=wire.MAGIC, kind=HELLO, flags=0, length=0, crc=0, request=1, session=0, reserved=0: wire.HEADER.pack(magic, kind, flags, length, crc, request, session, reserved)
    for data, code in [(b"GET / HTTP/1.1\r\n\r\n" + bytes(40), "BAD_MAGIC"), (b"GET /", "BAD_MAGIC"), (header(flags=2), "MALFORMED"), (header(reserved=1), "MALFORMED"),
                       (header(length=4097), "FRAME_TOO_LARGE"), (header(length=0xFFFFFFFF), "FRAME_TOO_LARGE"), (header(flags=1, length=2, crc=5) + b"{}", "CRC_MISMATCH"),
                       (header(length=2) + b"[]", "MALFORMED"), (header(length=2) + b"{]", "MALFORMED"), (header(length=80) + b"[" * 80, "MALFORMED"),
                       (header(length=15) + b'{"protocol":[]}', "MALFORMED"), (header(length=18) + b'{"protocol":[3,9]}', "UNSUPPORTED_VERSION")]:
        client = Raw(counters, hello=False)
        client.sock.sendall(data)
        frame = client.take()
        error = json.loads(frame.payload)
        assert (error["code"], error["severity"], frame.request) == (code, "connection", 0 if code == "BAD_MAGIC" else 1), data
        assert client.is_closed()
    assert error["protocol"] == [2, 2]


def test_large_frames_after_welcome(counters):
    client = Raw(counters, hello={"max_frame": 8192})
    assert client.welcome["max_frame"] == 8192
    client.sock.sendall(wire.HEADER.pack(wire.MAGIC, RESET, 0, 8193, 0, 2, client.session, 0))
    frame = client.take()
    assert frame.request == 2 and json.loads(frame.payload)["code"] == "FRAME_TOO_LARGE" and client.is_closed()
    client = Raw(counters)
    options = {"map": "x" * 900_000}
    payload = pack(Frame(RESET, reset_payload(2, options=options), 2, client.session))
    for at in range(0, len(payload), 65_521):
        client.sock.sendall(payload[at:at + 65_521])
    client.number = 2
    assert Result(client, client.take()).said == {}
    assert client.step([1, 1]).states == [16, 16]


def test_a_frame_in_single_bytes(counters):
    client = Raw(counters, hello=False)
    for byte in pack(Frame(HELLO, b'{"protocol":[2,2]}', 1)):
        client.sock.sendall(bytes([byte]))
    assert client.take().type == WELCOME


def test_random_damage_never_stops_the_server(counters):
    rng = np.random.default_rng(5)
    for _ in range(60):
        client = Raw(counters)
        good = [pack(Frame(RESET, reset_payload(2, seeds=[1, 2], options={"a": [1]}), 2, client.session)), pack(Frame(STEP, step_payload(2, [1, 1]), 3, client.session)), pack(Frame(CONFIGURE, b'{"autoreset":"disabled"}', 2, client.session))]
        for _ in range(4):
            data = bytearray(good[rng.integers(3)])
            for at in rng.integers(4, len(data), rng.integers(1, 4)):
                data[at] ^= 1 << int(rng.integers(8))
            try:
                client.sock.sendall(data[:int(rng.integers(1, 2 * len(data)))])
            except ConnectionError:
                break
        client.sock.close()
    assert Raw(counters).reset().states == [24, 24]


def test_two_frames_at_once(counters):
    client = Raw(counters)
    client.sock.sendall(pack(Frame(RESET, reset_payload(2), 2, client.session)) + pack(Frame(STEP, step_payload(2, [1, 1]), 3, client.session)))
    assert [(frame.request, frame.type) for frame in (client.take(), client.take())] == [(2, RESULT), (3, RESULT)]


def test_results_too_large_for_the_client():
    class Wide(Counter):
        observation_space = spaces.Box(0, 1, (2000,), np.float32)

        def _see(self):
            return np.zeros(2000, np.float32)

    with Server(Wide, 1) as server:
        client = Raw(server, hello={"max_frame": 8192})
        assert client.spec["code"] == "UNSUPPORTED"
    with pytest.raises(ValueError, match="use fewer"):
        Server(Wide, 5000)


def test_a_claim_takes_no_memory():
    with Server(Counter, 1) as server:
        client = Raw(server)
        client.sock.sendall(wire.HEADER.pack(wire.MAGIC, RESET, 0, wire.LARGEST_FRAME, 0, 3, client.session, 0) + bytes(100_000))
        until(lambda: [len(connection.buffer) for connection in list(server._connections)] == [131072])
        held, = server._connections
        until(lambda: held.end == wire.HEADER.size + 100_000)
        assert len(held.buffer) == 131072


def test_crc(counters):
    client = Raw(counters, hello={"capabilities": ["crc"]})
    assert client.welcome["capabilities"] == ["crc"]
    client.sock.sendall(pack(Frame(RESET, reset_payload(2), 2, client.session, wire.FLAG_CRC)))
    frame = client.take()
    assert frame.type == RESULT and frame.flags == wire.FLAG_CRC


def test_token():
    with pytest.raises(ValueError, match="token"):
        Server(Counter, 1, host="0.0.0.0")
    with Server(Counter, 1, token="secret", training_length=5) as server:
        for hello, code in ((None, "AUTH_FAILED"), ({"token": "wrong"}, "AUTH_FAILED"), ({"token": 3}, "MALFORMED")):
            client = Raw(server, hello=False)
            client.sock.sendall(pack(Frame(HELLO, wire.dump_json({"protocol": [2, 2], **(hello or {})}), 1)))
            frame = client.take()
            error = json.loads(frame.payload)
            assert frame.request == 1 and error["code"] == code and "secret" not in error["message"] and client.is_closed()
        client = Raw(server, hello={"token": "secret"})
        assert client.reset().states == [24]
        client.close()


def test_a_flood_of_refused_connections_is_told_in_a_few_lines(monkeypatch):
    monkeypatch.setattr(Refusals, "EVERY_S", ENDS_S)
    said = []
    with Server(Counter, token="sesame", protocol="2", log=said.append) as server:
        for _ in range(60):
            assert Raw(server, hello=False).ask_json(HELLO, {"protocol": [2, 2]})["code"] == "AUTH_FAILED"
        until(lambda: not server._connections)
        assert len(said) == 5
    assert len(said) == 6 and said[-1].endswith("(and 54 more like it)"), said


# ---- environments that fail, are misspelt, draw, or have kinds of agents

@pytest.mark.parametrize("payload", [b'{"autoreset":' + b"7" * 5000 + b"}", b'{"a":' + b"[" * 1500 + b"]" * 1500 + b"}"], ids=["digits", "depth"])
def test_json_that_python_does_not_read_is_answered(payload, capfd):
    with Server(Counter) as server:
        client = Raw(server)
        assert client.error(CONFIGURE, payload)["code"] == "MALFORMED" and client.is_closed()
    assert "Traceback" not in capfd.readouterr().err

ODD = ["null", "-1", "1.5", "1e999", str(1 << 70), "7" * 3000, '"x"', '"\\ud800"', "[]", "{}", "[[]]", '[{"space":1}]', '[{"space":1},{"name":[],"space":{}}]', "true", '{"a":[{"space":{}}]}']


def test_requests_with_anything_in_them_are_answered(capfd):
    with Server(Counter, token="sesame", limits=Limits(max_sessions=1000)) as server:
        tried = 0
        for member in ("protocol", "client", "capabilities", "token", "resume", "max_frame"):
            for odd in ODD:
                client = Raw(server, hello=False)
                text = json.dumps({"protocol": [2, 2], "token": "sesame", member: "HERE"}).replace('"HERE"', odd)
                client.send(HELLO, text.encode())
                assert client.take().type in (WELCOME, ERROR)
                client.close()
                tried += 1
        client = Raw(server, hello={"token": "sesame", "capabilities": ["render"]})
        for kind, member in ((CONFIGURE, "autoreset"), (CONFIGURE, "expect"), (CONFIGURE, "transport"), (RENDER, "env")):
            for odd in ODD:
                try:
                    answer = client.ask(kind, f'{{"{member}":{odd}}}'.encode())
                except EOFError:
                    answer = None
                assert answer is not None and answer.type in (SPEC, ERROR, FRAME)
                if answer.type == ERROR and json.loads(answer.payload)["severity"] == "connection":
                    client = Raw(server, hello={"token": "sesame", "capabilities": ["render"]})
                tried += 1
    assert tried == 150 and "Traceback" not in capfd.readouterr().err
