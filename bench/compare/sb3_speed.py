#!/usr/bin/env python3
"""Stable Baselines3's PPO, A2C and DQN on CartPole beside `consac bench`, on one core, in turn. Prints steps/s of both and the ratio.

    .venv/bin/python bench/compare/sb3_speed.py build/release/cli/consac
"""
import json
import subprocess
import sys
import time

import gymnasium
import stable_baselines3
import torch
from stable_baselines3 import A2C, DQN, PPO
from stable_baselines3.common.env_util import make_vec_env

torch.set_num_threads(1)
JOBS = [
    ("cartpole", PPO, "PPO, 1 world, n_steps 2048, batch 64, 10 epochs", 1, 8192, {}),
    ("cartpole8", PPO, "PPO, 8 worlds, n_steps 128, batch 256, 4 epochs", 8, 32768, {"n_steps": 128, "batch_size": 256, "n_epochs": 4}),
    ("a2c", A2C, "A2C, 1 world, n_steps 5 (its defaults)", 1, 8192, {}),
    ("a2c8", A2C, "A2C, 8 worlds, n_steps 5", 8, 32768, {}),
    ("dqn", DQN, "DQN, 1 world, train_freq 4, batch 32 (its defaults)", 1, 16384, {}),
    ("dqn256", DQN, "DQN, the Zoo's: 256x256, batch 64, train_freq 256, gradient_steps 128", 1, 16384,
     {"learning_rate": 2.3e-3, "batch_size": 64, "buffer_size": 100000, "learning_starts": 1000, "target_update_interval": 10,
      "train_freq": 256, "gradient_steps": 128, "exploration_fraction": 0.16, "exploration_final_eps": 0.04,
      "policy_kwargs": {"net_arch": [256, 256]}}),
]


def ours(consac, row):
    output = subprocess.run([consac, "bench", "--only", row, "--repeats", "3", "--json"], capture_output=True, text=True, check=True).stdout
    return json.loads(output)["rows"][0]["value"] * 1e3


def theirs(algorithm, worlds, steps, settings):
    model = algorithm("MlpPolicy", make_vec_env("CartPole-v1", worlds), device="cpu", seed=1, **settings)
    start = time.perf_counter()
    model.learn(steps)
    return steps / (time.perf_counter() - start)


if __name__ == "__main__":
    print(f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}, gymnasium {gymnasium.__version__}\n")
    print("| CartPole | consac steps/s | Stable Baselines3 steps/s | ratio |\n|---|---|---|---|")
    for row, algorithm, text, worlds, steps, settings in JOBS:
        pairs = [(ours(sys.argv[1], row), theirs(algorithm, worlds, steps, settings)) for _ in range(3)]
        ratios = sorted(a / b for a, b in pairs)
        a, b = sorted(pairs)[1]
        print(f"| {text} | {a:,.0f} | {b:,.0f} | {ratios[1]:.0f}x |", flush=True)
