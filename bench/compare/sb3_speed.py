#!/usr/bin/env python3
"""Stable Baselines3's PPO, A2C and DQN on CartPole, its SAC and TD3 on Pendulum, beside `consac bench`, on one core, in turn, processor
time. Prints steps/s of both and the ratio; of SAC and TD3 updates/s, one of which is in every step behind the first hundred.

    .venv/bin/python bench/compare/sb3_speed.py build/release/cli/consac [row of consac bench ...]
"""
import copy
import sys
import time

import gymnasium
import stable_baselines3
import torch
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3
from stable_baselines3.common.env_util import make_vec_env

from in_turn import in_turn, medians, rate

torch.set_num_threads(1)
PAIRS, STARTS = 3, 100
REPLAY = {"batch_size": 100, "learning_starts": STARTS, "train_freq": 1, "gradient_steps": 1, "policy_kwargs": {"net_arch": [64, 64]}}
JOBS = [
    ("cartpole", PPO, "PPO, 1 world, n_steps 2048, batch 64, 10 epochs", 1, 8192, {}),
    ("cartpole8", PPO, "PPO, 8 worlds, n_steps 128, batch 256, 4 epochs", 8, 32768, {"n_steps": 128, "batch_size": 256, "n_epochs": 4}),
    ("a2c", A2C, "A2C, 1 world, n_steps 5 (its defaults)", 1, 8192, {}),
    ("a2c8", A2C, "A2C, 8 worlds, n_steps 5", 8, 32768, {}),
    ("dqn", DQN, "DQN, 1 world, train_freq 4, batch 32 (its defaults)", 1, 16384, {}),
    # As many steps as ours: the first thousand have no updates.
    ("dqn256", DQN, "DQN, the Zoo's: 256x256, batch 64, train_freq 256, gradient_steps 128", 1, 50000,
     {"learning_rate": 2.3e-3, "batch_size": 64, "buffer_size": 100000, "learning_starts": 1000, "target_update_interval": 10,
      "train_freq": 256, "gradient_steps": 128, "exploration_fraction": 0.16, "exploration_final_eps": 0.04,
      "policy_kwargs": {"net_arch": [256, 256]}}),
    ("sac", SAC, "SAC, Pendulum, 64x64, batch 100, updates/s", 1, 1000, REPLAY),
    ("td3", TD3, "TD3, Pendulum, 64x64, batch 100, updates/s", 1, 1000, REPLAY),
]


def theirs(algorithm, worlds, steps, settings):
    """Steps/s, or updates/s of SAC and TD3."""
    replay = algorithm in (SAC, TD3)
    model = algorithm("MlpPolicy", make_vec_env("Pendulum-v1" if replay else "CartPole-v1", worlds), device="cpu", seed=1, **copy.deepcopy(settings))  # it writes into them
    start = time.process_time()
    model.learn(steps)
    return (steps - STARTS * replay) / (time.process_time() - start)


if __name__ == "__main__":
    consac, *rows = sys.argv[1:]
    print(f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}, gymnasium {gymnasium.__version__}; processor time, the median of {PAIRS} pairs\n")
    print("| what | consac a second | Stable Baselines3 a second | ratio |\n|---|---|---|---|")
    for row, algorithm, text, *how in JOBS:
        if not rows or row in rows:
            mine, other, ratio = medians(in_turn(lambda: rate(consac, row), lambda: theirs(algorithm, *how), PAIRS))
            print(f"| {text} | {mine:,.0f} | {other:,.0f} | {ratio:.0f}x |", flush=True)
