"""What must hold of the program whatever it is given: runs it in a folder of its own and judges how it ended."""
from __future__ import annotations

import hashlib
import os
import resource
import signal
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

# docs/program.md; 1 is a mistake of our own and so a finding.
EXIT_CODES = {0, 2, 3, 6, 7, 130}
# What attackers write into texts where a second line or an escape would show that it went to the terminal as it was.
MARK = "HOSTILE-MARK"
FAKE_LINE = f"\n{MARK} training completed\n"
ESCAPES = "\x1b]0;" + MARK + "\x07\x1b[2J"


@dataclass
class Limits:
    seconds: float = 20.0  # from start to end
    mebibytes: int = 1024  # of resident memory; sanitizers take more
    codes: frozenset = frozenset(EXIT_CODES)


@dataclass
class Ended:
    """How a program ended, and what is wrong with that; no finding is an empty list."""
    code: int = 0
    output: bytes = b""
    seconds: float = 0.0
    mebibytes: int = 0
    findings: list[str] = field(default_factory=list)


class Arena:
    """A folder whose files nothing may touch but what lies below `runs`."""

    def __init__(self, folder: Path):
        self.outer = folder
        self.home = folder / "home" / "user" / "place"
        self.home.mkdir(parents=True)
        for name in (".bashrc", "home/user/.bashrc", "home/user/notes.txt", "home/user/place/config.yaml", "home/user/place/mine.consac"):
            (folder / name).write_text("the user's own\n")
        self._before = self._state()

    def _state(self) -> dict[str, str]:
        state = {}
        for path in sorted(self.outer.rglob("*")):
            name = str(path.relative_to(self.outer))
            if not name.startswith("home/user/place/runs") and not name.startswith("attack"):
                state[name] = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
        return state

    def findings(self) -> list[str]:
        after = self._state()
        changed = [name for name in self._before.keys() | after.keys() if self._before.get(name) != after.get(name)]
        return [f"changed outside the run's folder: {sorted(changed)}"] if changed else []


def sanitized(program: str) -> bool:
    """Built with a sanitizer, which takes memory and time of its own."""
    code = Path(program).read_bytes()
    return b"__asan_init" in code or b"__tsan_init" in code


class Running:
    """A program under way. Its output goes to a file, so that it can never block on us."""

    def __init__(self, arguments: list[str], arena: Arena, prepare=None, stdin=subprocess.DEVNULL):
        self._log = open(arena.outer / "attack-output", "wb+")
        self._began = time.monotonic()
        environment = dict(os.environ, HOME=str(arena.home.parent), ASAN_OPTIONS="abort_on_error=1:allocator_may_return_null=1",
                           UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1",
                           TSAN_OPTIONS=f"suppressions={Path(__file__).with_name('tsan_suppressions.txt')}")

        def begin():
            for heard in (signal.SIGINT, signal.SIGHUP):  # which a shell lets its background jobs ignore, and theirs
                signal.signal(heard, signal.SIG_DFL)
            if prepare is not None:
                prepare()
        self.process = subprocess.Popen(arguments, cwd=arena.home, stdin=stdin, stdout=self._log, stderr=subprocess.STDOUT,
                                        env=environment, preexec_fn=begin)
        self._arguments, self._arena = arguments, arena

    def output(self) -> bytes:
        return Path(self._log.name).read_bytes()

    def alive(self) -> bool:
        """Whether it still runs; leaves its end to end()."""
        return os.waitid(os.P_PID, self.process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None

    def end(self, limits: Limits) -> Ended:
        """Waits for the end, or makes one once its time is over, and judges it."""
        ended = Ended()
        usage = self._wait(limits, ended)
        ended.seconds = time.monotonic() - self._began
        ended.mebibytes = usage.ru_maxrss // 1024 if usage else 0
        ended.output = self.output()
        self._log.close()
        memory = limits.mebibytes * (4 if sanitized(self._arguments[0]) else 1)
        if ended.code < 0:
            ended.findings.append(f"ended by {signal.Signals(-ended.code).name}")
        elif ended.code not in limits.codes:
            ended.findings.append(f"exit code {ended.code}, expected one of {sorted(limits.codes)}")
        if ended.mebibytes > memory:
            ended.findings.append(f"{ended.mebibytes} MiB of memory, allowed are {memory}")
        ended.findings += said_wrongly(ended.output) + self._arena.findings()
        return ended

    def _wait(self, limits: Limits, ended: Ended):
        until = self._began + limits.seconds * (3 if sanitized(self._arguments[0]) else 1)
        while time.monotonic() < until:
            pid, status, usage = os.wait4(self.process.pid, os.WNOHANG)
            if pid:
                self.process.returncode = ended.code = os.waitstatus_to_exitcode(status)
                return usage
            time.sleep(0.005)
        ended.findings.append(f"still running after {limits.seconds} s")
        self.process.kill()
        _, _, usage = os.wait4(self.process.pid, 0)
        self.process.returncode = ended.code = 0
        return usage


def said_wrongly(output: bytes) -> list[str]:
    """Findings in what went to the terminal."""
    findings = []
    for name in (b"AddressSanitizer", b"runtime error:", b"LeakSanitizer", b"terminate called", b"Assertion"):
        if name in output:
            findings.append(f"says {name.decode()!r}: {output[output.index(name):][:300]!r}")
    raw = sorted({byte for byte in output if byte < 32 and byte not in b"\n\r\t"} | ({127} & set(output)))
    if raw:
        findings.append(f"control characters {raw} reach the terminal")
    lines = output.replace(b"\r", b"\n").split(b"\n")
    if any(line.startswith(MARK.encode()) for line in lines):
        findings.append("a line of the attacker's stands by itself")
    if len(lines) > 4000:
        findings.append(f"{len(lines)} lines of output")
    return findings


def limit_resources(**limits: int):
    """For Popen's preexec_fn: limit_resources(NOFILE=32, AS=1 << 30)."""
    def prepare():
        for name, value in limits.items():
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))
    return prepare
