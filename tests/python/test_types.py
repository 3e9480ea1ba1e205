"""Type hints of the Python package, as mypy --strict sees them, and as it sees a program that uses the package."""
import ast
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


def stepped(url: str) -> float:
    env = consac.make(url, timeout=5.0)
    env.reset(seed=1)
    _, reward, terminated, _, _ = env.step(env.action_space.sample())
    worlds = consac.make_vec(url, autoreset_mode="same_step")
    return float(reward) if terminated else float(worlds.num_envs)


def trained() -> str:
    done: consac.Training = consac.train("cartpole-v1", steps=1000, on_progress=shown)
    return done.weights_hash


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


def test_what_checkers_see_is_what_there_is():
    """The names that are imported when they are asked for stand in __init__.py once more, for checkers."""
    tree = ast.parse((PACKAGE / "consac/__init__.py").read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If) and isinstance(node.test, ast.Name))
    seen = {name.name for line in block.body if isinstance(line, ast.ImportFrom) for name in line.names}
    lists = {node.targets[0].id: ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id in ("_LAZY", "_MODULES")}
    assert seen == {*lists["_LAZY"], *lists["_MODULES"]}
