#!/usr/bin/env python3
"""Stable Baselines3's learning curves: what `learning_proofs` compares CONSAC's with, at the same settings. Measured once
and committed; a row named on the command line is measured anew, the others stay, measured or not. Two seeds at a time, a thread each.

    .venv/bin/python bench/compare/sb3_curves.py [--consac build/release/cli/consac] [ROW-NAME-PART ...]

Writes bench/results/sb3_curves.json, which `learning_proofs` reads (worlds, settings and claims are there alone), and
bench/results/sb3_curves.md. CartPole and Pendulum are Gymnasium's; CONSAC's own worlds are learned over TCP, from `consac serve`.
"""
import argparse
import contextlib
import datetime
import json
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

SEEDS, EPISODES, POINTS = range(1, 6), 100, 10
GYMNASIUM = {"cartpole-v1": "CartPole-v1", "pendulum-v1": "Pendulum-v1"}
RESULTS = pathlib.Path(__file__).parent.parent / "results"

# Settings: Stable Baselines3's Zoo for CartPole and Pendulum, else chosen here; what is not named is Stable Baselines3's default.
# `needs`: what 4 of CONSAC's 5 seeds must reach.
ROWS = [
    {"name": "cartpole by a2c", "world": "cartpole-v1", "algorithm": "a2c", "policy": "MlpPolicy", "steps": 500_000, "envs": 8, "needs": 450, "settings": {}},
    {"name": "cartpole by dqn", "world": "cartpole-v1", "algorithm": "dqn", "policy": "MlpPolicy", "steps": 50_000, "envs": 1, "needs": 475,
     "settings": {"learning_rate": 2.3e-3, "batch_size": 64, "buffer_size": 100_000, "learning_starts": 1000, "target_update_interval": 10, "train_freq": 256,
                  "gradient_steps": 128, "exploration_fraction": 0.16, "exploration_final_eps": 0.04, "net_arch": [256, 256]}},
    {"name": "pendulum by ddpg", "world": "pendulum-v1", "algorithm": "ddpg", "policy": "MlpPolicy", "steps": 20_000, "envs": 1, "needs": -220,
     "settings": {"learning_rate": 1e-3, "gamma": 0.98, "buffer_size": 200_000, "learning_starts": 10_000, "action_noise": "normal", "noise_std": 0.1,
                  "net_arch": [400, 300]}},
    {"name": "pixel catch by dqn", "world": "pixel-catch-v0", "algorithm": "dqn", "policy": "CnnPolicy", "steps": 20_000, "envs": 1, "needs": 9,
     "settings": {"learning_rate": 5e-4, "buffer_size": 20_000, "learning_starts": 1000, "target_update_interval": 500, "exploration_fraction": 0.3}},
]


@contextlib.contextmanager
def environment(row, consac, seed):
    """The row's world as Stable Baselines3 takes it."""
    import gymnasium
    from stable_baselines3.common.env_util import make_vec_env

    if row["world"] in GYMNASIUM:
        yield make_vec_env(GYMNASIUM[row["world"]], row["envs"], seed=seed)
        return
    import consac as client

    with tempfile.TemporaryDirectory() as folder:
        port_file = pathlib.Path(folder) / "port"
        server = subprocess.Popen([consac, "serve", row["world"], "--port", "0", "--port-file", port_file, "--seed", str(seed)], stdout=subprocess.DEVNULL)
        try:
            while not port_file.exists():
                time.sleep(0.01)
            yield make_vec_env(lambda: gymnasium.wrappers.RecordEpisodeStatistics(client.make(f"tcp://127.0.0.1:{port_file.read_text().strip()}")), 1, seed=seed)
        finally:
            server.kill()
            server.wait()


