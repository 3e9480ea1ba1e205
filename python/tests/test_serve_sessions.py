"""consac.serve spoken to in raw frames: exactly once, resuming, who finds a place, deadlines, the end of the server."""
import errno
import json
import threading

import pytest

from consac.address import ready
from consac.serve import Limits, Server
from consac.wire import BYE, ERROR, GOAWAY, HELLO, PING, RESULT, STEP, Frame, pack
from raw_client import Raw, Result, step_payload
from toy_worlds import Counter, Failing
from waiting import ENDS_S, until


# ---- exactly once, resuming

def test_a_repeated_number_is_answered_again_and_not_carried_out(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2])
    answer = client.ask(STEP, step_payload(2, [1, 1]))
    for payload in (step_payload(2, [1, 1]), b"whatever", b""):
        assert client.ask(STEP, payload, request=client.number) == answer
    for number in (0, 1, client.number - 1, client.number + 2, 1 << 63):
        assert client.error(STEP, step_payload(2, [1, 1]), request=number)["code"] == "BAD_STATE"
    assert [row[0] for row in client.step([1, 1]).floats()] == [2, 2]
    wrong = client.ask(STEP, step_payload(2, [9, 9]))
    assert wrong.type == ERROR and client.ask(STEP, step_payload(2, [1, 1]), request=client.number) == wrong
    assert [row[0] for row in client.step([1, 1]).floats()] == [0, 0]


def test_resume_carries_a_step_out_once(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2]), client.step([1, 1])
    number = client.number + 1
    client.sock.sendall(pack(Frame(STEP, step_payload(2, [1, 1]), number, client.session)))
    assert ready(client.sock, ENDS_S)  # with an answer that is never read
    client.close()
    again = Raw(counters, hello={"resume": client.welcome["resume"]})
    assert again.welcome["resumed"] and again.welcome["session"] == client.session and again.welcome["last_request"] == number
    again.spec = client.spec
    repeated = Result(again, again.ask(STEP, step_payload(2, [1, 1]), request=number))
    assert [row[0] for row in repeated.floats()] == [2, 2]
    assert again.step([1, 1]).floats("finals")[0][0] == 3


def test_a_connection_cut_at_every_byte_of_a_step(counters):
    client = Raw(counters)
    client.reset(seeds=[1, 2])
    steps, length = 0, len(pack(Frame(STEP, step_payload(2, [1, 1]))))
    for at in range(length + 1):
        number = client.number + 1
        data = pack(Frame(STEP, step_payload(2, [1, 1]), number, client.session))
        client.sock.sendall(data[:at])
        client.close()
        again = Raw(counters, hello={"resume": client.welcome["resume"]})
        assert again.welcome["last_request"] in ((number - 1,) if at < length else (number - 1, number))
        again.spec, again.welcome = client.spec, client.welcome
        result = Result(again, again.ask(STEP, step_payload(2, [1, 1]), request=number))
        steps += 1
        assert [row[0] for row in result.floats()] == [steps % 3] * 2
        again.number, client = number, again
    client.send(BYE, request=0)


def test_resume_takes_over_from_a_connection_that_looks_alive(counters):
    client = Raw(counters)
    client.reset()
    again = Raw(counters, hello={"resume": client.welcome["resume"]})
    again.spec = client.spec
    assert again.welcome["resumed"] and client.is_closed()
    assert again.step([1, 1]).states == [16, 16]


def test_resume_is_refused_after_bye_and_after_its_time():
    with Server(Counter, 1, limits=Limits(resume_s=0.3)) as server:
        for leave in (lambda client: client.send(BYE, request=0), lambda client: client.close()):
            client = Raw(server)
            client.reset()
            leave(client)
            until(lambda: not server._sessions)
            late = Raw(server, hello={"resume": client.welcome["resume"]})
            assert late.welcome["code"] == "AUTH_FAILED" and late.welcome["severity"] == "connection" and late.is_closed()


# ---- limits and security

def test_capacity():
    with Server(Counter, 1, limits=Limits(max_sessions=2)) as server:
        a, b = Raw(server), Raw(server)
        late = Raw(server, hello=False)
        error = late.ask_json(HELLO, {"protocol": [2, 2]})
        assert (error["code"], error["severity"]) == ("CAPACITY", "connection") and error["retry_after_s"] > 0 and late.is_closed()
        a.send(BYE, request=0)
        until(lambda: len(server._sessions) == 1)
        assert Raw(server).reset().states == [24]
        assert b.reset().states == [24]


def test_a_trainer_that_vanishes_before_its_first_result_leaves_no_place_taken():
    with Server(Counter, 1, limits=Limits(max_sessions=1)) as server:
        for _ in range(3):
            client = Raw(server)
            assert "code" not in client.welcome
            client.close()
            until(lambda: not server._sessions)
        late = Raw(server, hello={"resume": client.welcome["resume"]})
        assert late.welcome["code"] == "AUTH_FAILED"
        held = Raw(server)
        held.reset()
        held.close()
        until(lambda: [session.connection for session in list(server._sessions.values())] == [None])
        assert Raw(server, hello=False).ask_json(HELLO, {"protocol": [2, 2]})["code"] == "CAPACITY"
        assert Raw(server, hello={"resume": held.welcome["resume"]}).welcome["resumed"]


