"""Type hints of the Python package, as mypy --strict sees them, and as it sees a program that uses the package."""
import pathlib
import subprocess
import sys

import pytest

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "python"
PROGRAM = """
import numpy as np

import consac
from consac.policy import Policy, load_policy
from consac.training import Progress


def shown(seen: Progress) -> bool:
    return seen.mean_reward is None or seen.mean_reward < 475


def learned(path: str) -> Policy:
    policy = load_policy(path)
    actions, _ = policy.predict(np.zeros((3, 4), np.float32))
    print(policy.backend, actions)
    return policy


error: Exception = consac.ConsacError("said")
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("mypy")


def mypy(*arguments, cache):
    return subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", cache, *arguments], cwd=PACKAGE, capture_output=True, text=True, timeout=300)


def test_the_package_is_typed(cache):
    done = mypy("consac", cache=cache)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_strict_program_can_use_it(tmp_path, cache):
    (tmp_path / "program.py").write_text(PROGRAM)
    done = mypy(tmp_path / "program.py", cache=cache)
    assert done.returncode == 0, done.stdout + done.stderr
    (tmp_path / "program.py").write_text(PROGRAM.replace("-> Policy:", "-> int:"))
    wrong = mypy(tmp_path / "program.py", cache=cache)
    assert wrong.returncode == 1 and "return" in wrong.stdout, wrong.stdout
