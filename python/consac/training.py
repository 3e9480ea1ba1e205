"""`consac.train(...)`: the program trains as a child of this process; here is its progress, and what came of it."""
from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from .errors import ProgramError
from .names import quote
from .program import find_program

if TYPE_CHECKING:
    from .policy import Policy

LOOK_EVERY = 0.1  # s between looks at how far a training is
LINE_EVERY = 10.0  # s between lines where there is no terminal
WIDTH = 30  # of the bar
STEPS = ("total_timesteps", "time/total_timesteps")  # columns of progress.csv, as either Stable Baselines calls them
REWARDS = ("ep_reward_mean", "rollout/ep_rew_mean")
# Told of Ctrl-C by us, once, not by the terminal as well: two of them end the program at once.
APART: dict[str, Any] = {"creationflags": 0x200} if os.name == "nt" else {"start_new_session": True}


@dataclass(frozen=True)
class Progress:
    """How far a training is, for `on_progress`."""
    steps: int
    total_steps: int | None  # None while that is not known
    seconds: float  # since the program was started
    mean_reward: float | None  # of the last 100 episodes; None before the first has ended, or with several behaviours
    row: Mapping[str, str]  # the last row of progress.csv, as it stands there


@dataclass(frozen=True)
class Training:
    """What came of a training."""
    directory: Path
    steps: int
    seconds: float
    interrupted: bool  # `on_progress` ended it
    weights_hash: str  # equal for equal weights
    models: Mapping[str, Path]  # by behaviour; "default" where there is one
    mean_rewards: Mapping[str, float | None]  # by behaviour, of the last 100 episodes

    @property
    def model(self) -> Path:
        """The one model; ProgramError where there are several."""
        if len(self.models) != 1:
            raise ProgramError(f"this run has models of the behaviours {', '.join(map(quote, self.models))}; take one from models")
        return next(iter(self.models.values()))

    @property
    def policy(self) -> Policy:
        """The one model, loaded."""
        from .policy import load_policy

        return load_policy(self.model)

    @property
    def policies(self) -> dict[str, Policy]:
        """All models, loaded, by behaviour."""
        from .policy import load_policy

        return {behaviour: load_policy(path) for behaviour, path in self.models.items()}


def train(env: str | Callable[[], Any] | None = None, *, algo: str | None = None, steps: int | None = None, seed: int | None = None, envs: int | None = None,
          name: str | None = None, directory: str | os.PathLike[str] = "runs", force: bool = False, resume: bool = False,
          progress: bool = True, on_progress: Callable[[Progress], object] | None = None, token: str | None = None,
          arguments: tuple[str, ...] | list[str] = (), **settings: Any) -> Training:
    """Learns `env` with the program `consac`, and says what came of it.

    env: a built-in world ("cartpole-v1"), an engine ("tcp://127.0.0.1:5005"), or a callable that makes a Gymnasium or PettingZoo environment, which is
    then served from this process; None to go on with a run (`resume`). steps, seed, envs and algo are the program's flags; what is None has its
    default. name: of the run, whose folder is directory/name; without one a free one is taken. force: overwrites a run of that name.
    settings: hyperparameters and fields of the configuration, as --set (`gamma=0.9`, `preset="sb3"`). arguments: further flags of `consac train`, as they are.
    progress: a bar on standard error, lines where that is no terminal. on_progress: called with a Progress after an update, ten times a second
    at most; where it returns False the training ends, saved. Ctrl-C does too, and then raises KeyboardInterrupt.

    ProgramError, of one line, where the program is not found or fails.
    """
    program, folder = find_program(), Path(directory)
    if resume and (name is None or env is not None):
        raise ProgramError("resume=True goes on with the run that `name` names, in the world that it began with; give name, and no env")
    if env is None and not resume:
        raise ProgramError("train() needs an env: a world (consac list worlds), tcp://host:port, or a callable that makes an environment")
    name = name if name is not None else _free_name(folder, env, algo)
    with contextlib.ExitStack() as stack:
        flags = ["--dir", str(folder), "--name", name, "--json"]
        if callable(env):
            from .serve import Server

            server = stack.enter_context(Server(env, envs or 1))
            flags += [f"tcp://127.0.0.1:{server.port}"]
        else:
            flags += ([env] if env is not None else []) + (["--envs", str(envs)] if envs is not None else [])
        flags += [text for flag, value in (("--algo", algo), ("--steps", steps), ("--seed", seed)) if value is not None for text in (flag, str(value))]
        flags += [flag for flag, wanted in (("--force", force), ("--resume", resume)) if wanted]
        flags += [text for key, value in settings.items() for text in ("--set", f"{key}={_written(value)}")]
        environment = os.environ if token is None else {**os.environ, "CONSAC_TOKEN": token}
        said, told = stack.enter_context(tempfile.TemporaryFile()), stack.enter_context(tempfile.TemporaryFile())
        watch = _Watch(folder / name, told, progress, on_progress, resume)
        child = subprocess.Popen([program, "train", *flags, *arguments], stdin=subprocess.DEVNULL, stdout=said, stderr=told, env=environment, **APART)
        try:
            ended_by_us = watch.follow(child)
        finally:
            _end(child)
            watch.finish(failed=child.returncode != 0)
        said.seek(0)
        result = said.read().decode("utf-8", "replace").strip()
    if child.returncode != 0 and not (ended_by_us and result):
        raise ProgramError(watch.last_line or f"consac train ended with the code {child.returncode} and said nothing", child.returncode)
    return _training(json.loads(result.splitlines()[-1]))