def test_whoever_says_nothing_gives_way_and_whoever_finds_no_place_hears_why():
    said = []
    with Server(Counter, protocol="2", limits=Limits(max_sessions=4, handshake_s=ENDS_S), log=said.append) as server:
        served, silent = Raw(server), []
        for _ in range(60):
            silent.append(Raw(server, hello=False))
            until(lambda: not any(connection.given_up for connection in list(server._connections)))  # of too many at once some would be sent away
        for _ in range(3):
            assert Raw(server).reset().states == [24]
        assert silent[0].take().type == ERROR and silent[0].is_closed()
        assert served.reset().states == [24]
        assert any(line.startswith("127.0.0.1:") and line.endswith(" was turned away: it had said nothing, and others wait") for line in said)
    with Server(Counter, protocol="2", limits=Limits(max_sessions=1, handshake_s=ENDS_S)) as server:
        half = [Raw(server, hello=False) for _ in range(18)]
        for one in half:
            one.sock.sendall(b"\xc0")  # has spoken, and keeps its place
        until(lambda: [connection.has_spoken for connection in list(server._connections)] == [True] * 18)
        late = Raw(server, hello=False)
        late.send(HELLO, b'{"protocol":[2,2]}')
        assert json.loads(late.take().payload)["code"] == "CAPACITY" and late.is_closed()


def test_handshake_deadline():
    with Server(Counter, 1, protocol="2", limits=Limits(handshake_s=2.0)) as server:
        silent, half = Raw(server, hello=False), Raw(server, hello=False)
        half.ask_json(HELLO, {"protocol": [2, 2]})
        for client in (silent, half):
            frame = client.take()
            assert (frame.type, json.loads(frame.payload)["code"]) == (ERROR, "MALFORMED") and client.is_closed()


def test_heartbeat():
    with Server(Counter, 1, limits=Limits(heartbeat_s=0.3)) as server:
        client = Raw(server)
        client.reset()
        assert [client.take().type for _ in range(3)] == [PING] * 3
        assert client.is_closed()
        again = Raw(server, hello={"resume": client.welcome["resume"]})
        assert again.welcome["resumed"]


def test_a_long_request_is_accompanied_by_pings():
    heard = threading.Event()

    class Slow(Counter):
        def step(self, action):
            assert heard.wait(ENDS_S)
            return super().step(action)

    with Server(Slow, 1, limits=Limits(heartbeat_s=0.2)) as server:
        client = Raw(server)
        client.reset()
        client.send(STEP, step_payload(1, [1]))
        assert client.take().type == PING
        heard.set()
        while (kind := client.take().type) == PING:
            pass
        assert kind == RESULT


def test_shutting_down_says_goaway():
    server = Server(Counter, 1).start()
    client = Raw(server)
    client.reset()
    server.close(), server.close()
    assert not server._thread.is_alive() and not server._connections  # nobody was waited for in vain
    frame = client.take()
    assert frame.type == GOAWAY and json.loads(frame.payload)["reason"] and client.is_closed()
    with pytest.raises(OSError):
        Raw(server)


def test_shutting_down_answers_what_is_under_way():
    begun, go = threading.Event(), threading.Event()

    class Slow(Counter):
        def step(self, action):
            begun.set()
            assert go.wait(ENDS_S)
            return super().step(action)

    server = Server(Slow, 1).start()
    client = Raw(server)
    client.reset()
    client.send(STEP, step_payload(1, [1]))
    assert begun.wait(ENDS_S)
    connection, = server._connections
    closing = threading.Thread(target=server.close)
    closing.start()
    assert connection.closing.wait(ENDS_S)
    go.set()
    assert client.take().type == RESULT and client.take().type == GOAWAY and client.is_closed()
    closing.join()


# ---- environments that fail, are misspelt, draw, or have kinds of agents

def test_a_server_without_descriptors_or_threads_goes_on_when_there_are_some_again(monkeypatch):
    said = []
    with Server(Counter, log=said.append) as server:
        first = Raw(server)
        first.reset()
        listener, failures = server._listener, [errno.EMFILE, errno.ENFILE, errno.ECONNABORTED]

        class Failing:
            def accept(self):
                if failures:
                    raise OSError(failures.pop(), "no more of them")
                return listener.accept()

            def __getattr__(self, name):
                return getattr(listener, name)

        server._listener = Failing()
        Raw(server).close()  # by the accept() that was under way
        second = Raw(server)  # accepted once there are descriptors again
        assert not failures and sum("no more of them" in one for one in said) == 3
        start, refusals = threading.Thread.start, ["can't start new thread"]  # of its own: accept() looks at the failures

        def no_thread(thread):
            if refusals:
                raise RuntimeError(refusals.pop())
            start(thread)

        monkeypatch.setattr(threading.Thread, "start", no_thread)
        refused = Raw(server, hello=False)
        error = json.loads(refused.take().payload)
        assert error["code"] == "CAPACITY" and "can't start new thread" in error["message"] and refused.is_closed()
        for client in (first, second, Raw(server)):
            client.reset()
            assert client.step([0]).states == [16]
