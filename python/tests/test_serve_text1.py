"""consac.serve and trainers of text protocol 1."""
import os
import socket
import time
from dataclasses import replace

import pytest

from consac.client import connect
from consac.serve import Limits, Server
from consac.serve.limits import TICK
from consac.wire import BYE, HELLO
from raw_client import PATIENT, Raw, Text
from toy_worlds import Counter, Nested
from waiting import ENDS_S, until

try:
    import resource
except ImportError:  # Windows
    resource = None


# ---- what an environment shows

def test_ends_after_the_wanted_sessions_in_which_a_trainer_has_stepped():
    with Server(Counter, 1, sessions=2, training_length=9, limits=PATIENT) as server:
        Raw(server, hello=False).sock.close()  # a port scanner
        Raw(server).send(BYE, request=0)
        only_reset = Raw(server)
        only_reset.reset(), only_reset.send(BYE, request=0)
        mute = Text(server)
        mute.line(), mute.line(), mute.sock.shutdown(socket.SHUT_RDWR)
        until(lambda: server._text_holder is None)
        stepped = Raw(server)
        stepped.reset(), stepped.step([1]), stepped.send(BYE, request=0)
        until(lambda: server._finished == 1)
        server._thread.join(3 * TICK)
        assert server._thread.is_alive()
        text = Text(server)
        text.line(), text.line(), text.ask("1\n"), text.sock.shutdown(socket.SHUT_RDWR)
        server._thread.join(ENDS_S)
        assert not server._thread.is_alive()


# ---- limits and security

def test_a_silent_trainer_of_text_protocol_1_gives_its_place_to_another():
    with Server(Counter, protocol="text1", training_length=9, limits=Limits(grace_s=ENDS_S, handshake_s=0.1)) as server:
        silent = Text(server)
        assert silent.line()
        time.sleep(0.5)  # five handshakes; after four it may be sent away
        server.limits = replace(server.limits, grace_s=5)
        other = Text(server)
        assert other.line().startswith("D#3#0#B") and other.line() and other.ask("1\n")


@pytest.mark.skipif(resource is None, reason="no limits on descriptors here")
def test_descriptors_of_any_number_serve_both_ends():
    """select() takes none above 1023."""
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    if before[1] != resource.RLIM_INFINITY and before[1] < 2048:
        pytest.skip("at most 2048 descriptors")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(2048, before[0]), before[1]))
    held = [os.open(os.devnull, os.O_RDONLY)]
    try:
        while held[-1] < 1100:
            held.append(os.dup(held[0]))
        with Server(Counter, training_length=9, limits=PATIENT) as server:
            with connect(f"tcp://127.0.0.1:{server.port}", shared_memory=False) as client:
                assert client._socket.fileno() > 1023
                client.reset()
                client.step()
                client._idle()
            server.limits = replace(server.limits, grace_s=0.02)
            text = connect(f"tcp://127.0.0.1:{server.port}", protocol="text1")
            text.close()
    finally:
        for descriptor in held:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_a_bad_action_of_text_protocol_1_is_one_line():
    said = []
    with Server(Counter, protocol="text1", training_length=9, log=said.append) as server:
        text = Text(server)
        text.line(), text.line()
        assert text.ask("1\0\n").startswith("error: action '1\\x00'") and text.line() == ""
        until(lambda: said)
    assert len(said) == 1 and said[0].startswith("text protocol 1, 127.0.0.1:") and ": action '1" in said[0], said


# ---- text protocol 1

def test_text_fallback():
    with Server(Counter, 4, training_length=6, model_name="walker", seed=1, limits=PATIENT) as server:
        text = Text(server)
        assert text.line() == "D#3#0#B#2#0,0,1000,1000#6#walker"
        mark = text.line().split("#")[0].split(",")[1]
        assert text.ask("1\n") == f"1,{mark}#0.1#0"
        late = Text(server)
        assert late.line().startswith("busy: ") and late.line() == ""
        assert text.ask("1") == f"2,{mark}#0.2#0"
        assert text.ask("2\r\n") == f"3,{mark}#{0.1 * 3!r}#1"
        assert text.line().endswith("#0#0")
        modern = Raw(server)
        assert modern.reset().states == [24] * 4 and modern.spec["training_length"] == 6 and modern.spec["model_name"] == "walker"
        assert text.ask("7\n").startswith("error: action '7'") and text.line() == ""


def test_text_boxes():
    with Server("Pendulum-v1", 1, protocol="text1", training_length=9) as server:
        text = Text(server)
        assert text.line() == "B#1#-2,2#B#3#-1,-1,-8,1,1,8#9"
        assert len(text.line().split(",")) == 3
        assert text.ask("0.5").endswith("#0") and text.ask("99\n").endswith("#0")
        assert text.ask("nan\n").startswith("error: ")


def test_text_is_not_served_where_it_does_not_fit():
    with pytest.raises(ValueError, match="training length"):
        Server(Counter, 1, protocol="text1")
    said = []
    with Server(Nested, 1, training_length=9, limits=Limits(grace_s=0.05), log=said.append) as server:
        client = Raw(server, hello=False)
        until(lambda: any("says nothing" in line for line in said))
        assert client.ask_json(HELLO, {"protocol": [2, 2]})["protocol"] == 2


# ---- environments that fail, are misspelt, draw, or have kinds of agents

def test_a_flood_of_empty_lines_does_not_defeat_the_deadline_of_text_protocol_1():
    said = []
    with Server(Counter, protocol="text1", training_length=9, limits=Limits(text_s=0.3), log=said.append) as server:
        text = Text(server)
        text.line(), text.line()
        begun = time.monotonic()
        with pytest.raises(ConnectionError):
            while time.monotonic() - begun < ENDS_S:
                text.sock.sendall(b"\n" * 10_000)
