"""consac.exe under Wine: it trains, serves, resumes after a kill, and is at peace with its sister on Linux.

Run by tools/windows.sh, which sets CONSAC_WINDOWS_PROGRAM. Where the program of this system is built too (CONSAC_PROGRAM), the
two train each other's worlds and judge each other's models.
"""
import json
import os
import pathlib
import signal
import subprocess
import time

import pytest

EXE = os.environ["CONSAC_WINDOWS_PROGRAM"]
NATIVE = os.environ.get("CONSAC_PROGRAM", "")
WINDOWS = ["wine", EXE]
QUIET = ["--no-table", "--no-progress", "--no-tensorboard", "--json"]
ROAD = ["--set", "n_steps=32", "--seed", "3"]
needs_native = pytest.mark.skipif(not NATIVE, reason="CONSAC_PROGRAM is not set: the program is not built for this system")


def run(program: list[str], *arguments: str, code: int = 0) -> str:
    """What it printed, on standard error where it was to fail with `code`."""
    done = subprocess.run([*program, *arguments], capture_output=True, text=True, timeout=240)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stderr if code else done.stdout


def train(program: list[str], folder: pathlib.Path, *arguments: str) -> dict:
    """The line of JSON that a training ends with."""
    return json.loads(run(program, "train", *arguments, "--dir", str(folder), *QUIET).splitlines()[-1])


def reward(program: list[str], model: str | pathlib.Path) -> float:
    verdict = json.loads(run(program, "eval", str(model), "road-v0", "--episodes", "10", "--seed", "5", "--json").splitlines()[-1])
    return verdict["mean_reward"] / verdict["mean_length"]


class Served:
    """The road, offered by `program` while the block lasts."""

    def __init__(self, program: list[str], folder: pathlib.Path, *arguments: str) -> None:
        self.command = [*program, "serve", "road-v0", "--port", "0", "--port-file", str(folder / "port"), "--sessions", "1", *arguments]
        self.port_file = folder / "port"

    def __enter__(self) -> str:
        self.process = subprocess.Popen(self.command, stdout=subprocess.DEVNULL)
        end = time.monotonic() + 60
        while not (self.port_file.exists() and self.port_file.read_text().strip()):
            assert self.process.poll() is None and time.monotonic() < end, "no port was opened"
            time.sleep(0.02)
        return f"tcp://127.0.0.1:{self.port_file.read_text().strip()}"

    def __exit__(self, *_: object) -> None:
        try:
            assert self.process.wait(20) == 0
        finally:
            self.process.kill()


def test_the_demo_learns_the_road_and_draws_its_curve(tmp_path):
    said = run(WINDOWS, "demo", "--dir", str(tmp_path))
    share = float(said.split("nearer to the coin in ")[1].split("%")[0])
    assert share > 95.0
    assert (tmp_path / "demo/curve.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (tmp_path / "demo/curve.svg").read_bytes()
    assert (tmp_path / "demo/model.consac").is_file() and list((tmp_path / "demo/tensorboard").rglob("events.*"))


@pytest.mark.parametrize("protocol", ["text1", "2"])
def test_two_programs_train_over_tcp(tmp_path, protocol):
    with Served(WINDOWS, tmp_path, "--steps", "20000") as url:
        summary = train(WINDOWS, tmp_path, url, "--name", "road", "--protocol", protocol)
    assert summary["steps"] >= 20000
    assert reward(WINDOWS, tmp_path / "road/model.consac") > 0.95


def test_a_run_killed_and_resumed_is_the_run_that_nobody_touched(tmp_path):
    settings = ["road-v0", *ROAD, "--steps", "16000", "--set", "checkpoint_every_updates=1"]
    whole = train(WINDOWS, tmp_path, *settings, "--name", "whole")
    killed = subprocess.Popen([*WINDOWS, "train", *settings, "--name", "killed", "--dir", str(tmp_path), *QUIET],
                              stdout=subprocess.DEVNULL, start_new_session=True)
    end = time.monotonic() + 60
    while not (tmp_path / "killed/model.consac").exists():
        assert killed.poll() is None and time.monotonic() < end, "no checkpoint was written"
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    assert killed.wait() == -signal.SIGKILL, "it had time to finish"
    assert list((tmp_path / "killed/checkpoints").glob("*.consac"))
    assert run(WINDOWS, "inspect", str(tmp_path / "killed/model.consac")), "the model of the last checkpoint is left"
    resumed = train(WINDOWS, tmp_path, "--resume", "--name", "killed")
    assert resumed["weights_hash"] == whole["weights_hash"] and resumed["steps"] == whole["steps"]


def test_a_run_has_one_trainer(tmp_path):
    first = subprocess.Popen([*WINDOWS, "train", "road-v0", "--steps", "100000000", "--name", "road", "--dir", str(tmp_path), *QUIET],
                             stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        end = time.monotonic() + 60
        while not (tmp_path / "road/config.yaml").exists():
            assert first.poll() is None and time.monotonic() < end
            time.sleep(0.02)
        assert "another process" in run(WINDOWS, "train", "--resume", "--name", "road", "--dir", str(tmp_path), code=2)
    finally:
        os.killpg(first.pid, signal.SIGKILL)
        first.wait()


def test_a_folder_in_any_language(tmp_path):
    folder = tmp_path / "Läufe 走る"
    summary = train(WINDOWS, folder, "road-v0", *ROAD, "--steps", "640", "--name", "road")
    assert (folder / "road/model.consac").is_file() and summary["model"].startswith(str(folder))
    assert run(WINDOWS, "inspect", str(folder / "road/model.consac"))


def test_a_folder_with_backslashes(tmp_path):
    folder = "Z:" + str(tmp_path).replace("/", "\\") + "\\runs"
    settings = ["--name", "road", "--dir", folder, *QUIET]
    run(WINDOWS, "train", "road-v0", *ROAD, "--steps", "640", "--set", "checkpoint_every_updates=2", *settings)
    assert len(list((tmp_path / "runs/road/checkpoints").glob("*.consac"))) == 3
    again = json.loads(run(WINDOWS, "train", "--resume", "--steps", "1280", *settings).splitlines()[-1])
    assert again["steps"] == 1280 and len((tmp_path / "runs/road/progress.csv").read_text().splitlines()) == 1 + 40
    assert reward(WINDOWS, folder + "\\road\\model.consac") > 0.0


@needs_native
def test_both_systems_train_each_others_worlds(tmp_path):
    for name, engine, trainer in (("engine", WINDOWS, [NATIVE]), ("trainer", [NATIVE], WINDOWS)):
        folder = tmp_path / name
        folder.mkdir()
        with Served(engine, folder, "--steps", "20000") as url:
            train(trainer, folder, url, "--name", "road")
        assert reward(trainer, folder / "road/model.consac") > 0.95


@needs_native
def test_a_model_is_the_same_on_both_systems(tmp_path):
    train(WINDOWS, tmp_path, "road-v0", "--steps", "20000", "--seed", "1", "--name", "road")
    model = tmp_path / "road/model.consac"
    assert reward(WINDOWS, model) == reward([NATIVE], model) > 0.95