def _written(value: Any) -> str:
    """A setting as the program reads it."""
    return {True: "true", False: "false", None: "none"}.get(value, str(value)) if isinstance(value, (bool, type(None))) else str(value)


def _free_name(folder: Path, env: Any, algo: str | None) -> str:
    world = getattr(env, "__name__", "environment") if callable(env) else str(env).split("://")[-1]
    base = "".join(c if c.isalnum() and c.isascii() or c in "-_." else "-" for c in world).strip("-.") or "run"
    count = 0
    while (folder / f"{base}__{algo or 'ppo2'}__py{count}").exists():
        count += 1
    return f"{base}__{algo or 'ppo2'}__py{count}"


def _training(result: dict[str, Any]) -> Training:
    each = result.get("behaviours") or ({"default": result} if result.get("model") else {})
    return Training(Path(result["directory"]), result["steps"], result["seconds"], result["interrupted"], result["weights_hash"],
                    {behaviour: Path(one["model"]) for behaviour, one in each.items()},
                    {behaviour: one["mean_episode_reward"] for behaviour, one in each.items()})


def _end(child: subprocess.Popen[bytes]) -> None:
    """Lets a child that still trains save and end; kills it where a second Ctrl-C says so."""
    if child.poll() is not None:
        return
    try:
        child.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))
        child.wait()
    except KeyboardInterrupt:
        child.kill()
        child.wait()
        raise


