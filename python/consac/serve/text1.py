"""The engine's end of text protocol 1 (spec/text1.md): one environment, one trainer at a time."""
from __future__ import annotations

import time

import numpy as np
from gymnasium import spaces

from ..errors import said
from ..text1 import read_number
from .connection import Connection
from .limits import TICK, Limits
from .refusal import Gone
from .session import Offer
from .world import defaults_of

UNBOUNDED = 3.4028235e+38  # how text protocol 1 writes a side without bound


class BadAction(ValueError):
    """What a trainer sent is no action."""


def misfit(offer: Offer) -> str:
    """Why text protocol 1 cannot carry this world, or nothing."""
    if offer.world.multi_agent:
        return "there are several agents"
    if offer.training_length == 0 and not offer.model_name:
        return "it needs a training length (--steps) or a model's name"
    for what, space in (("action", offer.world.behaviours[0].action.space), ("observation", offer.world.behaviours[0].observation.space)):
        discrete = isinstance(space, spaces.Discrete) and space.start == 0 and space.n <= 65536
        box = isinstance(space, spaces.Box) and len(space.shape) == 1 and space.dtype == np.float32 and 1 <= space.shape[0] <= 65536
        if not discrete and not box:
            return f"the {what} space is {space}; it takes Discrete from 0 and flat float32 Box"
    return ""


def play(connection: Connection, offer: Offer, limits: Limits, env) -> None:
    """One trainer's session with `env`."""
    reader = TextReader(connection, env.action_space, limits)
    say = lambda text: connection.write(text.encode() + b"\n")
    name = f"#{offer.model_name}" if offer.model_name else ""
    say(f"{_text_space(env.action_space)}#{_text_space(env.observation_space)}#{offer.training_length}{name}")
    options = {"options": defaults_of(offer.world.parameters)} if offer.world.parameters else {}
    observation, _ = env.reset(seed=offer.seed, **options)
    say(f"{_text_row(observation)}#0#0")
    done = 0
    while True:
        try:
            action = reader.next(connection)
        except Gone as error:
            if offer.training_length and done < offer.training_length:
                raise Gone(f"{error}; {offer.training_length - done} of {offer.training_length} steps are missing") from None
            offer.log(f"text protocol 1: training completed, {done} steps")
            return
        observation, reward, terminated, truncated, _ = env.step(action)
        done += 1
        connection.stepped = True
        over = bool(terminated or truncated)
        say(f"{_text_row(observation)}#{_text_number(reward)}#{int(over)}")
        if over:
            observation, _ = env.reset(**options)
            say(f"{_text_row(observation)}#0#0")


class TextReader:
    """Actions of text protocol 1, with or without terminators; BadAction."""

    def __init__(self, connection: Connection, space: spaces.Space, limits: Limits):
        self.space, self.limits, self.data = space, limits, b""

    def next(self, connection: Connection):
        deadline = time.monotonic() + self.limits.text_s
        while True:
            if time.monotonic() > deadline:  # also while lines of nothing come
                raise Gone(f"no action for {self.limits.text_s:g} s")
            self.data = self.data.lstrip(b"\r\n")
            line, terminator, rest = self.data.partition(b"\n")
            if terminator:
                self.data = rest
                return self._value(line.rstrip(b"\r"))
            if len(self.data) > 1 << 20:
                raise BadAction("an action of over 1 MiB without an end")
            if isinstance(self.space, spaces.Discrete) and self.space.n <= 10 and len(self.data) == 1 and self.data.isdigit():
                line, self.data = self.data, b""
                return self._value(line)
            if not connection.wait(self.limits.quiet_s if self.data else TICK):
                if self.data:
                    line, self.data = self.data, b""
                    return self._value(line)
                if connection.closing.is_set():
                    raise Gone("the server shuts down")
                continue
            try:
                more = connection.sock.recv(65536)
            except OSError as error:
                raise Gone(f"the connection broke: {said(error)}") from None
            if not more:
                raise Gone("the trainer closed")
            self.data += more
            connection.has_spoken = True

    def _value(self, line: bytes):
        text = line.decode("utf-8", "replace")
        shown = text if len(text) <= 60 else text[:60] + "..."
        if isinstance(self.space, spaces.Discrete):
            digits = text[1:] if text.startswith("+") else text  # spec/text1.md
            if not (digits.isascii() and digits.isdigit() and len(digits) < 19) or int(digits) >= self.space.n:
                raise BadAction(f"action '{shown}'; expected a whole number from 0 to {self.space.n - 1}")
            return self.space.dtype.type(int(digits))
        try:
            values = [read_number(field) for field in text.split(",")]
        except ValueError:
            raise BadAction(f"action '{shown}'; expected {self.space.shape[0]} numbers") from None
        if len(values) != self.space.shape[0] or not np.isfinite(values).all():
            raise BadAction(f"action '{shown}'; expected {self.space.shape[0]} finite numbers")
        return np.clip(np.array(values, np.float32), self.space.low, self.space.high)


def _text_space(space: spaces.Space) -> str:
    if isinstance(space, spaces.Discrete):
        return f"D#{space.n}#0"
    bounds = np.concatenate([space.low, space.high])
    return f"B#{space.shape[0]}#" + ",".join(_text_number(np.float32(bound)) if np.isfinite(bound) else f"{'-' if bound < 0 else ''}{UNBOUNDED}" for bound in bounds)


def _text_row(observation) -> str:
    return ",".join(map(_text_number, observation)) if np.ndim(observation) else str(int(observation))


def _text_number(number) -> str:
    if not np.isfinite(number):
        raise ValueError(f"the environment gave {number}, which text protocol 1 never sends")
    text = str(number) if isinstance(number, np.floating) else repr(float(number))
    return text[:-2] if text.endswith(".0") else text
