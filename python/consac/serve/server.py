"""Listens, lets trainers in and keeps their sessions, each with a thread of its own."""
from __future__ import annotations

import errno
import hmac
import socket
import threading
import time
from dataclasses import replace

from consac import __version__, shared_memory, wire
from consac.address import is_here, is_loopback
from consac.extras import Parameter
from consac.names import printable_line, quote
from consac.wire import WireError

from . import text1
from .batch import Batch
from .connection import Connection
from .limits import TICK, Limits
from .refusal import FAILURES, Gone, Refusals, Refused, error_json
from .session import Offer, Session
from .world import World, environment_maker


# Why accept() may fail for a while: too many open files, here or on the machine, no memory, a peer that has left already.
_PASSING = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM, errno.ECONNABORTED, errno.EINTR)

_TEXT_BUSY = b"busy: this engine serves another trainer; try again later\n"
_SILENT_HANDSHAKES = 4  # so many handshake deadlines a trainer of text protocol 1 that has never said anything keeps its place


def _same_secret(given, secret: str) -> bool:
    """Compared in a time that does not tell where they differ."""
    return hmac.compare_digest(str(given).encode("utf-8", "surrogatepass"), secret.encode())


class Server:
    """Serves environments from `make_env`, a callable, or a Gymnasium id, on `host`:`port` (0: a free one).

    `group`: which of several agents are one behaviour and so share a policy: those of one "kind" (a name, and a number behind it) or of equal "spaces".
    `parameters`: what a trainer may set; the environment finds their values in reset(options=...), by name. `statistics`: numbers of infos that go into the
    trainer's log, by name.
    `log` takes lines; the traceback of an environment that fails is among them."""

    def __init__(self, make_env, envs: int = 1, *, host: str = "127.0.0.1", port: int = 0, token: str = "", protocol: str = "auto",
                 training_length: int = 0, model_name: str = "", seed: int | None = None, sessions: int = 0, name: str = "", group: str = "kind",
                 parameters: list[Parameter] = (), statistics: list[str] = (), limits: Limits = Limits(), log=None):
        if protocol not in ("auto", "text1", "2"):
            raise ValueError(f"protocol {protocol!r}; it is auto, text1 or 2")
        if not token and not is_loopback(host):
            raise ValueError(f"{host} can be reached from other machines, so an access token is needed: set --token, or bind 127.0.0.1")
        if envs < 1 or training_length < 0 or sessions < 0:
            raise ValueError(f"envs {envs}, training length {training_length}, sessions {sessions}; envs is 1 or more, the others 0 or more")
        self.make_env = environment_maker(make_env) if isinstance(make_env, str) else make_env
        self.token, self.protocol, self.limits, self.sessions_wanted = token, protocol, limits, sessions
        self._log = (lambda line: log(printable_line(line))) if log else lambda line: None
        self._refusals, self._failures = Refusals(self._log), Refusals(self._log)
        self.world = World.probe(self.make_env, envs, name, group, parameters, statistics)
        self._offer = Offer(self.world, self.make_env, seed, training_length, model_name, self._log, self._failures)
        self.text_misfit = text1.misfit(self._offer) if not token else "it has no access token"
        if protocol == "text1" and self.text_misfit:
            raise ValueError(f"text protocol 1 cannot carry this: {self.text_misfit}")
        largest = max(Batch.largest_result(self.world), Batch.step_bytes(self.world))
        if limits.max_frame < wire.LARGEST_BEFORE_WELCOME:  # as a client's counts (R22)
            self.limits = limits = replace(limits, max_frame=wire.LARGEST_BEFORE_WELCOME)
        if largest > limits.max_frame:
            raise ValueError(f"{envs} environments make frames of {largest} bytes, over {limits.max_frame}; use fewer of them")
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._listener = socket.create_server((host, port), family=family, backlog=64)
        self._listener.settimeout(TICK)
        self.host, self.port = host, self._listener.getsockname()[1]
        self._lock = threading.Lock()
        self._sessions: dict[int, Session] = {}
        self._connections: dict[Connection, threading.Thread] = {}
        self._next_session, self._finished = 1, 0
        self._text_lock = threading.Lock()  # held by the one trainer of text protocol 1
        self._text_holder: Connection | None = None
        self._turning_away = threading.Semaphore(16)  # so many threads at most say goodbye at once
        self._ending = False
        self._thread: threading.Thread | None = None

    def start(self) -> "Server":
        """Serves from a thread of its own."""
        self._thread = threading.Thread(target=self.run, name=f"consac-serve-{self.port}", daemon=True)
        self._thread.start()
        return self

    def run(self) -> None:
        """Serves until `close`, or until the wanted number of sessions is over."""
        while not self._ending:
            try:
                sock, _ = self._listener.accept()
            except (TimeoutError, socket.timeout):
                self._forget_lost()
                self._refusals.look()
                self._failures.look()
                for connection in list(self._connections):
                    connection.reassure()
                if self.sessions_wanted and self._finished >= self.sessions_wanted:
                    self.end()
                continue
            except OSError as error:
                if error.errno not in _PASSING:
                    break
                self._refusals.say(f"no connection can be taken now: {error.strerror}")
                time.sleep(TICK)
                continue
            try:
                connection = Connection(sock, self.limits)
            except OSError:  # it is gone already
                sock.close()
                continue
            if not self._has_room():
                self._turn_away(connection)
                continue
            thread = threading.Thread(target=self._serve, args=(connection,), daemon=True)
            with self._lock:
                self._connections[connection] = thread
            try:
                thread.start()
            except RuntimeError as error:
                with self._lock:
                    del self._connections[connection]
                connection.last_word(connection.pack(wire.ERROR, error_json("CAPACITY", f"no further connection can be served now: {error}", retry_after_s=10)))
                sock.close()
                self._refusals.say(f"no connection can be served now: {error}")
        self._shut_down()

    def _has_room(self) -> bool:
        """Whether another connection may be served. Of too many the one that has been silent the longest makes room."""
        most = 2 * self.limits.max_sessions + 16
        with self._lock:
            staying = [connection for connection in self._connections if not connection.given_up]
            leaving = len(self._connections) - len(staying)
        if len(staying) < most or leaving >= most:
            return len(staying) < most
        silent = min((connection for connection in staying if connection.is_silent()), key=lambda connection: connection.since, default=None)
        if silent is not None:
            silent.give_up(self._busy(silent, "others wait, and this connection says nothing"))
            self._refusals.say(f"{silent.peer} was turned away: it had said nothing, and others wait")
        return silent is not None

    def _turn_away(self, connection: Connection) -> None:
        """Its peer may have begun to speak, and hears why all the same; in a flood there is not the time for it."""
        self._refusals.say(f"{connection.peer} was turned away: all places are taken")
        if not self._turning_away.acquire(blocking=False):
            connection.sock.close()
            return

        def finish() -> None:
            try:
                connection.last_word(self._busy(connection, "all places are taken"))
                connection.finish()
            finally:
                self._turning_away.release()
        try:
            threading.Thread(target=finish, daemon=True).start()
        except RuntimeError:
            connection.sock.close()
            self._turning_away.release()

    def _busy(self, connection: Connection, why: str) -> bytes:
        if self.protocol == "text1":
            return _TEXT_BUSY
        return connection.pack(wire.ERROR, error_json("CAPACITY", f"no further connection can be served now: {why}", retry_after_s=10))

    def end(self) -> None:
        """`run` ends soon. Takes no lock: a signal's handler calls it, perhaps in the midst of whoever holds one."""
        self._ending = True

    def close(self) -> None:
        """Answers what is under way, says GOAWAY and closes; more than once does no harm."""
        self.end()
        try:
            self._listener.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(5)
        elif self._thread is None:
            self._shut_down()

    def __enter__(self) -> "Server":
        return self if self._thread is not None else self.start()

    def __exit__(self, *_) -> None:
        self.close()

    def _shut_down(self) -> None:
        self._listener.close()
        with self._lock:
            connections = list(self._connections.items())
        for connection, _ in connections:
            connection.closing.set()
            try:
                connection.sock.shutdown(socket.SHUT_RD)
            except OSError:
                pass
        deadline = time.monotonic() + 2
        for _, thread in connections:
            thread.join(max(0, deadline - time.monotonic()))
        with self._lock:
            left, self._sessions = list(self._sessions.values()), {}
        for session in left:
            if session.batch and session.lock.acquire(timeout=0.1):
                session.batch.close()
        self._refusals.look(last=True)
        self._failures.look(last=True)

    def _forget_lost(self) -> None:
        now = time.monotonic()
        with self._lock:
            lost = [session for session in self._sessions.values() if session.connection is None and now - session.lost_at > self.limits.resume_s]
            for session in lost:
                del self._sessions[session.number]
        for session in lost:
            self._end(session, "was not taken up again")

    def _end(self, session: Session, why: str) -> None:
        with self._lock:
            self._sessions.pop(session.number, None)
            self._finished += session.stepped
        if session.batch:
            session.batch.close()
        (self._log if session.stepped else self._refusals.say)(f"session {session.number} {why}")

    # -- one connection

    def _serve(self, connection: Connection) -> None:
        session = None
        try:
            if self.protocol == "text1" or self._hears_nothing(connection):
                self._serve_text(connection)
                return
            session = self._shake_hands(connection)
            if session is not None:
                session.serve(connection, lambda: self._look(connection, session.deadline))
                self._end(session, "said BYE")
        except (WireError, Refused) as error:
            refused = getattr(error, "request", None)  # of a header; else of what was being carried out
            connection.last_word(connection.pack(wire.ERROR, error_json(error.code, error.message, **getattr(error, "extra", {})),
                                                        connection.request if refused is None else refused, session=session.number if session else 0))
            self._refusals.say(f"{connection.peer} was turned away: {error}" if session is None else f"session {session.number}: {connection.peer} was turned away: {error}")
            if session is not None and session.started and error.code != "CRC_MISMATCH":  # which is a loss (R24)
                self._end(session, "was refused")
        except Gone as error:
            if connection.closing.is_set():
                connection.last_word(connection.pack(wire.GOAWAY, wire.dump_json({"reason": "the server shuts down"}),
                                                            session=session.number if session else 0))
            elif session and session.started:
                self._refusals.say(f"session {session.number}: {connection.peer}: {error}; it can be resumed for {self.limits.resume_s:g} s")
        finally:
            connection.finish()
            if session is not None:
                self._detach(connection, session)
            with self._lock:
                self._connections.pop(connection, None)

    def _serve_text(self, connection: Connection) -> None:
        if not self._text_lock.acquire(timeout=self.limits.grace_s):  # a trainer that just closed may be coming back
            holder = self._text_holder
            if holder is None or not holder.is_silent() or time.monotonic() - holder.since < _SILENT_HANDSHAKES * self.limits.handshake_s:
                connection.last_word(_TEXT_BUSY)
                return
            holder.give_up()
            if not self._text_lock.acquire(timeout=self.limits.grace_s + 2 * TICK):
                connection.last_word(_TEXT_BUSY)
                return
        env = None
        self._text_holder = connection
        try:
            env = self.make_env()
            text1.play(connection, self._offer, self.limits, env)
        except Gone as error:
            self._refusals.say(f"text protocol 1, {connection.peer}: {error}")
        except text1.BadAction as error:
            connection.last_word(f"error: {printable_line(error)}\n".encode())
            self._refusals.say(f"text protocol 1, {connection.peer}: {error}")
        except FAILURES as error:
            connection.last_word(f"error: {printable_line(error)}\n".encode())
            self._failures.tell(error)
        finally:
            self._text_holder = None
            self._text_lock.release()
            if env is not None:
                env.close()
            with self._lock:
                self._finished += connection.stepped

    def _detach(self, connection: Connection, session: Session) -> None:
        """A session that has not answered a first RESET cannot be gone on with (R24): its place is free at once."""
        over = False
        with self._lock:
            if session.connection is connection:
                session.connection, session.lost_at = None, time.monotonic()
                over = not session.started and self._sessions.pop(session.number, None) is not None
        session.lock.release()
        if over and session.batch:
            session.batch.close()

    def _hears_nothing(self, connection: Connection) -> bool:
        if self.protocol == "2":
            return False
        if connection.wait(self.limits.grace_s):
            return False
        if self.text_misfit:
            self._refusals.say(f"{connection.peer} says nothing; text protocol 1 is not served: {self.text_misfit}")
        return not self.text_misfit

    def _look(self, connection: Connection, deadline: float | None) -> None:
        if connection.closing.is_set():
            raise Gone("the server shuts down")
        if deadline is not None and time.monotonic() > deadline:
            raise WireError("MALFORMED", f"no HELLO and CONFIGURE within {self.limits.handshake_s:g} s", 0)
        if deadline is None:
            connection.heartbeat()

    def _shake_hands(self, connection: Connection) -> Session | None:
        """Everything up to WELCOME; the session is then this thread's."""
        deadline = time.monotonic() + self.limits.handshake_s
        while True:
            connection.request = 0
            kind, request, _, payload = connection.read(lambda: self._look(connection, deadline))
            self._check_deadline(connection, deadline)
            connection.request = request
            if kind == wire.HELLO:
                session = self._welcome(connection, wire.load_json(payload))
                session.deadline = None if session.configured else deadline
                return session
            if kind == wire.BYE:
                return None
            if kind == wire.PING or not connection.aside(kind, payload, 0):
                raise Refused("BAD_STATE", f"a frame of type {kind} before HELLO; send HELLO first", severity="connection")

    def _check_deadline(self, connection: Connection, deadline: float) -> None:
        if time.monotonic() > deadline:
            self._look(connection, deadline)

    def _welcome(self, connection: Connection, hello: dict) -> Session:
        versions = hello.get("protocol")
        if not (isinstance(versions, list) and len(versions) == 2 and all(type(version) is int and abs(version) <= wire.LARGEST_WHOLE for version in versions)):
            raise WireError("MALFORMED", f"HELLO has protocol {wire.shown(versions)}; it is [lowest, highest]")
        if not versions[0] <= wire.VERSION <= versions[1]:
            raise Refused("UNSUPPORTED_VERSION", f"the client speaks protocols {versions[0]} to {versions[1]}, this server {wire.VERSION}; update one of them",
                          protocol=[wire.VERSION, wire.VERSION])
        offered, most = wire.texts(hello, "capabilities"), wire.member(hello, "max_frame", int, self.limits.max_frame)
        given, resume, _ = (wire.member(hello, name, str, "") for name in ("token", "resume", "client"))
        if self.token and not _same_secret(given, self.token):
            raise Refused("AUTH_FAILED", "this server asks for a token and HELLO's is " + ("another; check it" if given else "missing; add it"))
        most = max(most, wire.LARGEST_BEFORE_WELCOME)
        if self._ending:
            raise Refused("SHUTTING_DOWN", "the server shuts down; try again later", retry_after_s=5)
        has = {"shm": shared_memory.AVAILABLE and is_here(connection.sock), "render": self.world.renders, "relabel": self.world.prices, "crc": True,
               "parameters": bool(self.world.parameters), "statistics": bool(self.world.statistics)}
        limit = min(most, self.limits.max_frame)
        session, resumed = self._take_up(connection, resume, limit, offered) if resume else self._open(connection)
        if not resumed:
            session.agreed = {name for name in has if name in offered and has[name]}
        connection.crc, connection.shares, connection.limit = "crc" in session.agreed, "shm" in session.agreed, limit
        session.limit = limit
        answer = connection.pack(wire.WELCOME, wire.dump_json({
            "protocol": wire.VERSION, "server": f"consac-python {__version__}", "session": session.number, "resume": session.token, "capabilities": sorted(session.agreed),
            "max_frame": connection.limit, "heartbeat_s": self.limits.heartbeat_s, "last_request": session.last_request, "resumed": resumed}), 0, session.number)
        try:
            connection.write(answer)
        except Gone:
            self._detach(connection, session)
            raise
        return session

    def _open(self, connection: Connection) -> tuple[Session, bool]:
        with self._lock:
            if len(self._sessions) >= self.limits.max_sessions:
                lost = [session.lost_at for session in self._sessions.values() if session.connection is None]
                wait = max(1.0, min(lost) + self.limits.resume_s - time.monotonic()) if lost else 10.0
                raise Refused("CAPACITY", f"all {self.limits.max_sessions} sessions are taken; close one, or start the server with more --max-sessions",
                              retry_after_s=round(wait, 1))
            session = Session(self._next_session, self._offer)
            self._next_session += 1
            self._sessions[session.number] = session
            session.connection = connection
            session.lock.acquire()
        return session, False

    def _take_up(self, connection: Connection, token, limit: int, offered: list[str]) -> tuple[Session, bool]:
        with self._lock:
            session = next((known for known in self._sessions.values() if known.started and _same_secret(token, known.token)), None)
            if session is None:
                raise Refused("AUTH_FAILED", "no session has this resume token, or it has expired; begin a new one")
            if limit < session.limit:
                raise Refused("AUTH_FAILED", f"session {session.number} had a max_frame of {session.limit}, this connection has {limit}; raise it or begin a new session")
            lacking = sorted(session.agreed - set(offered))
            if lacking:
                raise Refused("AUTH_FAILED", f"session {session.number} has the capability {quote(lacking[0])}, which this HELLO does not name; name it, or begin a new session (R27)")
            before, session.connection = session.connection, connection
        if before is not None:
            try:
                before.sock.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
        if not session.lock.acquire(timeout=min(1.0, self.limits.handshake_s / 2)):  # the client's handshake has a deadline too
            with self._lock:
                if session.connection is connection:  # nobody has taken it up meanwhile
                    session.connection = before
            raise Refused("CAPACITY", f"session {session.number} is still at work on request {session.last_request + 1}; try again", retry_after_s=1)
        return session, True
