"""examples/c and examples/csharp_native: games that stand on consac.h learn inside, act, and are learned from."""
import os
import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev"))
PROGRAMS = BUILD / "engines/c"


def run(*command, **options):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=300, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def check_learned(said):
    """A ball that is held in the middle pays 1 a step; one that stays where it begins, 0.5 on average."""
    reward = float(re.search(r"trained; acting by the model: 40000 steps, mean reward ([\d.]+)", said)[1])
    assert reward > 35, said


def check_acts(said):
    assert abs(float(re.search(r"from 1\.00 to (-?[\d.]+)", said)[1])) < 0.25, said


def test_a_game_in_c_learns_inside_and_its_model_acts(tmp_path):
    check_learned(run(PROGRAMS / "c_learn", tmp_path / "ball.consac"))
    check_acts(run(PROGRAMS / "c_act", tmp_path / "ball.consac"))


def test_what_cannot_be_done_is_said_and_is_an_exit_code(tmp_path):
    refused = subprocess.run([PROGRAMS / "c_act", tmp_path / "nothing.consac"], capture_output=True, text=True)
    assert refused.returncode == 1 and "nothing.consac" in refused.stderr and refused.stdout == ""


def test_our_trainer_learns_from_a_game_in_c(tmp_path):
    with subprocess.Popen([PROGRAMS / "c_serve", "0"], stdout=subprocess.PIPE, text=True) as game:
        url = re.fullmatch(r"listening on (tcp://127\.0\.0\.1:\d+)\n", game.stdout.readline())[1]
        run(BUILD / "cli/consac", "train", url, "--seed", 1, "--name", "ball", "--no-progress", "--set", "n_steps=64",
            "--set", "learning_rate=1e-3", cwd=tmp_path)
        assert game.stdout.read() == "trained\n"
        assert game.wait(timeout=30) == 0
    check_acts(run(PROGRAMS / "c_act", tmp_path / "runs/ball/model.consac"))


def test_a_game_in_csharp_learns_inside_and_its_model_acts(tmp_path):
    run("mcs", "-langversion:7", "-warnaserror", f"-out:{tmp_path}/learn.exe", *sorted((ROOT / "examples/csharp_native").glob("*.cs")))
    said = run("mono", tmp_path / "learn.exe", tmp_path / "ball.consac", env={**os.environ, "LD_LIBRARY_PATH": str(PROGRAMS)})
    check_learned(said)
    check_acts(said)


# The smallest thing that acts fits on a screen, and so does each of the others.
@pytest.mark.parametrize("name", ["act", "learn", "serve"])
def test_examples_are_short(name):
    assert len((ROOT / f"examples/c/{name}.c").read_text().splitlines()) < 60
