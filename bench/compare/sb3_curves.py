#!/usr/bin/env python3
"""Stable Baselines3's learning curves: what CONSAC's are compared with, at the same settings. Measured once and committed.

    .venv/bin/python bench/compare/sb3_curves.py [--consac build/release/cli/consac] [--jobs 2] [ROW-NAME-PART ...]

Each seed is a process of one thread. Its answer is a file in bench/results/sb3_seeds, to be committed where a row takes hours: a
measurement which was stopped goes on where it was, on another machine too (a seed whose row has changed is measured anew). A row
whose seeds are all there goes into bench/results/sb3_curves.json and sb3_curves.md, and the seeds' files go. Worlds, settings and
claims are here alone: `learning_proofs` and, for worlds of Gymnasium's (`served`), tests/slow/ecosystem_proofs.py read them from the
JSON. Those need .venv-slow in place of .venv.
"""
import argparse
import contextlib
import datetime
import importlib.metadata
import json
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

EPISODES, POINTS = 100, 10
GYMNASIUM = {"cartpole-v1": "CartPole-v1", "pendulum-v1": "Pendulum-v1"}  # built into CONSAC, and the same in Gymnasium
BIT_FLIPPING = {"bit-flipping-v0": False, "bit-flipping-continuous-v0": True}  # Stable Baselines3's own; whether actions are continuous
ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "bench/results"
MEASURED = RESULTS / "sb3_seeds"
HER = {"replay_buffer_class": "HerReplayBuffer"}
ZOO_OFF_POLICY = {"learning_rate": 1e-3, "gamma": 0.98, "buffer_size": 200_000, "learning_starts": 10_000, "action_noise": "normal", "noise_std": 0.1,
                  "net_arch": [400, 300]}

# Settings: Stable Baselines3's Zoo for CartPole and Pendulum, else chosen here; what is not named is Stable Baselines3's default.
# `needs`: what 4 of CONSAC's 5 seeds must reach, where there is such a claim besides the median's. `seeds`: how many, where not five.
# `served`: a world of Gymnasium's that CONSAC learns from `python -m consac.serve`, and the packages that it is in.
ROWS = [
    {"name": "cartpole by a2c", "world": "cartpole-v1", "algorithm": "a2c", "policy": "MlpPolicy", "steps": 500_000, "envs": 8, "needs": 450, "settings": {}},
    {"name": "cartpole by dqn", "world": "cartpole-v1", "algorithm": "dqn", "policy": "MlpPolicy", "steps": 50_000, "envs": 1, "needs": 475,
     "settings": {"learning_rate": 2.3e-3, "batch_size": 64, "buffer_size": 100_000, "learning_starts": 1000, "target_update_interval": 10, "train_freq": 256,
                  "gradient_steps": 128, "exploration_fraction": 0.16, "exploration_final_eps": 0.04, "net_arch": [256, 256]}},
    {"name": "pendulum by ddpg", "world": "pendulum-v1", "algorithm": "ddpg", "policy": "MlpPolicy", "steps": 20_000, "envs": 1, "needs": -220,
     "settings": ZOO_OFF_POLICY},
    {"name": "pendulum by td3", "world": "pendulum-v1", "algorithm": "td3", "policy": "MlpPolicy", "steps": 20_000, "envs": 1, "needs": -220,
     "settings": ZOO_OFF_POLICY},
    {"name": "pendulum by sac", "world": "pendulum-v1", "algorithm": "sac", "policy": "MlpPolicy", "steps": 20_000, "envs": 1, "needs": -220,
     "settings": {"learning_rate": 1e-3}},
    # At best -4 (a bit a step) and 0 (all at once), and -10 where it never gets there: whoever reaches this gets there 9 times of 10.
    {"name": "bit flipping by dqn", "world": "bit-flipping-v0", "algorithm": "dqn", "policy": "MultiInputPolicy", "steps": 30_000, "envs": 1, "needs": -4.6,
     "settings": {**HER, "learning_rate": 1e-3, "batch_size": 128, "train_freq": 1, "gamma": 0.95, "target_update_interval": 200, "learning_starts": 200}},
    {"name": "bit flipping by sac", "world": "bit-flipping-continuous-v0", "algorithm": "sac", "policy": "MultiInputPolicy", "steps": 30_000, "envs": 1,
     "needs": -1, "settings": {**HER, "learning_rate": 1e-3, "gamma": 0.95, "net_arch": [64, 64]}},
    {"name": "pixel catch by dqn", "world": "pixel-catch-v0", "algorithm": "dqn", "policy": "CnnPolicy", "steps": 20_000, "envs": 1, "needs": 9,
     "settings": {"learning_rate": 5e-4, "buffer_size": 20_000, "learning_starts": 1000, "target_update_interval": 500, "exploration_fraction": 0.3}},
    # Settings: the Zoo's. What it publishes of the last two is for five and ten times the steps.
    {"name": "fetch reach by sac", "world": "gymnasium_robotics:FetchReach-v4", "served": ["gymnasium-robotics", "mujoco"], "algorithm": "sac", "policy": "MultiInputPolicy",
     "steps": 20_000, "envs": 1,  # the Zoo normalises besides
     "settings": {**HER, "learning_rate": 1e-3, "gamma": 0.95, "learning_starts": 1000, "net_arch": [64, 64]}},
    {"name": "lunar lander by sac", "world": "LunarLanderContinuous-v3", "served": ["box2d"], "algorithm": "sac", "policy": "MlpPolicy",
     "steps": 100_000, "envs": 1, "settings": {"learning_rate": "lin_7.3e-4", "tau": 0.01, "learning_starts": 10_000, "net_arch": [400, 300]}},
    {"name": "half cheetah by sac", "world": "HalfCheetah-v5", "served": ["mujoco"], "algorithm": "sac", "policy": "MlpPolicy", "steps": 100_000, "envs": 1,
     "seeds": 10,  # five of each left it open; that it would be ten was committed before the other five were begun
     "settings": {"learning_starts": 10_000}},
]


