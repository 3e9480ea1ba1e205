#!/usr/bin/env python3
"""Stable Baselines3's default PPO beside CONSAC's default `ppo`, on the very same worlds: SB3 learns ours over text
protocol 1 through the few lines below. Five seeds; mean return with sampled actions (the policy that PPO
optimises; taken greedily, a half-learned one may walk to and fro between two cells of the maze for ever).

    .venv/bin/python bench/compare/sb3_learn.py build/release/cli/consac point-v0 maze-v0 reach3-v0
"""
import json
import pathlib
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

# 51,200 steps are 25 whole rollouts of 2048: both sides learn from every step.
SEEDS, STEPS, LIMIT, EPISODES = range(1, 11), 51_200, 100, 300


def make_env(consac, world, seed):
    """A Gymnasium environment over `consac serve`. An episode's end at the time limit is a truncation."""
    import gymnasium
    import numpy as np

    class Served(gymnasium.Env):
        def __init__(self):
            self.port_file = pathlib.Path(tempfile.mkdtemp()) / "port"
            self.server = subprocess.Popen([consac, "serve", world, "--port", "0", "--port-file", str(self.port_file), "--steps", "100000000", "--seed", str(seed)],
                                           stdout=subprocess.DEVNULL)
            while not self.port_file.exists():
                time.sleep(0.01)
            connection = socket.create_connection(("127.0.0.1", int(self.port_file.read_text())))
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self.stream = connection.makefile("rw", newline="\n")
            fields = self.stream.readline().strip().split("#")
            self.action_space, self.observation_space = self.space(*fields[0:3]), self.space(*fields[3:6])
            self.fresh, self.length = self.read()[0], 0

        @staticmethod
        def space(kind, size, bounds):
            if kind == "D":
                return gymnasium.spaces.Discrete(int(size))
            numbers = np.array([float(text) for text in bounds.split(",")], dtype=np.float32)
            return gymnasium.spaces.Box(numbers[: int(size)], numbers[int(size):], dtype=np.float32)

        def read(self):
            observation, reward, done = self.stream.readline().strip().split("#")
            return np.array([float(text) for text in observation.split(",")], dtype=np.float32), float(reward), done == "1"

        def reset(self, seed=None, options=None):
            self.length = 0
            return self.fresh, {}

        def step(self, action):
            self.stream.write((str(int(action)) if isinstance(self.action_space, gymnasium.spaces.Discrete) else ",".join(repr(float(a)) for a in action)) + "\n")
            self.stream.flush()
            observation, reward, done = self.read()
            self.length += 1
            if done:
                self.fresh = self.read()[0]
            return observation, reward, done and self.length < LIMIT, done and self.length >= LIMIT, {}

        def close(self):
            self.server.kill()

    return Served()


def theirs(consac, world, seed):
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.monitor import Monitor

    torch.set_num_threads(1)
    env = Monitor(make_env(consac, world, seed))
    model = PPO("MlpPolicy", env, device="cpu", seed=seed)
    model.learn(STEPS)
    result = evaluate_policy(model, env, n_eval_episodes=EPISODES, deterministic=False)[0]
    env.close()
    return float(result)


def ours(consac, world, seed):
    with tempfile.TemporaryDirectory() as folder:
        command = [consac, "train", world, "--algo", "ppo", "--steps", str(STEPS), "--seed", str(seed), "--name", "run", "--dir", folder, "--json", "--no-tensorboard"]
        subprocess.run(command, check=True, capture_output=True)
        output = subprocess.run([consac, "eval", "run", "--dir", folder, "--stochastic", "--json", "--episodes", str(EPISODES), "--seed", str(1000 + seed)], check=True, capture_output=True, text=True).stdout
    return json.loads(output)["mean_reward"]


def row(consac, world):
    """One table row: both sides on every seed; theirs two at a time, each in a process of its own."""
    command = [sys.executable, __file__, "--one", consac, world]
    with ThreadPoolExecutor(2) as pool:
        their_results = list(pool.map(lambda seed: float(subprocess.run([*command, str(seed)], check=True, capture_output=True, text=True).stdout), SEEDS))
    our_results = [ours(consac, world, seed) for seed in SEEDS]
    show = lambda results: ", ".join(f"{r:.2f}" for r in results) + f" | **{statistics.mean(results):.2f}** +- {statistics.stdev(results) / len(results) ** 0.5:.2f}"
    return f"| {world} | {show(our_results)} | {show(their_results)} |"


if __name__ == "__main__":
    if sys.argv[1] == "--one":
        print(theirs(sys.argv[2], sys.argv[3], int(sys.argv[4])))
        sys.exit()
    import stable_baselines3

    print(f"stable-baselines3 {stable_baselines3.__version__}, {STEPS:,} steps, seeds 1 to 10, both at their defaults; mean return of {EPISODES} episodes with sampled actions, +- its standard error\n")
    print("| world | consac `ppo`, by seed | mean | Stable Baselines3 PPO, by seed | mean |\n|---|---|---|---|---|")
    for name in sys.argv[2:]:
        print(row(sys.argv[1], name), flush=True)
