"""Times and sizes that the server keeps."""
from __future__ import annotations

import os
from dataclasses import dataclass

from consac import wire

TICK = 0.25  # seconds between two looks at deadlines


@dataclass(frozen=True)
class Limits:
    """Times in seconds, sizes in bytes, as in spec/protocol2.md."""

    grace_s: float = 0.3  # silence after which text protocol 1 is served
    handshake_s: float = 5.0  # from connecting to CONFIGURE
    heartbeat_s: float = 10.0  # between PINGs to a silent peer; three unanswered end the connection
    write_s: float = 10.0  # for a write that is not taken
    resume_s: float = 60.0  # how long a session outlives its connection
    text_s: float = 60.0  # for an answer in text protocol 1
    quiet_s: float = 0.002  # that ends a text message without terminator
    spin_s: float = 1e-4 if (os.cpu_count() or 1) > 1 else 0.0  # awake for the next request, while they come that fast: a sleeping core wakes slowly
    max_frame: int = wire.LARGEST_FRAME
    max_sessions: int = 8  # at once, those that may yet be resumed included
