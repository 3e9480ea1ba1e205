"""cartpole-v1 and pendulum-v1 against Gymnasium's own, step by step over random episodes, within float rounding."""
import os
import pathlib
import subprocess

import gymnasium
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TRACE = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev")) / "tests/worlds_trace"
EPISODES, LENGTH = 200, 200


def ours(lines):
    output = subprocess.run([TRACE], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True).stdout
    return [[[float(number) for number in row.split()] for row in episode.splitlines()] for episode in output.split("\n\n")[: len(lines)]]


def starts(world, rng):
    if world == "cartpole-v1":
        return rng.uniform(-0.05, 0.05, 4) if rng.random() < 0.5 else rng.uniform([-2.3, -1, -0.2, -1], [2.3, 1, 0.2, 1])
    return rng.uniform([-np.pi, -8], [np.pi, 8])


@pytest.mark.parametrize("world, name", [("cartpole-v1", "CartPole-v1"), ("pendulum-v1", "Pendulum-v1")])
def test_equals_gymnasium_step_by_step(world, name):
    rng = np.random.default_rng(1)
    env = gymnasium.make(name).unwrapped
    episodes = []
    for _ in range(EPISODES):
        actions = rng.integers(0, 2, LENGTH) if world == "cartpole-v1" else rng.uniform(-2.5, 2.5, LENGTH).astype(np.float32)
        episodes.append((starts(world, rng), actions))
    traces = ours([f"{world} {' '.join(repr(float(v)) for v in start)} : {' '.join(repr(float(a)) for a in actions)}" for start, actions in episodes])
    compared = 0
    for (start, actions), trace in zip(episodes, traces):
        env.reset(seed=0)
        env.state = np.array(start, dtype=np.float64)
        for action, row in zip(actions, trace):
            observation, reward, terminated, _, _ = env.step(int(action) if world == "cartpole-v1" else np.array([action]))
            np.testing.assert_allclose(row[2:], observation, rtol=2e-6, atol=2e-6)
            np.testing.assert_allclose(row[0], reward, rtol=2e-6, atol=2e-6)
            assert bool(row[1]) == bool(terminated)
            compared += 1
            if terminated:
                break
    assert compared > 3000


def test_spaces_and_time_limits_are_gymnasiums():
    consac = TRACE.parents[1] / "cli/consac"
    listed = subprocess.run([consac, "list", "worlds"], capture_output=True, text=True, check=True).stdout
    assert "Box([-4.8, -inf, -0.4188790" in listed
    assert gymnasium.make("CartPole-v1").spec.max_episode_steps == 500
    assert gymnasium.make("Pendulum-v1").spec.max_episode_steps == 200
