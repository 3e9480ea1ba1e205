"""The trainer's end of protocol 2: one Connection is one session. What its rows mean to Gymnasium is in env.py, vector.py, ..."""
from __future__ import annotations

import logging
import os
import socket
import struct
import threading
import time
import warnings
import weakref
from typing import TYPE_CHECKING

import numpy as np

from . import shared_memory, wire
from .address import open_socket, parse_url, ready
from .errors import ConnectionLost, ConsacError, DeadlineExceeded, EngineBusy, EngineError, ProtocolError, said
from .extras import Setting
from .frames import ResultFrame, Rows, StepFrame, reset_payload
from .goals import read_rewards, relabel_payloads, require_relabel
from .judge import Judge
from .line import DONT_WAIT, HANDSHAKE_S
from .offer import read_spec
from .options import Options, check, token_of
from .session import WRITE_S, Session

if TYPE_CHECKING:
    from typing_extensions import Unpack

TEXT_SETUP_S = 0.1  # so long a text setup is waited for before HELLO
IDLE_TICK_S = 2.0  # how often PINGs are answered while no request is under way
MOST_LOSSES = 5  # of one request

# A sleeping thread takes some 40 us to wake, more than an engine's step: a short spin first makes a step three times as fast.
_NO_SPIN = range(0)
_SPIN = range(40 if DONT_WAIT and (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1) > 1 else 0)

_REQUEST = struct.Struct("<Q")
_REQUEST_AT = 16  # in a header
_HEAD = struct.Struct("<IHHIIQIII")  # a header and the first word of its payload
_WORDS = struct.Struct("<II")
_LENGTH = struct.Struct("<I")


def connect(url: str, protocol="auto", *, autoreset: str | tuple[str, ...] = "same_step", **options: Unpack[Options]):
    """A Connection, or a TextConnection where the engine speaks text protocol 1. `protocol`: "auto", 2 or "text1"."""
    return open_engine(url, autoreset, {"protocol": protocol, **options})


def open_engine(url: str, autoreset: str | tuple[str, ...], given: dict):
    """The same with `given` as users of any face gave it: options.Options and `protocol`. Here, and only here, they are checked."""
    from .text1 import TextConnection

    check(given)
    options = {key: value for key, value in given.items() if key not in ("protocol", "wait")}
    protocol, wait = given.get("protocol", "auto"), given.get("wait", 0.0)
    text_options = {key: options[key] for key in ("timeout",) if key in options}  # the others mean nothing to it
    if protocol == "text1":
        return TextConnection(url, wait=wait, **text_options)
    sock = open_socket(*parse_url(url), HANDSHAKE_S, wait)
    if protocol == "auto" and ready(sock, TEXT_SETUP_S):
        first = sock.recv(1, socket.MSG_PEEK)
        if first and first[0] != wire.MAGIC & 0xFF:
            return TextConnection(url, sock=sock, **text_options)
    try:
        return Connection(url, autoreset=autoreset, sock=sock, **options)
    except ProtocolError as error:
        if protocol == "auto" and error.code == "BAD_MAGIC":
            return TextConnection(url, **text_options)
        if error.code == "BAD_MAGIC":
            raise ProtocolError(error.code, f'{error.message} An engine of text protocol 1 wants protocol="text1"') from None
        raise


