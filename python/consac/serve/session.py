"""One trainer's session: its environments, its requests carried out once each, the last answer kept."""
from __future__ import annotations

import json
import secrets
import threading
import time
from dataclasses import dataclass
from typing import Callable

from consac import shared_memory, wire
from consac.layout import align, first_difference
from consac.names import check_expected_names, quote
from consac.wire import HEADER, WireError

from .agents import AgentBatch
from .batch import AUTORESETS, Batch
from .connection import Connection
from .goals import ROOM
from .refusal import CONNECTION_ERRORS, FAILURES, Gone, Refusals, Refused, describe, error_json
from .world import World


INFOS_ROOM = 1 << 16  # bytes of a RESULT's infos that shared memory has room for; larger ones go over TCP


@dataclass
class Offer:
    """What a server offers to every session."""

    world: World
    make_env: Callable
    seed: int | None  # of a first RESET that gives none
    training_length: int
    model_name: str
    log: Callable
    failures: Refusals  # of environments


class Session:
    """Environments and the last answer; it may outlive a connection."""

    def __init__(self, number: int, offer: Offer):
        self.offer = offer
        self.number, self.token = number, secrets.token_urlsafe(24)
        self.lock = threading.Lock()  # held by the thread that serves it
        self.connection: Connection | None = None
        self.lost_at = 0.0
        self.last_request = 0
        self.answer: bytes | memoryview = b""
        self.batch: Batch | None = None
        self.configured = False
        self.stepped = False  # by now
        self.agreed: set[str] = set()  # capabilities, of its whole life (R27)
        self.limit = 0  # max_frame of its WELCOME
        self.deadline: float | None = None  # for CONFIGURE

    @property
    def started(self) -> bool:
        """Whether a first RESET was answered: only then may it be gone on with over another connection."""
        return self.batch is not None and self.batch.started

    def serve(self, connection: Connection, look) -> None:
        """Answers requests until BYE; `look` is called now and then and raises where time is up."""
        while True:
            connection.request = 0
            kind, request, number, payload = connection.read(look)
            connection.request = request
            if self.deadline is not None and time.monotonic() > self.deadline:
                look()
            if kind == wire.BYE:
                return
            if connection.aside(kind, payload, self.number):
                continue
            known = number in (0, self.number) and kind != wire.HELLO
            if request != self.last_request + 1 or not known:
                if request == self.last_request != 0 and known:
                    connection.answer(self.answer)
                    continue
                why = f"request {request} after {self.last_request}; the next is {self.last_request + 1}"
                if kind == wire.HELLO:
                    why = "HELLO twice on one connection; go on with CONFIGURE or RESET"
                elif not known:
                    why = f"session {number} on the connection of session {self.number}"
                connection.answer(connection.pack(wire.ERROR, error_json("BAD_STATE", why), request, self.number))
                continue
            if connection.closing.is_set():
                raise Refused("SHUTTING_DOWN", "the server shuts down; this request was not carried out", retry_after_s=5)
            try:
                answer = self._carry_out(connection, kind, request, payload)
            except Refused as error:
                if error.code in CONNECTION_ERRORS:
                    raise
                answer = connection.pack(wire.ERROR, error_json(error.code, error.message, **error.extra), request, self.number)
            self.last_request, self.answer = request, answer
            connection.answer(answer)
            if connection.closing.is_set():
                raise Gone("the server shuts down")

    def _carry_out(self, connection: Connection, kind: int, request: int, payload):
        batch = self.batch
        if kind == wire.STEP or kind == wire.RESET:
            if not self.configured:
                raise Refused("BAD_STATE", f"{'STEP' if kind == wire.STEP else 'RESET'} before CONFIGURE; configure first")
            batch.agreed = self.agreed
            if kind == wire.RESET:
                batch.reset(payload)
            elif not batch.started:
                raise Refused("BAD_STATE", "STEP before a first RESET; reset first")
            else:
                batch.step(payload)
                self.stepped = True
            answer = batch.result(request, self.number, connection.crc)
            if len(answer) - HEADER.size > connection.limit:
                batch.drop_infos("make the RESULT larger than the client takes")
                answer = batch.result(request, self.number, connection.crc)
            return answer
        if kind == wire.CONFIGURE:
            if batch is not None and batch.started:
                raise Refused("BAD_STATE", "CONFIGURE after a RESET; begin a new session")
            return connection.pack(wire.SPEC, self._configure(connection, wire.load_json(payload)), request, self.number)
        if kind == wire.RENDER:
            if "render" not in self.agreed:
                raise Refused("UNSUPPORTED", "RENDER without the capability `render`" + ("" if self.offer.world.renders else "; this server's environments do not draw"))
            if batch is None or not batch.started:
                raise Refused("BAD_STATE", "RENDER before a first RESET; reset first")
            image = batch.render(wire.load_json(payload))
            if len(image) > connection.limit:
                raise Refused("UNSUPPORTED", f"an image of {len(image)} bytes, over the client's max_frame {connection.limit}; raise it")
            return connection.pack(wire.FRAME, image, request, self.number)
        if kind == wire.RELABEL and "relabel" in self.agreed:
            if batch is None or not batch.started:
                raise Refused("BAD_STATE", "RELABEL before a first RESET; reset first")
            return connection.pack(wire.REWARDS, batch.goals.answer(payload, connection.limit, self.offer.failures), request, self.number)
        raise Refused("UNKNOWN_MESSAGE", f"a frame of type {kind} is not {'sent by a client' if kind <= wire.FRAME else 'known here, or was not agreed'}")

    def _configure(self, connection: Connection, wanted: dict) -> bytes:
        autoreset, transport = wire.member(wanted, "autoreset", str, "same_step"), wire.member(wanted, "transport", str, "tcp")
        expect = wire.member(wanted, "expect", list, [])
        try:
            check_expected_names(expect)
        except ValueError as error:
            raise WireError("MALFORMED", f"CONFIGURE: {error}") from None
        if autoreset not in AUTORESETS:
            raise Refused("UNSUPPORTED", f"autoreset {quote(autoreset)}; there are {', '.join(AUTORESETS)}", path="autoreset")
        if transport != "tcp" and not (transport == "shm" and connection.shares):
            raise Refused("UNSUPPORTED", f"transport {quote(transport)}; this connection has tcp{' and shm' * connection.shares}", path="transport")
        spec = self.offer.world.to_json(autoreset, self.offer.training_length, self.offer.model_name, self.agreed)
        if "expect" in wanted:
            difference = first_difference(expect, spec["behaviours"], "behaviours")
            if difference:
                path, expected, found = difference
                path = "/".join(part for part in path.split("/") if part not in ("spaces", "space"))
                both = [json.dumps(value)[:400] for value in (expected, found)]
                raise Refused("SPEC_MISMATCH", f"{path}: the client expects {both[0]}, the engine has {both[1]}", path=path)
        channel = None
        if transport == "shm":
            channel, spec["shm"] = self._share()
        text = wire.dump_json(spec)
        try:
            wire.load_json(text)
        except WireError as error:
            raise Refused("UNSUPPORTED", f"SPEC is more than JSON of a message may be: {error.message} (R7)") from None
        largest = max(Batch.largest_result(self.offer.world), Batch.step_bytes(self.offer.world), len(text))
        if "parameters" in self.agreed:
            largest = max(largest, max(Batch.step_bytes(self.offer.world), reset_bytes(self.offer.world)) + self.offer.world.parameter_bytes)
        if largest > connection.limit:
            raise Refused("UNSUPPORTED", f"this world's frames have up to {largest} bytes, over max_frame {connection.limit}; raise it or serve fewer environments")
        if self.batch is None:
            self.batch = self._make_batch()
        self.batch.autoreset = autoreset
        connection.channel, connection.in_memory = channel, False
        self.configured, self.deadline = True, None
        return text

    def _share(self) -> tuple[shared_memory.Channel, dict]:
        """Memory for the requests and answers of this world."""
        world = self.offer.world
        try:
            return shared_memory.create_channel(HEADER.size + max(max(Batch.step_bytes(world), reset_bytes(world)) + world.parameter_bytes, ROOM * world.prices), HEADER.size + Batch.largest_result(world) + INFOS_ROOM)
        except OSError as error:
            raise Refused("UNSUPPORTED", f"memory cannot be shared: {error}; ask for the transport tcp", path="transport") from error

    def _make_batch(self) -> Batch:
        envs: list = []
        try:
            for _ in range(self.offer.world.environments):
                envs.append(self.offer.make_env())
        except FAILURES as error:
            for env in envs:
                env.close()
            self.offer.failures.tell(error)
            raise Refused("ENV_FAILED", f"environment {len(envs)} cannot be made: {describe(error)}", env=len(envs)) from error
        return (AgentBatch if self.offer.world.multi_agent else Batch)(self.offer.world, envs, self.offer.seed, self.offer.log, self.offer.failures)


def reset_bytes(world: World) -> int:
    """Of a RESET with seeds."""
    return align(8 + world.environments) + 8 * world.environments