@contextlib.contextmanager
def environment(row, consac, seed):
    """The row's world as Stable Baselines3 takes it."""
    import gymnasium
    from stable_baselines3.common.env_util import make_vec_env
    from stable_baselines3.common.envs import BitFlippingEnv

    if row["world"] in BIT_FLIPPING:
        yield make_vec_env(BitFlippingEnv, row["envs"], seed=seed, env_kwargs={"n_bits": 10, "continuous": BIT_FLIPPING[row["world"]]})
        return
    if row["world"] in GYMNASIUM or row.get("served"):
        yield make_vec_env(GYMNASIUM.get(row["world"], row["world"]), row["envs"], seed=seed)
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


def machine(row):
    """What a seed of the row is measured with."""
    packages = ["stable-baselines3", "torch", "gymnasium", *row.get("served", [])]
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.processor())
    return {"date": datetime.date.today().isoformat(),
            "versions": ", ".join([f"{name} {importlib.metadata.version(name)}" for name in packages] + [f"Python {platform.python_version()}"]),
            "machine": f"{processor}, {platform.system()} {platform.machine()}, one thread"}


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
                print(f"{row['name']} seed {seed}: {self.points[-1]} after {self.num_timesteps:,} steps and {time.process_time() - start:.0f} s", file=sys.stderr)
            return True

    settings = dict(row["settings"])
    if "net_arch" in settings:
        settings["policy_kwargs"] = {"net_arch": settings.pop("net_arch")}
    if str(settings.get("learning_rate")).startswith("lin_"):
        rate = float(settings["learning_rate"].removeprefix("lin_"))
        settings["learning_rate"] = lambda left: left * rate
    if settings.get("replay_buffer_class") == "HerReplayBuffer":
        settings["replay_buffer_class"] = stable_baselines3.HerReplayBuffer
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
    return {"result": round(float(result), 3), "curve": curve.points, "seconds": round(seconds, 1), **machine(row)}


def what_matters(row):
    """What a seed's result depends on."""
    return {name: value for name, value in row.items() if name != "seeds"}


def seed_file(row, seed):
    return MEASURED / f"{row['name']} {seed}.json"


def measured(row, consac, jobs):
    """The row with what Stable Baselines3 made of it."""
    def one(seed):
        path = seed_file(row, seed)
        known = json.loads(path.read_text()) if path.exists() else {}
        if what_matters(known.get("row", {})) == what_matters(row):
            return known
        command = [sys.executable, __file__, "--consac", consac, "--one", row["name"], str(seed)]
        answer = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
        print(f"{row['name']} seed {seed}: {answer['result']} in {answer['seconds']} s", flush=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"row": row, **answer}) + "\n")
        return answer

    with ThreadPoolExecutor(jobs) as pool:
        seeds = list(pool.map(one, range(1, row.get("seeds", 5) + 1)))
    results = [seed["result"] for seed in seeds]
    return {**row, "results": results, "median": statistics.median(results), "standard_error": round(statistics.stdev(results) / len(results) ** 0.5, 3),
            "curves": [seed["curve"] for seed in seeds], "seconds": [seed["seconds"] for seed in seeds],
            **{name: " and ".join(sorted({seed[name] for seed in seeds})) for name in ("date", "versions", "machine")}}


def page(rows):
    """The rows as Markdown."""
    lines = ["# Stable Baselines3's learning curves", "",
             "Written by `bench/compare/sb3_curves.py`; `make test-slow` trains CONSAC at the same settings and compares. Seeds from 1 upwards.",
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


def write(new):
    """Both pages: rows by name that are new, else as they are known (be it of fewer seeds), else without results."""
    path = RESULTS / "sb3_curves.json"
    known = {row["name"]: row for row in json.loads(path.read_text())} | new
    rows = [known[row["name"]] if known.get(row["name"], {}).items() >= what_matters(row).items() else row for row in ROWS]
    path.write_text("[\n" + ",\n".join(json.dumps(row) for row in rows) + "\n]\n")
    (RESULTS / "sb3_curves.md").write_text(page(rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--consac", default="build/release/cli/consac", help="the program, for its own worlds")
    parser.add_argument("--jobs", type=int, default=2, help="seeds at a time")
    parser.add_argument("--one", nargs=2, metavar=("ROW", "SEED"), help=argparse.SUPPRESS)
    parser.add_argument("parts", nargs="*", help="rows whose name has one of these in it; all where none is given")
    options = parser.parse_args()
    if options.one:
        row = next(row for row in ROWS if row["name"] == options.one[0])
        print(json.dumps(learn(row, options.consac, int(options.one[1]))))
        return
    write({})
    for row in ROWS:
        if options.parts and not any(part in row["name"] for part in options.parts):
            continue
        new = measured(row, options.consac, options.jobs)
        print(new["name"], new["results"], flush=True)
        write({new["name"]: new})
        for seed in range(1, len(new["results"]) + 1):
            seed_file(row, seed).unlink()


if __name__ == "__main__":
    main()
