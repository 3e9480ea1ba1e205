"""A small engine of its own for the tests of the client: one behaviour, random observations, and faults on demand."""
import socket
import struct
import threading

import numpy as np
from gymnasium import spaces

from consac import wire
from consac.layout import Behaviour, Layout, align

BOX8 = spaces.Box(-1, 1, (8,), np.float32)


class ToyServer:
    """Serves `sessions` at once. `fault(connection_number, sent_bytes, data)` may return fewer bytes to send, and then the connection is cut;
    `before(server, sock, frame)` runs before a frame is answered and may return True to keep silent."""

    def __init__(self, observation=BOX8, action=spaces.Discrete(2), length=10, fault=None, before=None, first=None, capacity=None, keep=True, heartbeat_s=10, spec=None, capabilities=()):
        self.observation, self.action, self.length = Layout.of(observation), Layout.of(action), length
        self.fault, self.before, self.first, self.capacity, self.keep, self.heartbeat_s, self.spec = fault, before, first, capacity, keep, heartbeat_s, spec or {}
        self.capabilities = list(capabilities)
        self.steps = 0  # carried out, over all sessions
        self.connections, self.sessions, self.log, self.errors = 0, {}, [], []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self.listener.getsockname()[1]}"
        self.open = []
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)  # wakes accept()
        self.listener.close()
        for sock in self.open:
            try:
                sock.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            sock.close()

    def _accept(self):
        while True:
            try:
                sock, _ = self.listener.accept()
            except OSError:
                return
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.connections += 1
            self.open.append(sock)
            threading.Thread(target=self._serve, args=(sock, self.connections), daemon=True).start()

    def _serve(self, sock, number):
        try:
            with sock:
                if self.first is not None:
                    sock.sendall(self.first)
                Talk(self, sock, number).run()
        except OSError:
            pass
        except Exception as error:
            self.errors.append(error)
            raise


class Talk:
    """One connection."""

    def __init__(self, server, sock, number):
        self.server, self.sock, self.number, self.sent = server, sock, number, 0
        self.session = None

    def send(self, data):
        fault = self.server.fault
        if fault is not None:
            kept = fault(self.number, self.sent, data)
            if kept is not None and len(kept) < len(data):
                self.sock.sendall(kept)
                self.sock.shutdown(socket.SHUT_RDWR)
                raise ConnectionError("cut on purpose")
        self.sock.sendall(data)
        self.sent += len(data)

    def run(self):
        reader = wire.FrameReader(wire.LARGEST_FRAME)
        while True:
            frame = reader.next()
            if frame is None:
                data = self.sock.recv(65536)
                if not data:
                    return
                reader.feed(data)
                continue
            self.server.log.append((self.number, frame.type, frame.request))
            if self.server.before is not None and self.server.before(self.server, self.sock, frame):
                continue
            if frame.type == wire.BYE:
                self.server.sessions.pop(self.session["number"], None)
                return
            if frame.type == wire.HELLO:
                self.hello(wire.load_json(frame.payload))
            elif frame.type == wire.PING:
                self.send(wire.pack(wire.Frame(wire.PONG, frame.payload)))
            elif frame.type != wire.PONG:
                self.request(frame)

    def error(self, request, code, severity="request"):
        return wire.pack(wire.Frame(wire.ERROR, wire.dump_json({"code": code, "severity": severity, "message": "no"}), request))

    def hello(self, hello):
        sessions = self.server.sessions
        if hello.get("resume"):
            self.session = sessions.get(int(hello["resume"])) if self.server.keep else None
            if self.session is None:
                return self.send(self.error(0, "AUTH_FAILED", "connection"))
        elif self.server.capacity is not None and len(sessions) >= self.server.capacity:
            return self.send(self.error(0, "CAPACITY", "connection"))
        else:
            number = len(self.server.log) + 1
            self.session = sessions[number] = {"number": number, "last": 0, "answer": b"", "rng": np.random.default_rng(0), "steps": 0, "begun": False}
        self.send(wire.pack(wire.Frame(wire.WELCOME, wire.dump_json(
            {"protocol": 2, "server": "toy", "session": self.session["number"], "resume": str(self.session["number"]), "capabilities": self.server.capabilities, "max_frame": hello["max_frame"],
             "heartbeat_s": self.server.heartbeat_s, "last_request": self.session["last"], "resumed": "resume" in hello}), 0, self.session["number"])))

    def request(self, frame):
        session = self.session
        if frame.request == session["last"] + 1:
            session["last"], session["answer"] = frame.request, self.answer(frame)
        elif frame.request != session["last"]:
            return self.send(self.error(frame.request, "BAD_STATE"))
        self.send(session["answer"])

    def answer(self, frame):
        server, session = self.server, self.session
        if frame.type == wire.CONFIGURE:
            session["autoreset"] = wire.load_json(frame.payload).get("autoreset", "same_step")
            behaviour = Behaviour("default", ["agent"], server.observation, server.action, 1).to_json()
            spec = {"id": "toy", "environments": 1, "max_episode_steps": 0, "autoreset": session["autoreset"], "deterministic": True, "behaviours": [behaviour]} | server.spec
            return wire.pack(wire.Frame(wire.SPEC, wire.dump_json(spec), frame.request, session["number"]))
        if frame.type == wire.RESET:
            flags, = struct.unpack_from("<I", frame.payload)
            if flags & wire.WITH_SEEDS:
                session["rng"] = np.random.default_rng(struct.unpack_from("<q", frame.payload, 16)[0])
            session["steps"], session["begun"] = 0, True
            return self.result(frame.request, 0.0, wire.FIRST | wire.ACTIVE)
        if not session["begun"]:
            return self.error(frame.request, "BAD_STATE")
        server.steps += 1
        session["steps"] += 1
        return self.result(frame.request, float(session["steps"]), wire.ACTIVE | (wire.TERMINATED if session["steps"] == server.length else 0))

    def result(self, request, reward, state):
        layout = self.server.observation
        layout.space.seed(int(self.session["rng"].integers(1 << 31)))
        value = layout.space.sample()
        row = np.zeros(align(layout.row_bytes), np.uint8)
        for view, leaf in zip(layout.views(row, 1, 0), layout.leaves):
            view[0] = layout.pick(value, leaf)
        payload = struct.pack("<II", 0, 0) + row.tobytes() + struct.pack("<dB7x", reward, state)
        return wire.pack(wire.Frame(wire.RESULT, payload, request, self.session["number"]))
