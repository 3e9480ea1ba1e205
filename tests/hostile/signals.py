"""Signals at any moment of a training, then --resume: nothing is lost but what came after the last checkpoint."""
from __future__ import annotations

import random
import signal
import time

from judge import Arena, Ended, Limits, Running

TRAIN = ["train", "cartpole-v1", "--name", "r", "--steps", "200_000", "--envs", "4", "--set", "n_steps=64", "nminibatches=4", "checkpoint_every_updates=3", "--no-table"]


def experiment(program: str, arena: Arena, rng: random.Random) -> Ended:
    running = Running([program, *TRAIN], arena)
    kind = rng.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
    time.sleep(rng.uniform(0.0, 0.8))
    if running.alive():
        running.process.send_signal(kind)
    ended = running.end(Limits(seconds=20))
    if kind == signal.SIGKILL or (ended.code < 0 and -ended.code == kind and not (arena.home / "runs" / "r" / "config.yaml").exists()):
        ended.findings = [finding for finding in ended.findings if not finding.startswith("ended by")]  # ours, or before it listened
    if ended.findings or not (arena.home / "runs" / "r").exists():
        return ended
    if b"everything is saved" in ended.output and not list((arena.home / "runs" / "r" / "checkpoints").glob("*")):
        ended.findings.append("said that everything is saved, and there is no checkpoint")
    again = Running([program, "train", "--resume", "--name", "r", "--steps", "1000", "--no-table"], arena).end(Limits(seconds=20))
    strays = [path.name for path in (arena.home / "runs" / "r").rglob("*.tmp-*")]
    if strays and again.code == 0:
        again.findings.append(f"left behind: {strays}")
    return again
