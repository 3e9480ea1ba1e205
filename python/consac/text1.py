"""A text-protocol-1 engine (spec/text1.md) seen as one environment: no seeds, no truncation, no infos."""
from __future__ import annotations

import re
import socket
import time
import warnings

import numpy as np
from gymnasium import spaces

from .address import open_socket, parse_url, ready
from .errors import ConnectionLost, ConsacError, DeadlineExceeded, ProtocolError
from .names import check_name, printable_line
from .wire import shown_bytes

QUIET_S = 0.002  # after so long without a byte a message without a terminator is complete
LARGEST_MESSAGE = 1 << 20
UNBOUNDED = np.finfo(np.float32).max
# What the specification calls a number, not all that Python does; those that are not finite are refused as such.
_NUMBER = re.compile(r"[+-]?(([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?|nan|inf|infinity)", re.IGNORECASE | re.ASCII)


def read_number(word: str) -> float:
    """The number that `word` is; ValueError."""
    if _NUMBER.fullmatch(word) is None:
        raise ValueError(f"no number: {printable_line(word, 40)}")
    return float(word)


class TextConnection:
    """The trainer's end of text protocol 1, made by `connect`."""

    deterministic, max_episode_steps, capabilities = False, 0, []

    def __init__(self, url: str, *, timeout: float = 60.0, wait: float = 0.0, sock: socket.socket | None = None):
        self.url, self.timeout, self.closed = url, timeout, False
        self._wait = wait
        self._socket = None
        self._fresh = self._over = self._warned = False
        self._under_way = False  # nobody knows what an interrupted request has sent and read: the next reset connects anew
        self._open(sock)

    def _open(self, sock: socket.socket | None = None) -> None:
        self._drop()
        self._socket = sock or open_socket(*parse_url(self.url), self.timeout, self._wait)
        self._data = b""
        setup = self._message(done_ends=False)
        if setup.startswith("busy"):
            self.close()
            raise ConsacError(f"{self.url} serves another trainer: {printable_line(setup, 400)}")
        fields = setup.split("#")
        if len(fields) not in (7, 8):
            self._bad(f"a setup of {len(fields)} fields, expected 7 or 8: {setup[:200]!r}")
        self.action_space = self._space("action", *fields[:3])
        self.observation_space = self._space("observation", *fields[3:6])
        self.training_length = self._whole("TrainingLength", fields[6])
        self.model_name = fields[7] if len(fields) == 8 else ""
        if self.model_name:
            try:
                check_name("model", self.model_name)
            except ValueError as error:
                self._bad(str(error))
        if not (self.training_length or self.model_name):
            self._bad("training length 0 asks for a model to act, but no model name follows")
        self.spec = {"id": "text1", "training_length": self.training_length, "model_name": self.model_name}
        self._steps, self._fresh, self._over = 0, True, False

    def reset(self, seed: int | None = None):
        """The first observation of an episode; in the middle of one the engine is connected to anew."""
        if seed is not None and not self._warned:
            self._warned = True
            warnings.warn(f"{self.url} speaks text protocol 1, which has no seeds; seed={seed} has no effect", stacklevel=3)
        if self.closed:
            raise ConnectionLost(f"the connection to {self.url} is closed")
        if not (self._fresh or self._over) or self._under_way:
            self._under_way = True
            self._open()
        self._under_way = True
        observation, _, done = self._observation()
        if done:
            self._bad("an episode's first observation has done 1")
        self._fresh = self._over = self._under_way = False
        return observation, {}

    def step(self, action):
        if self._under_way:
            raise ConsacError("the step before this one was interrupted, and text protocol 1 cannot go on from there; reset()")
        if self._fresh or self._over:
            raise ConsacError("step() before reset(): the episode is over")
        if self.training_length and self._steps >= self.training_length:
            raise ConnectionLost(f"{self.url} asked for {self.training_length} steps and has had them")
        data, self._under_way = self._write(action), True
        try:
            self._socket.sendall(data)
        except OSError as error:
            self._lost(error)
        self._steps += 1
        observation, reward, self._over = self._observation()
        self._under_way = False
        return observation, reward, self._over, False, {}

    def __reduce__(self):
        raise TypeError(f"the connection to {self.url} cannot be copied or pickled; make another environment by its address")

    def close(self) -> None:
        self.closed = True
        self._drop()

    # ---- text

    def _write(self, action) -> bytes:
        if isinstance(self.action_space, spaces.Discrete):
            choice = np.asarray(action)
            if choice.size != 1 or choice.dtype.kind not in "biu" or not 0 <= choice.item() < self.action_space.n:
                raise ValueError(f"the action {action!r} is none of 0 to {self.action_space.n - 1}")
            return b"%d\n" % choice.item()
        with np.errstate(over="ignore"):
            array = np.asarray(action, np.float32)
        if array.shape != self.action_space.shape or not np.isfinite(array).all():
            raise ValueError(f"the action {action!r} is not {self.action_space.shape[0]} finite numbers")
        return (",".join(map(str, array)) + "\n").encode()

    def _observation(self):
        text = self._message(done_ends=True)
        if text.startswith("error"):
            self._bad(text)
        fields = text.split("#")
        if len(fields) != 3 and not (len(fields) == 1 and self.model_name and not self.training_length):
            self._bad(f"an observation of {len(fields)} fields, expected 3: {text[:200]!r}")
        if isinstance(self.observation_space, spaces.Discrete):
            value = self._whole("observation", fields[0])
        else:
            value = self._numbers("observation", fields[0], self.observation_space.shape[0])
        if value not in self.observation_space:
            self._bad(f"the observation {fields[0][:200]!r} lies outside {self.observation_space}")
        if len(fields) == 1:
            return value, 0.0, False
        if fields[2] not in ("0", "1"):
            self._bad(f"done is {fields[2][:20]!r}, expected 0 or 1")
        return value, float(self._numbers("reward", fields[1], 1, np.float64)[0]), fields[2] == "1"

    def _message(self, done_ends: bool) -> str:
        """One message: up to a newline, else to its done character, else until it has been quiet."""
        end = time.monotonic() + self.timeout
        while True:
            self._data = self._data.lstrip(b"\r\n")  # all at once, and the deadline below still holds: lines of nothing are a flood
            line, newline, rest = self._data.partition(b"\n")
            if newline:
                text, self._data = line.rstrip(b"\r"), rest
                break
            if done_ends and self._data.count(b"#") >= 2:
                at = self._data.index(b"#", self._data.index(b"#") + 1) + 1
                if len(self._data) > at:
                    text, self._data = self._data[:at + 1], self._data[at + 1:].lstrip(b"\r")
                    break
            if len(self._data) > LARGEST_MESSAGE:
                self._bad(f"a message over {LARGEST_MESSAGE} bytes: {shown_bytes(self._data[:80])}")
            left = end - time.monotonic()
            if left <= 0 or not ready(self._socket, QUIET_S if self._data else left):
                if self._data and left > 0:
                    text, self._data = self._data, b""
                    break
                self.close()
                raise DeadlineExceeded(f"{self.url} sent no whole message within {self.timeout:g} s" + ("; does it wait for an answer to done 1?" if self._over else ""))
            try:
                more = self._socket.recv(65536)
            except OSError as error:
                self._lost(error)
            if not more:
                self._lost("it closed the connection")
            self._data += more
        try:
            return text.decode()
        except UnicodeDecodeError:
            self._bad(f"a message that is no text: {shown_bytes(text[:80])}")

    def _space(self, name: str, kind: str, size: str, bounds: str) -> spaces.Space:
        count = self._whole(f"the {name}'s size", size)
        if not 1 <= count <= 65536:
            self._bad(f"the {name}'s size is {count}, expected 1 to 65536")
        if kind == "D":
            return spaces.Discrete(count)
        if kind != "B":
            self._bad(f"the {name}'s type is {kind[:20]!r}, expected D or B")
        numbers = self._numbers(f"the {name}'s bounds", bounds, 2 * count)
        numbers[numbers >= UNBOUNDED], numbers[numbers <= -UNBOUNDED] = np.inf, -np.inf
        if (numbers[:count] > numbers[count:]).any():
            self._bad(f"the {name}'s bounds have a low above its high: {bounds[:200]!r}")
        return spaces.Box(numbers[:count], numbers[count:], dtype=np.float32)

    def _numbers(self, what: str, text: str, count: int, dtype=np.float32) -> np.ndarray:
        words = text.split(",")
        if len(words) != count:
            self._bad(f"{what} has {len(words)} numbers, expected {count}: {text[:200]!r}")
        try:
            with np.errstate(over="ignore"):  # beyond float32 is infinite, and refused below
                numbers = np.array([read_number(word) for word in words], dtype)
        except ValueError:
            self._bad(f"{what} holds something that is no number: {text[:200]!r}")
        if not np.isfinite(numbers).all():
            self._bad(f"{what} is not finite: {text[:200]!r}")
        return numbers

    def _whole(self, what: str, text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 19):
            self._bad(f"{what} is {text[:40]!r}, expected a whole number")
        return int(text)

    def _bad(self, message: str):
        self.close()
        raise ProtocolError("MALFORMED", f"{self.url}: {message}")

    def _lost(self, why):
        self.close()
        raise ConnectionLost(f"{self.url} was lost: {why}")

    def _drop(self) -> None:
        sock, self._socket = self._socket, None
        if sock is not None:
            sock.close()