class Connection(Session):
    """A session with an engine, made by `connect`. Not for several threads at once; a thread of its own answers PINGs between requests.

    `step()` sends what lies in `step_mask` and `actions`; `reset()` takes masks and seeds. Both leave their answer in `rows`,
    `infos` and `final_infos`. A connection that breaks is taken up again, and the request under way is carried out once.
    A request may be interrupted anywhere (Ctrl-C): the next one first asks the engine how far it came.
    Of several ways of `autoreset` the first counts that the engine knows.
    With `shared_memory` an engine on this host is stepped through memory where it offers that; `in_memory` says whether it is."""

    def __init__(self, url: str, *, token: str | None = None, timeout: float = 60.0, autoreset: str | tuple[str, ...] = "same_step", expect: list | None = None,
                 wait: float = 0.0, resume_s: float = 10.0, crc: bool = False, max_frame: int = wire.LARGEST_FRAME,
                 shared_memory: bool = True, sock: socket.socket | None = None):
        capabilities = ["render", "relabel", "parameters", "statistics", "groups"] + ["crc"] * crc + ["shm"] * (shared_memory and not crc)
        super().__init__(url, timeout, resume_s, [autoreset] if isinstance(autoreset, str) else list(autoreset), capabilities, max_frame, token_of(token))
        self.parts, self.infos, self.final_infos = 0, None, None
        self.rows: list[Rows] = []
        self._slow = self._skip = 0
        self._in_place = True
        try:
            self._greet(sock or open_socket(self.host, self.port, HANDSHAKE_S, wait), time.monotonic() + HANDSHAKE_S)
            self._configure({"expect": expect} if expect is not None else {})
        except BaseException:
            self._part()
            self._drop()
            raise
        self._stop = threading.Event()
        _OPEN.add(self)
        threading.Thread(target=_keep_alive, args=(weakref.ref(self), self._stop), name="consac-keepalive", daemon=True).start()

    # ---- what the engine offers

    def _adopt(self, spec: dict, shared: bool = False) -> None:
        """Buffers and views for the engine's spaces; `shared_memory.Unavailable` where `shared` cannot be."""
        offer = read_spec(spec, self.autoreset, self.max_frame, self.capabilities)
        self.spec, self.environments, self.behaviours = spec, offer.environments, offer.behaviours
        self.deterministic, self.max_episode_steps, self.id = offer.deterministic, offer.max_episode_steps, offer.id
        self.parameters, self.groups = {one.name: one for one in offer.parameters}, offer.groups
        self._setting = Setting(offer.parameters, self.environments)
        step, result = StepFrame(self.behaviours, self.environments), ResultFrame(self.behaviours, self.environments, len(self.groups), "statistics" in self.capabilities)
        largest = max(step.size + self._setting.values.nbytes, result.largest) - wire.HEADER.size
        if largest > self.max_frame:
            raise ConsacError(f"{self.environments} environments make frames of {largest} bytes, max_frame is {self.max_frame}; raise it or take fewer environments")
        step.begin(self._flags, self.session)
        self._out, self.step_mask, self.actions, self.action_offsets = step.bytes, step.mask, step.actions, step.action_offsets
        self._out_view = memoryview(self._out)
        self._reserve(result.largest + wire.LARGEST_JSON + 16)
        if shared:
            self._channel = shared_memory.open_channel(spec.get("shm"), step.size, result.plain_size)
            self._in = np.frombuffer(self._channel.incoming, np.uint8)
        self._in_place = not shared
        self._result, self._plain_size = result, result.plain_size
        self.rows = result.lay_over(self._in)
        self._judge, self._deserted = Judge(self.behaviours, self.autoreset), None

    @property
    def in_memory(self) -> bool:
        """Whether RESET, STEP and RESULT go through shared memory now."""
        return self._channel is not None

    # ---- requests

    def step(self) -> None:
        """Steps the environments of `step_mask` with `actions`; the answer lies in `rows`."""
        with self._lock:
            if self._setting.due:
                return self._step_and_set()
            request = self._begin()
            _REQUEST.pack_into(self._out, _REQUEST_AT, request)
            if self._broken is not None or self._left or self._flags or self.goaway is not None:
                if self._flags:
                    struct.pack_into("<I", self._out, 12, wire.crc32c(self._out_view[wire.HEADER.size:]))
                payload = self._exchange(self._out_view, request, wire.RESULT)
            elif self._channel is not None:
                payload = self._step_in_memory(self._channel, request)
            elif self._in_place:
                payload = self._step_over_tcp(request)
            else:
                payload = self._exchange(self._out_view, request, wire.RESULT)
            if payload is not None:
                self._parse(payload)
            elif self.parts:
                self.parts, self.infos, self.final_infos = 0, None, None
            self._check(request, None if self.step_mask.all() else self.step_mask)
            self.request, self._under_way = request, False

    def _step_and_set(self) -> None:
        """A STEP that sets parameters, which is rare."""
        payload = bytearray(self._out_view[wire.HEADER.size:]) + self._setting.take()
        _LENGTH.pack_into(payload, 0, wire.WITH_PARAMETERS)
        answer = self._ask(wire.STEP, payload, wire.RESULT)
        self._setting.arrived()
        self._parse(answer)
        self._check(self.request, None if self.step_mask.all() else self.step_mask)
        self._under_way = False

    def set_parameters(self, values: dict) -> None:
        """What episodes have that begin from the next `reset` or `step` on: {name: number, or one for each environment (NaN: leave it)}. Those under way go
        on with what they have. `parameters` says what may be set; ConsacError names what there is not, or what it cannot be."""
        with self._lock:
            self._setting.set(values)

    @property
    def statistics(self) -> dict[str, list[float]]:
        """Numbers of the game's own that the latest answer has brought: all that were noted, by name."""
        return self._result.statistics if self.parts & wire.PART_STATISTICS else {}

    @property
    def group_rewards(self) -> np.ndarray:
        """[environments, groups] what each of `groups` was paid in the latest step. The rewards of its agents hold it already."""
        return self._result.group_rewards.copy() if self.parts & wire.PART_GROUPS else np.zeros((self.environments, len(self.groups)))

    def _step_in_memory(self, channel: shared_memory.Channel, request: int) -> memoryview | None:
        """None where the answer is a plain one, which lies in its place; else its payload."""
        channel.send(self._out)
        if channel.wait(shared_memory.LOOK_S):
            magic, kind, flags, length, _, answers, _, reserved, parts = _HEAD.unpack_from(self._in)
            if answers == request and kind == wire.RESULT and flags == reserved == parts == 0 and magic == wire.MAGIC \
                    and length + wire.HEADER.size == self._plain_size:
                channel.saw()
                self._heard = time.monotonic()
                return None
        return self._finish(self._out_view, request, wire.RESULT, 0, channel)

    def _step_over_tcp(self, request: int) -> memoryview | None:
        """As `_step_in_memory`: one system call each way where nothing unusual comes."""
        have = -1
        try:
            if self._send(self._out) == len(self._out):
                have, receive, view = 0, self._recv_into, self._in_view
                for _ in _NO_SPIN if self._skip else _SPIN:
                    try:
                        have = receive(view, 0, DONT_WAIT)
                        self._slow = 0
                        break
                    except BlockingIOError:
                        pass
                else:
                    self._rest()
                    have = receive(view)
                magic, kind, flags, length, _, answers, _, reserved, parts = _HEAD.unpack_from(self._in)
                if have == length + 32 and answers == request and kind == 7 and flags == reserved == parts == 0 and magic == wire.MAGIC \
                        and have == self._plain_size:
                    return None
                if not have:
                    self._broken = ConnectionLost("the engine closed the connection")
            else:
                self._broken = ConnectionLost("a write was cut short")
        except BlockingIOError:
            if have < 0:
                self._broken = ConnectionLost(f"the engine took no bytes for {WRITE_S:g} s")
        except OSError as error:
            self._broken = error
        return self._finish(self._out_view, request, wire.RESULT, max(0, have))

    def _rest(self) -> None:
        """Spinning was of no use: an engine that is slow again and again is waited for asleep, up to 64 steps in a row."""
        if self._skip:
            self._skip -= 1
        else:
            self._slow = min(64, 2 * self._slow + 1)
            self._skip = self._slow

    def reset(self, mask=None, seeds=None, options: dict | None = None) -> None:
        """Begins new episodes where `mask` [environments] is true (everywhere without it); `seeds` are one i64 per environment. An engine
        that cannot take them is asked without, with a warning (R47)."""
        with self._lock:
            refused, block = None, self._setting.take() if self._setting.due else b""
            payload = reset_payload(self.environments, mask, seeds, options, block)
            try:
                answer = self._ask(wire.RESET, payload, wire.RESULT)
            except EngineError as error:
                if seeds is None or error.code != "UNSUPPORTED" or error.fatal:
                    raise
                refused = error.message
                answer = self._ask(wire.RESET, reset_payload(self.environments, mask, None, options, block), wire.RESULT)
            self._setting.arrived()
            self._parse(answer)
            self._check(self.request, mask, step=False)
            self._under_way = False
        if refused is not None:
            warnings.warn(f"{self.url} cannot take these seeds, which have no effect: {refused}", stacklevel=2)

    def render(self, env: int = 0) -> np.ndarray:
        """The picture [height, width, 3] u8 of one environment; needs capability `render`."""
        if "render" not in self.capabilities:
            raise ConsacError(f"{self.url} cannot draw: it does not offer the capability `render`")
        with self._lock:
            payload = self._ask(wire.RENDER, wire.dump_json({"env": env}), wire.FRAME)
            height, width = _WORDS.unpack_from(payload) if len(payload) >= 8 else (0, 0)
            if len(payload) != 8 + 3 * height * width:
                self._fail(ProtocolError("MALFORMED", f"a FRAME of {len(payload)} bytes for {height} x {width} dots"))
            return np.frombuffer(payload, np.uint8, offset=8).reshape(height, width, 3).copy()

    def relabel(self, goals: dict, rows: int, behaviour: int = 0) -> np.ndarray:
        """[rows] f64: what steps would have paid had they led to `goals`, {"achieved_goal": [rows, ...], "desired_goal": [rows, ...]}; needs
        capability `relabel`. Other parts of the observation may stand there too; they are 0 otherwise."""
        require_relabel(self)
        rewards = [np.empty(0)]
        with self._lock:
            for payload, some in relabel_payloads(self.behaviours, behaviour, goals, rows, self.max_frame):
                answer = self._ask(wire.RELABEL, payload, wire.REWARDS)
                try:
                    rewards.append(read_rewards(answer, some))
                except ProtocolError as error:
                    self._fail(error)
        return np.concatenate(rewards)

    def close(self) -> None:
        """BYE; the engine forgets the session. May be called again."""
        if self.closed and self._socket is None:
            return
        self.closed = True
        if hasattr(self, "_stop"):
            self._stop.set()
        self._part()
        self._drop()

    def _leave_to_parent(self) -> None:
        """In a forked process, which must not step the worlds of the other. Nothing is said to the engine."""
        self._lock, self._stop = threading.RLock(), threading.Event()  # a thread that is not here may have held the old ones
        self.closed, self._why = True, "it belongs to the process that this one was forked from; make another in this one"
        self._drop()

    def __reduce__(self):
        raise TypeError(f"the connection to {self.url} cannot be copied or pickled; make another environment by its address")

    def __del__(self) -> None:
        if hasattr(self, "_channel"):
            self.close()

    def __enter__(self) -> "Connection":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    # ---- one request and its answer

    def _begin(self) -> int:
        """The number of the next request, which is under way from now on. What was interrupted before is put in order first."""
        if self._under_way:
            self._find_out()
        self._under_way = True
        return self.request + 1

    def _ask(self, kind: int, payload: bytes, answer: int) -> memoryview:
        if len(payload) > self.max_frame:
            raise ConsacError(f"a request of {len(payload)} bytes; the engine takes {self.max_frame}")
        request = self._begin()
        payload = self._exchange(self._packed(kind, payload, request), request, answer)
        self.request, self._under_way = request, answer == wire.RESULT  # which is over when it was judged: reset
        return payload

    def _exchange(self, frame: memoryview, request: int, answer: int) -> memoryview:
        self._check_open()
        if self.goaway is not None:
            self._fail(ConnectionLost(f"{self.url} takes no further requests: {self.goaway}"))
        channel = self._channel if self._broken is None and answer == wire.RESULT else None
        if channel is not None and len(frame) <= channel.room:
            channel.send(frame)
            return self._finish(frame, request, answer, 0, channel)
        if self._broken is None:
            try:
                self._socket.sendall(frame)
            except OSError as error:
                self._broken = error
        return self._finish(frame, request, answer, 0)

    def _finish(self, frame: memoryview, request: int, answer: int, have: int, channel: shared_memory.Channel | None = None) -> memoryview:
        """Waits for the answer to `frame`, which was sent, and repeats it on a new connection where the old one is lost."""
        self._check_open()
        losses, end = 0, time.monotonic() + self.timeout
        while True:
            try:
                if self._broken is not None:
                    raise self._broken
                if self._left:
                    data, self._left = self._left, b""
                    self._in_view[have:have + len(data)] = data
                    have += len(data)
                return self._await(have, request, answer, end, channel)
            except EngineError as error:
                if error.fatal or isinstance(error, EngineBusy):
                    self._fail(error)
                self.request, self._under_way = request, False
                raise
            except (ProtocolError, DeadlineExceeded) as error:
                self._fail(error)
            except OSError as error:
                have, losses, channel, lost_at = 0, losses + 1, None, time.monotonic()
                if losses > MOST_LOSSES:
                    self._fail(ConnectionLost(f"{self.url} was lost again and again ({said(error)})"))
                self._take_up(error, request)
                end += time.monotonic() - lost_at
                try:
                    self._socket.sendall(frame)
                except OSError as again:
                    self._broken = again

    def _idle(self) -> None:
        """What is to do between requests: PINGs, and a request that was interrupted."""
        if self.closed or not self._lock.acquire(blocking=False):
            return
        try:
            if self._under_way:
                self._find_out()
                self._under_way = False
            self._read_idle()
        except (ConsacError, OSError) as error:
            _log.debug("%s: %s", self.url, error)  # the next request says so too
        finally:
            self._lock.release()

    def _check(self, request: int, chosen, step: bool = True) -> None:
        """Judges the RESULT in `rows`; an engine in which nobody takes part for as long as an answer may take has forgotten to say who does (R77)."""
        try:
            self._result.check_padding()
            if self.parts & wire.PART_GROUPS:
                self._result.check_groups(self._judge.played(request, step, chosen))
            if self._judge.judge(request, self.rows, step, chosen, bool(self.parts & wire.PART_FINALS)):
                self._deserted = None
                return
        except ProtocolError as error:
            self._fail(error)
        now = time.monotonic()
        self._deserted = self._deserted or now
        if now - self._deserted > self.timeout:
            self._fail(DeadlineExceeded(f"{self.url} has had no agent that takes part for {self.timeout:g} s: RESULT's state 16 is set for no slot (R77)"))

    def _parse(self, payload: memoryview) -> None:
        """What a RESULT says that is no plain one."""
        try:
            in_place = self._in_place or payload.obj is not self._in_view.obj  # else it came over TCP, and `rows` lie in memory that is or was shared
            self.parts, self.infos, self.final_infos = self._result.read(payload, in_place)
        except ProtocolError as error:
            self._fail(error)


_log = logging.getLogger("consac")
_OPEN: weakref.WeakSet = weakref.WeakSet()  # all connections of this process


def _after_fork() -> None:
    for connection in list(_OPEN):
        connection._leave_to_parent()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _keep_alive(reference, stop: threading.Event) -> None:
    while not stop.wait(IDLE_TICK_S):
        connection = reference()
        if connection is None or connection.closed:
            return
        connection._idle()
        del connection