class _Watch:
    """Looks at a run that trains: its progress.csv, and what the program says on standard error."""

    def __init__(self, directory: Path, told: Any, shown: bool, on_progress: Callable[[Progress], object] | None, resumed: bool = False):
        self._csv, self._config, self._told = directory / "progress.csv", directory / "config.yaml", told
        self._shown, self._on_progress = shown, on_progress
        self._began_ns, self._begun = time.time_ns() - 20_000_000, time.monotonic()  # a file system's clock may lie behind by a tick
        self._header: list[str] = []
        self._total: int | None = None
        self._at, self._told_at, self._line_at = 0, 0, 0.0
        self._last: Progress | None = None
        self._resumed = resumed
        self._first: Progress | None = None  # of a run that goes on, not made by this process alone
        self._stream: TextIO = sys.stderr
        self._bar = shown and (self._stream.isatty() or "ipykernel" in sys.modules)
        self._drawn = 0
        self.last_line = ""

    def follow(self, child: subprocess.Popen[bytes]) -> bool:
        """Until the program ends, or `on_progress` has ended it: then True."""
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(LOOK_EVERY)
            ended = child.poll() is not None
            self._tell()
            if (seen := self._look()) is not None:
                self._show(seen)
                if self._on_progress is not None and self._on_progress(seen) is False and not ended:
                    _end(child)
                    return True
            if ended:
                return False

    def finish(self, failed: bool) -> None:
        """The last progress and the last line, but for one that an error is going to say."""
        self._tell()
        self._look()
        if self._last is not None:
            self._show(self._last, last=True)
        if self._drawn:
            self._stream.write("\n")
            self._drawn = 0
        if self._shown and self.last_line and not failed:
            self._write_line(self.last_line)
        self._stream.flush()

    def _tell(self) -> None:
        """Hands on what the program says to people; the last line is kept for an error, which says it."""
        self._told.seek(self._told_at)
        text = self._told.read()
        whole = text[:text.rfind(b"\n") + 1]
        self._told_at += len(whole)
        for line in whole.decode("utf-8", "replace").splitlines():
            if self._shown and self.last_line:
                self._write_line(self.last_line)
            self.last_line = line

    def _look(self) -> Progress | None:
        """What progress.csv says now, where that is more than before. A run that is overwritten has an older one until the program replaces it."""
        try:
            with open(self._csv, "rb") as file:
                status = os.fstat(file.fileno())
                if status.st_mtime_ns < self._began_ns:
                    return None
                if status.st_size < self._at:
                    self._at, self._header = 0, []
                file.seek(self._at)
                text = file.read()
        except OSError:
            return None
        whole = text[:text.rfind(b"\n") + 1]
        self._at += len(whole)
        lines = whole.decode("utf-8", "replace").splitlines()
        if not self._header and lines:
            self._header = lines.pop(0).split(",")
        if not lines:
            return None
        row = dict(zip(self._header, lines[-1].split(",")))
        steps, reward = (next((row[name] for name in names if row.get(name)), None) for names in (STEPS, REWARDS))
        if steps is None:
            return None
        self._last = Progress(int(float(steps)), self._total_steps(), time.monotonic() - self._begun, _number(reward), row)
        self._first = self._first or self._last
        return self._last

    def _total_steps(self) -> int | None:
        if self._total is None:
            with contextlib.suppress(OSError, ValueError):
                text = self._config.read_text(encoding="utf-8")
                total = int(next(line for line in text.splitlines() if line.startswith("steps:")).split("#")[0].split(":")[1])
                self._total = total if total > 0 else None
        return self._total

    def _show(self, seen: Progress, last: bool = False) -> None:
        if not self._shown:
            return
        text = progress_line(seen, WIDTH if self._bar else 0, self._first if self._resumed else None)
        if self._bar:
            self._stream.write("\r" + text.ljust(self._drawn))
            self._stream.flush()
            self._drawn = len(text)
        elif last or seen.seconds - self._line_at >= LINE_EVERY:
            self._line_at = seen.seconds
            self._stream.write(text + "\n")

    def _write_line(self, line: str) -> None:
        """A line of the program's above the bar."""
        self._stream.write(("\r" + " " * self._drawn + "\r" if self._drawn else "") + line + "\n")
        self._drawn = 0


def _number(text: str | None) -> float | None:
    try:
        value = float(text) if text else None
    except ValueError:
        return None
    return None if value is None or value != value else value


def progress_line(seen: Progress, width: int, since: Progress | None = None) -> str:
    """" 42% [####------] 42,000/100,000 steps | reward 180 | 12,345 steps/s | 0:05 left"; `width` 0 has no bar. The speed is that `since` then."""
    steps, seconds = (seen.steps, seen.seconds) if since is None else (seen.steps - since.steps, seen.seconds - since.seconds)
    rate = steps / seconds if seconds > 0 else 0.0
    parts = [f"{seen.steps:,} steps"]
    if seen.total_steps:
        share = min(seen.steps / seen.total_steps, 1.0)
        bar = f" [{'#' * int(share * width)}{'-' * (width - int(share * width))}]" if width else ""
        parts = [f"{int(100 * share):3d}%{bar} {seen.steps:,}/{seen.total_steps:,} steps"]
    if seen.mean_reward is not None:
        parts.append(f"reward {seen.mean_reward:.4g}")
    if rate > 0:
        parts.append(f"{rate:,.0f} steps/s")
    if seen.total_steps and rate > 0:
        left = int(max(seen.total_steps - seen.steps, 0) / rate)
        parts.append(f"{left // 3600}:{left // 60 % 60:02}:{left % 60:02} left" if left >= 3600 else f"{left // 60}:{left % 60:02} left")
    return " | ".join(parts)
