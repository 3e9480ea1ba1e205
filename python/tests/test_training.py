"""`consac.train`: the program as a child, its progress, what it leaves, and how it ends."""
import os
import signal
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

import consac
from consac.training import Progress, progress_line
from program import OUR_ENVIRONMENT, PROGRAM, needs_program
from waiting import ENDS_S, until

pytestmark = needs_program


@pytest.fixture(autouse=True)
def our_program(monkeypatch):
    monkeypatch.setenv("CONSAC_PROGRAM", str(PROGRAM))


def test_a_world_is_learned_and_its_policy_acts(tmp_path):
    seen = []
    done = consac.train("cartpole-v1", steps=4096, seed=1, directory=tmp_path, progress=False, on_progress=seen.append)
    assert done.steps == 4096 and not done.interrupted and done.model.is_file() and done.directory.parent == tmp_path
    assert int(done.policy.act(np.zeros(4, np.float32))) in (0, 1)
    assert all(one.total_steps == 4096 and 0 < one.steps <= 4096 for one in seen)


def test_the_same_seed_gives_the_same_weights_in_a_run_of_its_own(tmp_path):
    first, second = (consac.train("cartpole-v1", steps=1024, seed=3, directory=tmp_path, progress=False) for _ in range(2))
    assert first.directory != second.directory and first.weights_hash == second.weights_hash
    other = consac.train("cartpole-v1", steps=1024, seed=3, directory=tmp_path, progress=False, gamma=0.5, normalize_advantage=False)
    assert other.weights_hash != first.weights_hash


def test_where_on_progress_says_so_it_ends_and_can_go_on(tmp_path):
    options = {"seed": 2, "name": "halves", "progress": False}
    whole = consac.train("cartpole-v1", steps=300_000, directory=tmp_path / "whole", **options)
    half = consac.train("cartpole-v1", steps=300_000, directory=tmp_path, on_progress=lambda seen: False, **options)
    assert half.interrupted and 0 < half.steps < 300_000
    rest = consac.train(None, name="halves", directory=tmp_path, resume=True, progress=False)
    assert rest.steps == 300_000 and rest.weights_hash == whole.weights_hash


def test_ctrl_c_saves_and_is_raised(tmp_path):
    script = f"import consac; consac.train('cartpole-v1', steps=10**9, name='cut', directory={str(tmp_path)!r})"
    process = subprocess.Popen([sys.executable, "-c", script], env=OUR_ENVIRONMENT | {"CONSAC_PROGRAM": str(PROGRAM)}, stderr=subprocess.PIPE, text=True)
    progress = tmp_path / "cut/progress.csv"
    until(lambda: process.poll() is not None or progress.is_file() and progress.stat().st_size > 1000, "the first updates")
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=ENDS_S)[1]
    assert process.returncode == -signal.SIGINT and "KeyboardInterrupt" in said
    assert (tmp_path / "cut/model.consac").is_file()


class Right(gymnasium.Env):
    """Pays for action 1; ten steps long."""
    observation_space, action_space = gymnasium.spaces.Box(0, 1, (1,), np.float32), gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.left = 10
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.left -= 1
        return np.zeros(1, np.float32), float(action), False, self.left == 0, {}


def test_an_environment_of_this_process_is_learned(tmp_path):
    done = consac.train(Right, envs=2, steps=4000, seed=1, directory=tmp_path, progress=False, learning_rate=1e-2)
    assert int(done.policy.act(np.zeros(1, np.float32))) == 1 and done.mean_rewards["default"] > 7


@pytest.mark.parametrize("arguments, said, code", [
    (dict(env="cartpol-v1"), "cartpol-v1", 2),
    (dict(env="cartpole-v1", learning_rat=1), "learning_rat", 2),
    (dict(env="tcp://127.0.0.1:9", connect_timeout_s=0), "127.0.0.1:9", 3),
    (dict(env=None), "needs an env", None),
    (dict(env="cartpole-v1", resume=True), "no env", None)])
def test_a_failure_is_one_line_of_the_programs(tmp_path, arguments, said, code):
    with pytest.raises(consac.ProgramError) as caught:
        consac.train(directory=tmp_path, progress=False, **arguments)
    assert said in str(caught.value) and "\n" not in str(caught.value) and caught.value.exit_code == code


def test_a_run_that_is_there_is_overwritten_only_when_asked(tmp_path):
    options = {"steps": 512, "name": "same", "directory": tmp_path, "progress": False}
    consac.train("cartpole-v1", **options)
    with pytest.raises(consac.ProgramError, match="exists"):
        consac.train("cartpole-v1", **options)
    seen = []
    assert consac.train("cartpole-v1", force=True, on_progress=seen.append, **options).steps == 512
    assert all(one.steps <= 512 for one in seen)


def test_without_a_terminal_progress_is_lines(tmp_path, capsys):
    consac.train("cartpole-v1", steps=2048, seed=1, directory=tmp_path)
    said = capsys.readouterr().err
    assert "100% 2,048/2,048 steps | reward " in said and "\r" not in said


def test_a_bar_says_how_far_it_is():
    line = progress_line(Progress(42_000, 100_000, 4.2, 180.0, {}), 10)
    assert line == " 42% [####------] 42,000/100,000 steps | reward 180 | 10,000 steps/s | 0:05 left"
    assert progress_line(Progress(500, None, 1.0, None, {}), 10) == "500 steps | 500 steps/s"
    before = Progress(90_000, None, 1.0, None, {})  # of a run that goes on: not all steps are this process's
    assert progress_line(Progress(90_500, None, 3.0, None, {}), 10, before) == "90,500 steps | 250 steps/s"
    assert progress_line(before, 10, before) == "90,000 steps"


def test_a_program_that_is_not_there_is_said(monkeypatch):
    monkeypatch.setenv("CONSAC_PROGRAM", "/nowhere/consac")
    with pytest.raises(consac.ProgramError, match="CONSAC_PROGRAM names no file: '/nowhere/consac'"):
        consac.find_program()


def test_the_program_on_the_path_is_found(monkeypatch, tmp_path):
    monkeypatch.delenv("CONSAC_PROGRAM")
    (tmp_path / "consac").write_text("#!/bin/sh\n")
    (tmp_path / "consac").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    assert consac.find_program() == tmp_path / "consac"
