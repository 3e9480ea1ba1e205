"""consac doctor before engines and trainers that are wrong: each is told so by name, with what was sent and what was expected."""
import contextlib
import dataclasses
import signal
import socket
import struct
import subprocess
import threading
import time

import gymnasium
import pytest

from consac import wire
from consac.layout import align
from consac.serve import Refused, Server
from consac.serve.batch import Batch
from program import PROGRAM, catches, needs_program, run
from waiting import ENDS_S, until



def nobody_is_ever_said(monkeypatch):
    """State 16 is forgotten."""
    result = Batch.result

    def forgetful(batch, *arguments):
        for rows in batch.parts:
            rows.states[:] = 0
            rows.rewards[:] = 0
        return result(batch, *arguments)
    monkeypatch.setattr(Batch, "result", forgetful)


@needs_program
def test_an_engine_that_forgets_state_16_is_told_so_by_name(monkeypatch):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=1) as server:
        nobody_is_ever_said(monkeypatch)
        with subprocess.Popen([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"], stdout=subprocess.PIPE, text=True) as doctor:
            said = []
            while not (said and "state 16" in said[-1]):
                said.append(doctor.stdout.readline())
                assert said[-1], said
            doctor.kill()
    assert "nobody takes part: state 16 has been set for no slot for 10 s (R77)" in said[-1]


def judges_every_seed(monkeypatch, server):
    """Those of environments that are not reset too."""
    reset = Batch.reset

    def judging(batch, payload):
        count, at = len(batch.envs), align(8 + len(batch.envs))
        if len(payload) >= at + 8 * count and payload[0] & wire.WITH_SEEDS and min(struct.unpack_from(f"<{count}q", payload, at)) < 0:
            raise Refused("OUT_OF_RANGE", "a negative seed", env=0)
        return reset(batch, payload)
    monkeypatch.setattr(Batch, "reset", judging)


def looks_at_padding(monkeypatch, server):
    step = Batch.step

    def looking(batch, payload):
        if any(payload[8 + len(batch.envs):align(8 + len(batch.envs))]):
            raise Refused("MALFORMED", "padding that is not 0")
        return step(batch, payload)
    monkeypatch.setattr(Batch, "step", looking)


def says_a_limit_of_3000(monkeypatch, server):
    server.limits = dataclasses.replace(server.limits, max_frame=3000)


@needs_program
@pytest.mark.parametrize("engine, fails", [(judges_every_seed, "a negative seed of an environment that is not reset (R43 R47)"), (looks_at_padding, "padding of RESET, of its options and of STEP that is not 0 (R41)"),
                                           (says_a_limit_of_3000, "no limit is below 4096, nor above 2^26 (R22)")])
def test_a_wrong_engine_fails_the_case_of_its_fault_with_what_was_sent(engine, fails, monkeypatch):
    with Server(lambda: gymnasium.make("CartPole-v1"), envs=3) as server:
        engine(monkeypatch, server)
        done = run([PROGRAM, "doctor", "--conformance", f"tcp://127.0.0.1:{server.port}"])
    assert done.returncode == 3, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    at = lines.index(f"FAILS        {fails}")
    assert lines[at + 2].strip().startswith("at step ") and '"expect"' in lines[at + 2] and lines[at + 3].strip().startswith('after {"send"'), lines[at:at + 4]
    assert "spec/conformance/protocol2/README.md" in lines[-1]


@contextlib.contextmanager
def scripted(answer):
    """A port where everybody's frames are answered by `answer`(write, type, request), and none otherwise."""
    def serve(sock):
        reader = wire.FrameReader(wire.LARGEST_FRAME)
        write = lambda kind, request=0, payload=b"": sock.sendall(wire.pack(wire.Frame(kind, payload, request, 5)))
        with sock, contextlib.suppress(OSError, wire.WireError):
            while data := sock.recv(65536):
                reader.feed(data)
                while frame := reader.next():
                    answer(write, frame.type, frame.request)

    def accept():
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=serve, args=(listener.accept()[0],), daemon=True).start()

    with socket.create_server(("127.0.0.1", 0)) as listener:
        threading.Thread(target=accept, daemon=True).start()
        yield f"tcp://127.0.0.1:{listener.getsockname()[1]}"
        listener.shutdown(socket.SHUT_RDWR)


def welcomes(write, kind, request):
    if kind == wire.HELLO:
        write(wire.WELCOME, 0, wire.dump_json({"protocol": 2, "session": 5, "resume": "", "capabilities": [], "max_frame": wire.LARGEST_FRAME}))


def pauses_for_ever(write, kind, request):
    welcomes(write, kind, request)
    if kind == wire.CONFIGURE:
        write(wire.PAUSED)


def pings_for_ever(write, kind, request):
    if kind in (wire.HELLO, wire.PONG):
        time.sleep(0.01)
        write(wire.PING, 0, b"still there")


@needs_program
@pytest.mark.parametrize("answer, said", [(pauses_for_ever, "no answer within 0.05 s: the server says PAUSED and no RESUMED"), (pings_for_ever, "no answer within 0.05 s"),
                                          (lambda *_: None, "no answer within 0.05 s")])
def test_no_server_holds_the_doctor_up(answer, said):
    """Neither by a pause that nobody ends, nor by PINGs, nor by silence; --timeout says how long an answer may take."""
    with scripted(answer) as url:
        done = run([PROGRAM, "doctor", "--conformance", url, "--timeout", "0.05"])
    assert done.returncode == 3 and said in done.stdout, done.stdout + done.stderr


@needs_program
def test_what_the_doctor_is_asked_is_what_it_does():
    """One examination at a time; its advice names its own flag; signals that end it leave one exit code."""
    for both in (["tcp://127.0.0.1:1", "--conformance", "tcp://127.0.0.1:2"], ["--conformance", "tcp://127.0.0.1:1", "--conformance-trainer", "tcp://127.0.0.1:2"]):
        done = run([PROGRAM, "doctor", *both])
        assert done.returncode == 2 and "one examination at a time" in done.stderr and done.stderr.count("\n") == 1, done.stderr
    with scripted(welcomes) as url:
        done = run([PROGRAM, "doctor", url, "--timeout", "0.3"])
    assert done.returncode == 3 and "raise --timeout" in done.stderr, done.stderr
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        with subprocess.Popen([PROGRAM, "doctor", "--conformance-trainer", "tcp://127.0.0.1:0", "--timeout", "30"], stdout=subprocess.PIPE, text=True) as doctor:
            assert "listening" in doctor.stdout.readline()
            doctor.send_signal(number)
            assert doctor.wait(ENDS_S) == 130, number
    with subprocess.Popen([PROGRAM, "bench", "--only", "cartpole", "--repeats", "100"], stdout=subprocess.DEVNULL) as bench:
        until(lambda: catches(bench, signal.SIGTERM), "the handler of SIGTERM")
        bench.terminate()
        assert bench.wait(ENDS_S) == 130