def learn(row, consac, seed):
    """One seed: the mean return of the latest 100 episodes at ten points of the training, and that of the model after it."""
    import numpy
    import stable_baselines3
    import torch
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.noise import NormalActionNoise

    torch.set_num_threads(1)

    class Curve(BaseCallback):
        points = []

        def _on_step(self):
            if self.num_timesteps * POINTS >= row["steps"] * (len(self.points) + 1):
                self.points.append(round(statistics.mean(episode["r"] for episode in self.model.ep_info_buffer), 2))
            return True

    settings = dict(row["settings"])
    if "net_arch" in settings:
        settings["policy_kwargs"] = {"net_arch": settings.pop("net_arch")}
    noise = settings.pop("action_noise", None), settings.pop("noise_std", 0.1)
    with environment(row, consac, seed) as env:
        if noise[0] == "normal":
            size = env.action_space.shape[0]
            settings["action_noise"] = NormalActionNoise(numpy.zeros(size), noise[1] * numpy.ones(size))
        model = getattr(stable_baselines3, row["algorithm"].upper())(row["policy"], env, device="cpu", seed=seed, **settings)
        curve, start = Curve(), time.process_time()
        model.learn(row["steps"], callback=curve)
        seconds = time.process_time() - start
        result = evaluate_policy(model, env, n_eval_episodes=EPISODES, deterministic=True)[0]
    return {"result": round(float(result), 3), "curve": curve.points, "seconds": round(seconds, 1)}


def measured(row, consac):
    """The row with what Stable Baselines3 made of it."""
    import gymnasium
    import stable_baselines3
    import torch

    command = [sys.executable, __file__, "--consac", consac, "--one", row["name"]]
    with ThreadPoolExecutor(2) as pool:
        seeds = list(pool.map(lambda seed: json.loads(subprocess.run([*command, str(seed)], check=True, stdout=subprocess.PIPE, text=True).stdout), SEEDS))
    results = [seed["result"] for seed in seeds]
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.processor())
    return {**row, "results": results, "median": statistics.median(results), "standard_error": round(statistics.stdev(results) / len(results) ** 0.5, 3),
            "curves": [seed["curve"] for seed in seeds], "seconds": [seed["seconds"] for seed in seeds], "date": datetime.date.today().isoformat(),
            "versions": f"stable-baselines3 {stable_baselines3.__version__}, torch {torch.__version__}, gymnasium {gymnasium.__version__}, Python {platform.python_version()}",
            "machine": f"{processor}, {platform.system()} {platform.machine()}, one thread"}


def page(rows):
    """The rows as Markdown."""
    lines = ["# Stable Baselines3's learning curves", "",
             "Written by `bench/compare/sb3_curves.py`; `make test-slow` trains CONSAC at the same settings and compares. Five seeds (1 to 5).",
             f"Result: mean return over {EPISODES} deterministic episodes of the model at the end. Curve: mean return of the latest 100",
             "episodes of training after each tenth of the steps, the median of the seeds."]
    for row in rows:
        settings = ", ".join(f"{name} {value}" for name, value in row["settings"].items()) or "defaults"
        lines += ["", f"## {row['name']}", "",
                  f"{row['algorithm'].upper()}, {row['policy']}, {row['world']}, {row['steps']:,} steps, {row['envs']} worlds; {settings}.", ""]
        if "results" not in row:
            lines.append("Not measured yet.")
            continue
        curve = [statistics.median(points) for points in zip(*row["curves"])]
        lines += ["| results by seed | median | standard error | CPU seconds by seed |", "|---|---|---|---|",
                  f"| {', '.join(f'{r:g}' for r in row['results'])} | {row['median']:g} | {row['standard_error']:g} | {', '.join(f'{s:g}' for s in row['seconds'])} |", "",
                  f"Curve: {', '.join(f'{point:g}' for point in curve)}.", "", f"{row['date']}; {row['versions']}; {row['machine']}."]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--consac", default="build/release/cli/consac", help="the program, for its own worlds")
    parser.add_argument("--one", nargs=2, metavar=("ROW", "SEED"), help=argparse.SUPPRESS)
    parser.add_argument("parts", nargs="*", help="rows whose name has one of these in it; all where none is given")
    options = parser.parse_args()
    if options.one:
        row = next(row for row in ROWS if row["name"] == options.one[0])
        print(json.dumps(learn(row, options.consac, int(options.one[1]))))
        return
    path = RESULTS / "sb3_curves.json"
    for row in ROWS:
        if options.parts and not any(part in row["name"] for part in options.parts):
            continue
        new = measured(row, options.consac)
        print(new["name"], new["results"], flush=True)
        known = {row["name"]: row for row in json.loads(path.read_text())} if path.exists() else {}
        known[new["name"]] = new
        rows = [known.get(row["name"], row) for row in ROWS]
        path.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n")
        (RESULTS / "sb3_curves.md").write_text(page(rows))


if __name__ == "__main__":
    main()
