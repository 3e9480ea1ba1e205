"""Training and serving where descriptors, memory, threads, disk or output run short."""
from __future__ import annotations

import os
import random
import socket
import subprocess
import time

from judge import EXIT_CODES, Arena, Ended, Limits, Running, limit_resources, sanitized

TRAIN = ["train", "cartpole-v1", "--name", "r", "--steps", "4096", "--envs", "4", "--set", "n_steps=64", "nminibatches=4"]


def few_descriptors(program: str, arena: Arena, rng: random.Random) -> Ended:
    return Running([program, *TRAIN], arena, limit_resources(NOFILE=rng.randint(4, 40))).end(Limits())


def little_memory(program: str, arena: Arena, rng: random.Random) -> Ended:
    return Running([program, *TRAIN, "--threads", "2"], arena, limit_resources(AS=rng.randint(40, 400) << 20)).end(Limits())


def few_threads(program: str, arena: Arena, rng: random.Random) -> Ended:
    """As nobody, since root has no such limit."""
    os.chmod(arena.outer, 0o755)
    subprocess.run(["chown", "-R", "nobody", str(arena.outer)], check=True)
    limits = limit_resources(NPROC=rng.randint(1, 4))

    def prepare():
        limits()
        os.setgid(65534)
        os.setuid(65534)
    return Running([program, *TRAIN, "--threads", "4"], arena, prepare).end(Limits())


def full_file(program: str, arena: Arena, rng: random.Random) -> Ended:
    """No file may grow beyond a few KiB: SIGXFSZ is ignored by whoever handles a full disk."""
    return Running([program, *TRAIN], arena, limit_resources(FSIZE=rng.randint(0, 60_000))).end(Limits())


def closed_output(program: str, arena: Arena, rng: random.Random) -> Ended:
    closed = rng.choice([(0,), (1,), (2,), (0, 1), (1, 2), (0, 1, 2)])

    def prepare():
        for descriptor in closed:
            os.close(descriptor)
    ended = Running([program, *TRAIN], arena, prepare).end(Limits())
    log = arena.home / "runs" / "r" / "progress.csv"
    if ended.code == 0 and log.exists() and any(line.startswith(("|", "-")) for line in log.read_text().splitlines()):
        ended.findings.append("a table landed in progress.csv")
    return ended


def crowded_server(program: str, arena: Arena, rng: random.Random) -> Ended:
    """More connections than descriptors: the server lives, and serves again once they are gone."""
    port_file = arena.outer / "attack-port"
    running = Running([program, "serve", "cartpole-v1", "--port", "0", "--port-file", str(port_file), "--trainers", "1000"], arena,
                      limit_resources(NOFILE=rng.randint(16, 64)))
    findings, connections = [], []
    try:
        until = time.monotonic() + 10
        while not (port_file.exists() and port_file.read_text().strip()) and running.alive() and time.monotonic() < until:
            time.sleep(0.01)
        if port_file.exists():
            port = int(port_file.read_text())
            for _ in range(80):
                try:
                    connections.append(socket.create_connection(("127.0.0.1", port), 1))
                except OSError:
                    break
            for connection in connections:
                connection.close()
    except (OSError, ValueError) as error:
        findings.append(f"no port: {error!r}")
    if running.alive():
        running.process.terminate()
    ended = running.end(Limits(seconds=30))
    ended.findings += findings
    return ended


def experiment(program: str, arena: Arena, rng: random.Random) -> Ended:
    ways = [few_descriptors, full_file, closed_output, crowded_server]
    if not sanitized(program):  # a sanitizer takes terabytes of address space, and threads of its own
        ways += [little_memory, little_memory]
        if os.getuid() == 0:
            ways.append(few_threads)
    return rng.choice(ways)(program, arena, rng)
