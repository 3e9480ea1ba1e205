"""Starts the real engine, Godot 4 without a window, on a copy of the project engines/godot."""
import os
import pathlib
import queue
import random
import re
import shutil
import socket
import subprocess
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
# What a trainer is told to speak: to find out takes an engine, or a trainer, that is there within 0.1 s, as a busy machine has none.
TEXT1, PROTOCOL_2 = ("--protocol", "text1"), ("--protocol", "2")
DEADLINE_S = 400  # for whatever a test waits for: no measurement, only an end of waiting for what never comes
ROBOT = ROOT / "examples/robots/yumi"
CONSAC = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/release")) / "cli/consac"


def cache():
    """The folder of tools/godot.sh, or the reason why there is none."""
    answer = subprocess.run([ROOT / "tools/godot.sh", "where"], capture_output=True, text=True)
    return (pathlib.Path(answer.stdout.strip()), "") if answer.returncode == 0 else (None, answer.stderr.strip())


def kept_port():
    """A free port below those that systems hand out: nobody gets it by chance while one engine leaves it to the next."""
    while True:
        port = random.randrange(20000, 30000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                continue


class Program:
    """A process whose lines are read as they come, so that it never stands still for want of a reader."""

    def __init__(self, command, environment, cwd=None):
        self.process = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True, errors="replace", env=environment, cwd=cwd)
        self.lines, self._queue = [], queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self._queue.put(line.rstrip("\n"))
        self._queue.put(None)

    def _until(self, failure):
        """Its next lines up to its end; `failure` where they go on beyond the deadline."""
        deadline = time.monotonic() + DEADLINE_S
        while (left := deadline - time.monotonic()) > 0:
            try:
                line = self._queue.get(timeout=left)
            except queue.Empty:
                break
            if line is None:
                return
            self.lines.append(line)
            yield line
        raise AssertionError(f"{failure} within {DEADLINE_S} s:\n" + self.output())

    def wait_for(self, pattern):
        """The match of the next line that holds `pattern`."""
        for line in self._until(f"it did not say '{pattern}'"):
            if match := re.search(pattern, line):
                return match
        raise AssertionError(f"it ended before it said '{pattern}':\n" + self.output())

    def port(self):
        """The port on which this engine waits for a trainer; an engine that does not wait has said at once why."""
        said = self.wait_for("^consac: (.*)").group(1)
        waits = re.fullmatch(r"waiting for a trainer on port (\d+)", said)
        assert waits, "it waits for no trainer:\n" + self.output()
        return int(waits.group(1))

    def finish(self):
        """Its exit code and all that it said."""
        for _ in self._until("it did not end"):
            pass
        return self.process.wait(timeout=DEADLINE_S), self.output()

    def output(self):
        return "\n".join(self.lines)

    def kill(self):
        self.process.kill()
        self.process.wait()


class Godot:
    """The engine with an imported copy of the project, and everything that was started with it."""

    def __init__(self, folder, work):
        self.folder, self.project, self.started = folder, work / "project", []
        # Nobody's own editor settings, and nothing left behind.
        self.environment = {**os.environ, "XDG_DATA_HOME": f"{work}/data", "XDG_CONFIG_HOME": f"{work}/config",
                            "XDG_CACHE_HOME": f"{work}/cache", "CONSAC_GODOT_CACHE": str(folder)}
        shutil.copytree(ROOT / "engines/godot", self.project, ignore=shutil.ignore_patterns(".godot"))
        if (self.project / "addons/consac/bin/consac.gdextension").exists():
            # An editor without a window that meets an extension for the first time may crash when it ends (Godot's issue 111048).
            (self.project / ".godot").mkdir()
            (self.project / ".godot/extension_list.cfg").write_text("res://addons/consac/bin/consac.gdextension\n")
        imported = subprocess.run([folder / "godot", "--headless", "--path", self.project, "--import"],
                                  capture_output=True, text=True, timeout=DEADLINE_S, env=self.environment)
        said = imported.stdout + imported.stderr
        assert imported.returncode == 0 and "ERROR" not in said, said

    def start(self, *command, cwd=None):
        self.started.append(Program(command, self.environment, cwd))
        return self.started[-1]

    def scene(self, example, *arguments, flags=(), program=None):
        """An example that waits for a trainer: the program and its port. In pure GDScript."""
        settings = ["--consac-port=0", "--consac-protocol=text1", *(f"--consac-{argument}" for argument in arguments)]
        command = [program] if program else [self.folder / "godot", "--path", self.project]
        scene = [] if program else [f"res://examples/{example}/{example}.tscn"]
        engine = self.start(*command, "--headless", *flags, *scene, "--", *settings)
        return engine, engine.port()

    def consac(self, verb, *arguments, cwd):
        return self.start(CONSAC, verb, *arguments, cwd=cwd)

    def stop(self):
        for program in self.started:
            if program.process.poll() is None:
                program.kill()
        self.started.clear()


class Trainer:
    """A trainer of text protocol 1 in a few lines: connects, and exchanges actions for observations."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=DEADLINE_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.file = self.socket.makefile("r")

    def line(self):
        return self.file.readline().rstrip("\n")

    def begin(self):
        """The setup's fields and the first observation."""
        return self.line().split("#"), self.line()

    def step(self, action):
        """The observation that answers, and with an episode's end also the next one's first."""
        self.socket.sendall(f"{action}\n".encode())
        lines = [self.line()]
        if lines[0].endswith("#1"):
            lines.append(self.line())
        return lines

    def close(self):
        self.file.close()
        self.socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
