"""Hostile engines against `consac train` and `consac doctor`."""
from __future__ import annotations

import random
import socket
import threading
import time

from judge import ESCAPES, FAKE_LINE, MARK, Arena, Ended, Limits, Running
from mutate import NASTY_TEXTS, nasty, spoil_bytes, spoil_json
import wire

DEADLINE_S = 2  # of the trainer's patience with us


class Engine(threading.Thread):
    """Serves connections on a port of its own until stopped, each spoilt at one place that the generator chooses."""

    def __init__(self, rng: random.Random):
        super().__init__(daemon=True)
        self._rng = rng
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(0.2)
        self.port = self._listener.getsockname()[1]
        self.stopped = threading.Event()
        self.behaviours, self.environments = rng.choice([1, 1, 2, 3]), rng.choice([1, 2, 40])
        self.spec = wire.spec(self.behaviours, self.environments, rng.choice([0, 60, 200]))
        self.stage = rng.choice(["welcome", "spec", "spec", "spec", "result", "result", "step", "names", "error", "flood", "text1", "text1"])

    def run(self):
        while not self.stopped.is_set():
            try:
                connection, _ = self._listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            peer = wire.Peer(connection, 3.0)
            try:
                self._serve_text(peer) if self.stage == "text1" else self._serve(peer)
            except (OSError, ConnectionError, KeyError, ValueError):
                pass
            finally:
                peer.close()

    def stop(self):
        self.stopped.set()
        self._listener.close()
        self.join(10)

    def _say(self, peer: wire.Peer, stage: str, kind: int, value, **header) -> None:
        """Sends a message; spoilt where `stage` is the one to spoil."""
        rng = self._rng
        if stage != self.stage:
            return peer.send(wire.message(kind, value, **header))
        way = rng.random()
        if way < 0.6:
            payload = spoil_json(rng, value) if not isinstance(value, bytes) else spoil_bytes(rng, value)
            return peer.send(wire.message(kind, payload, **header))
        whole = wire.message(kind, value, **header)
        if way < 0.85:
            return peer.send(spoil_bytes(rng, whole))
        if way < 0.92:
            return peer.send(whole[:rng.randrange(len(whole))]) or time.sleep(rng.choice([0, DEADLINE_S + 1]))
        header["request"] = rng.choice([0, 7, 2**63])
        return peer.send(wire.message(rng.choice([kind, 200, 0x9000]), value, **header))

    def _names(self) -> None:
        for behaviour in self.spec["behaviours"]:
            behaviour["name"] = self._rng.choice(NASTY_TEXTS[1:])
        if self._rng.random() < 0.5:
            self.spec["id"] = self._rng.choice(NASTY_TEXTS)
        if self._rng.random() < 0.3:
            self.spec["model_name"], self.spec["training_length"] = self._rng.choice(NASTY_TEXTS), 0

    def _serve(self, peer: wire.Peer) -> None:
        rng = self._rng
        if self.stage == "names":
            self._names()
        kind, _, _, _ = peer.next()
        if self.stage == "error":
            text = rng.choice([FAKE_LINE, ESCAPES, MARK * 30_000, "\ud800"])
            return peer.send(wire.message(rng.choice([wire.ERROR, wire.GOAWAY]), {"code": rng.choice(["BAD_STATE", text]), "message": text, "reason": text,
                                                                                  "severity": "connection", "retry_after_s": nasty(rng)}))
        self._say(peer, "welcome", wire.WELCOME, {"protocol": 2, "server": "hostile " + rng.choice(["", FAKE_LINE, ESCAPES]), "session": 1, "resume": "r" * 32,
                  "capabilities": [], "max_frame": 1 << 26, "heartbeat_s": 10, "last_request": 0, "resumed": False}, session=1)
        while True:
            kind, request, session, _ = peer.next()
            if kind == wire.CONFIGURE:
                self._say(peer, "spec", wire.SPEC, self.spec, request=request, session=1)
            elif kind in (wire.RESET, wire.STEP):
                if self.stage == "flood":
                    for _ in range(2000):
                        peer.send(wire.frame(rng.choice([wire.PING, 0x9abc]), b"x" * 64, session=1))
                    time.sleep(DEADLINE_S + 1)
                payload = wire.result(rng, self.behaviours, self.environments, kind == wire.RESET)
                self._say(peer, "result" if kind == wire.RESET or rng.random() < 0.1 else "step", wire.RESULT, payload, request=request, session=1)
            elif kind == wire.BYE:
                return

    def _serve_text(self, peer: wire.Peer) -> None:
        rng = self._rng
        setup = rng.choice(["D#3#0#B#2#0,0,40,40#60", "B#1#-1,1#B#2#0,0,40,40#60", "D#3#0#B#2#0,0,40,40#0#model"])
        observations = ["1,2#0.5#0", "3,4#1#1", "nan,1#0#0", "1,2#inf#0", "1,2,3#0#0", "1;2#0#0", "#", "", "1,2#0#7", "9" * 400 + ",1#0#0", FAKE_LINE, ESCAPES, "1,2#1,5#0"]
        text = setup if rng.random() < 0.5 else spoil_bytes(rng, setup.encode()).decode("latin-1")
        if rng.random() < 0.1:
            text = "D#3#0#B#2#0,0,40,40#0#" + rng.choice(NASTY_TEXTS)
        peer.send((text + "\n").encode("utf-8", "surrogatepass"))
        for step in range(80):
            spoilt = rng.random() < 0.1
            peer.send(((rng.choice(observations) if spoilt else "1,2#0.5#0") + rng.choice(["\n", "\n", "\r\n"])).encode())
            if not peer.connection.recv(4096):
                return


def experiment(program: str, arena: Arena, rng: random.Random) -> Ended:
    engine = Engine(rng)
    engine.start()
    url = f"tcp://127.0.0.1:{engine.port}"
    verb = ["train", url, "--name", "r", "--steps", "200", "--set", "n_steps=16", "nminibatches=1", "--deadline", str(DEADLINE_S), "--connect-timeout", "2"]
    if rng.random() < 0.3:
        verb += ["--json"]
    if rng.random() < 0.1:
        verb = ["doctor", url]
    ended = Running([program, *verb], arena).end(Limits(seconds=60 if verb[0] == "doctor" else 30))
    engine.stop()
    for model in [*(arena.home / "runs").glob("*/*.consac")]:
        loaded = Running([program, "inspect", str(model)], arena).end(Limits())
        if loaded.code != 0:
            ended.findings.append(f"{model.name} was saved and does not load: {loaded.output[-200:]!r}")
    return ended
