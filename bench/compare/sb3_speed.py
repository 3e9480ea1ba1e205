#!/usr/bin/env python3
"""Stable Baselines3's PPO on CartPole beside `consac bench`, on one core, in turn. Prints steps/s of both and the ratio.

    .venv/bin/python bench/compare/sb3_speed.py build/release/cli/consac
"""
import json
import subprocess
import sys
import time

import gymnasium
import stable_baselines3
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

torch.set_num_threads(1)
JOBS = [
    ("cartpole", "1 world, n_steps 2048, batch 64, 10 epochs", 1, 8192, {}),
    ("cartpole8", "8 worlds, n_steps 128, batch 256, 4 epochs", 8, 32768, {"n_steps": 128, "batch_size": 256, "n_epochs": 4}),
]


def ours(consac, row):
    output = subprocess.run([consac, "bench", "--only", row, "--repeats", "3", "--json"], capture_output=True, text=True, check=True).stdout
    return json.loads(output)["rows"][0]["value"] * 1e3


def theirs(worlds, steps, settings):
    model = PPO("MlpPolicy", make_vec_env("CartPole-v1", worlds), device="cpu", seed=1, **settings)
    start = time.perf_counter()
    model.learn(steps)
    return steps / (time.perf_counter() - start)


if __name__ == "__main__":
    print(f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}, gymnasium {gymnasium.__version__}\n")
    print("| CartPole PPO | consac steps/s | Stable Baselines3 steps/s | ratio |\n|---|---|---|---|")
    for row, text, worlds, steps, settings in JOBS:
        pairs = [(ours(sys.argv[1], row), theirs(worlds, steps, settings)) for _ in range(3)]
        ratios = sorted(a / b for a, b in pairs)
        a, b = sorted(pairs)[1]
        print(f"| {text} | {a:,.0f} | {b:,.0f} | {ratios[1]:.0f}x |", flush=True)
