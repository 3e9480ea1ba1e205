"""The built program, found below CONSAC_BUILD_DIR, and programs that the tests wait for."""
import os
import pathlib
import random
import signal
import socket
import subprocess
import sys

import pytest

import consac
from waiting import ENDS_S, until

PROGRAM = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", "")) / "cli/consac"
needs_program = pytest.mark.skipif(not PROGRAM.is_file(), reason="CONSAC_BUILD_DIR names no build with cli/consac")
OUR_SERVE = [sys.executable, "-u", "-m", "consac.serve"]
OUR_ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join([str(pathlib.Path(consac.__file__).parents[1]), *sys.path])}  # of a Python that finds what this one does


def run(command, **options):
    """A program's end: its exit code, and what it said as text."""
    return subprocess.run(command, capture_output=True, text=True, timeout=ENDS_S, **options)


def free_port():
    """A port for a program that cannot be asked which it has; below those that the system gives to whoever connects, so that nobody else takes it meanwhile."""
    while True:
        try:
            with socket.create_server(("127.0.0.1", random.randrange(20000, 32768))) as listener:
                return listener.getsockname()[1]
        except OSError:
            pass


def catches(process, number: signal.Signals):
    """Whether a process has a handler for a signal by now."""
    caught = next(line for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines() if line.startswith("SigCgt:"))
    return bool(int(caught.split()[1], 16) >> (number - 1) & 1)


class Engines:
    """`consac serve` processes; the address of each."""

    def __init__(self, folder):
        self.folder, self.processes = folder, []

    def __call__(self, world, *arguments):
        port_file = self.folder / f"port{len(self.processes)}"
        self.processes.append(subprocess.Popen([PROGRAM, "serve", world, "--port", "0", "--port-file", port_file, *arguments], stdout=subprocess.DEVNULL))
        until(lambda: port_file.is_file() or self.processes[-1].poll() is not None, "the port's file")
        return f"tcp://127.0.0.1:{int(port_file.read_text())}"

    def kill(self):
        for process in self.processes:
            process.kill()
            process.wait()
