#!/usr/bin/env python3
"""The ecosystem proofs: other people's libraries learn in our worlds, unchanged, and our trainer learns in theirs.
Run by `make test-slow`; exits 1 when a row misses what it claims. It needs the packages of tools/requirements-slow.txt.

    .venv-slow/bin/python tests/slow/ecosystem_proofs.py bench/results/ecosystem.md                 # every row
    .venv-slow/bin/python tests/slow/ecosystem_proofs.py bench/results/ecosystem.md --only rllib    # one; the others keep theirs

Not here: our trainer in our worlds (learning_proofs.cpp), speed (bench/)."""
import argparse
import contextlib
import dataclasses
import functools
import importlib.metadata
import json
import math
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONSAC = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/release")) / "cli/consac"
EPISODES = 100  # of each evaluation; deterministic actions
KEPT = ROOT / "bench/results/ecosystem_seeds"  # answers of single seeds until their row's line is written; to be committed where a row takes hours
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT / "python"), "PYTHONUNBUFFERED": "1", "RAY_USAGE_STATS_ENABLED": "0"}


def say(text: str) -> None:
    print(f"  {text}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def engine(*command):
    """Runs an engine that takes --port and --port-file; gives its URL."""
    with tempfile.TemporaryDirectory() as folder:
        port_file, log = pathlib.Path(folder) / "port", pathlib.Path(folder) / "log"
        with log.open("wb") as sink:
            process = subprocess.Popen([*map(str, command), "--port", "0", "--port-file", str(port_file)], env=ENVIRONMENT, cwd=folder, stdout=subprocess.DEVNULL, stderr=sink)
        try:
            while not port_file.exists():
                if process.poll() is not None:
                    raise RuntimeError(f"{' '.join(map(str, command))} ended: {log.read_text(errors='replace').strip()}")
                time.sleep(0.05)
            yield f"tcp://127.0.0.1:{port_file.read_text().strip()}"
        finally:
            process.terminate()
            process.wait()


def our_cartpole():
    return engine(CONSAC, "serve", "cartpole-v1", "--envs", 8)


def mean_return(envs, act, seed: int) -> float:
    """Mean return of EPISODES episodes, each environment's first ones: were it the first to end, short ones would count more often."""
    quota = [EPISODES // envs.num_envs + (i < EPISODES % envs.num_envs) for i in range(envs.num_envs)]
    running, returns = [0.0] * envs.num_envs, [[] for _ in quota]
    observations, _ = envs.reset(seed=seed)
    while any(len(done) < wanted for done, wanted in zip(returns, quota)):
        observations, rewards, terminated, truncated, _ = envs.step(act(observations))
        for i in range(envs.num_envs):
            running[i] += float(rewards[i])
            if terminated[i] or truncated[i]:
                if len(returns[i]) < quota[i]:
                    returns[i].append(running[i])
                running[i] = 0.0
    return statistics.mean(sum(returns, []))


# ---- what learns, each in a process of its own

def stable_baselines3(seed: int) -> dict:
    """SB3's PPO, with RL Baselines3 Zoo's settings for CartPole-v1."""
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.vec_env import VecMonitor

    from consac.sb3 import ConsacVecEnv

    class Progress(BaseCallback):
        def _on_step(self):
            return True

        def _on_rollout_end(self):
            if self.num_timesteps % 20_480 == 0:
                recent = [episode["r"] for episode in self.model.ep_info_buffer]
                say(f"{self.num_timesteps} steps, mean return {statistics.mean(recent):.0f}")

    torch.set_num_threads(1)
    with our_cartpole() as url:
        env = VecMonitor(ConsacVecEnv(url))
        model = PPO("MlpPolicy", env, n_steps=32, batch_size=256, gae_lambda=0.8, gamma=0.98, n_epochs=20, ent_coef=0.0,
                    learning_rate=lambda left: left * 1e-3, clip_range=lambda left: left * 0.2, seed=seed, device="cpu")
        model.learn(100_000, callback=Progress())
        env.seed(1000 + seed)
        result, _ = evaluate_policy(model, env, n_eval_episodes=EPISODES, deterministic=True)
        env.close()
    return {"return": float(result)}


def single_file(seed: int) -> dict:
    """single_file_ppo.py on consac.make_vec."""
    import torch
    from single_file_ppo import Settings, learn

    import consac

    torch.set_num_threads(1)
    with our_cartpole() as url:
        envs = consac.make_vec(url, autoreset_mode="SameStep")
        agent = learn(envs, Settings(seed=seed), lambda steps, recent: say(f"{steps} steps, mean return {recent:.0f}"))
        with torch.no_grad():
            result = mean_return(envs, lambda seen: agent.actor(torch.as_tensor(seen)).argmax(-1).numpy(), 1000 + seed)
        envs.close()
    return {"return": result}


def rllib_learn(environment: str, options: dict, mode: str, seed: int):
    """What RLlib's PPO on its new API stack makes of 100,000 steps of 8 environments: a function from observations to actions."""
    import torch
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

    config = (
        PPOConfig()
        .environment(environment, env_config=options)
        .env_runners(num_env_runners=0, num_envs_per_env_runner=8, gym_env_vectorize_mode=mode)
        .learners(num_learners=0)
        .training(train_batch_size_per_learner=2000, minibatch_size=250, num_epochs=10, lr=5e-4, gamma=0.98, lambda_=0.95, vf_loss_coeff=0.5,
                  vf_clip_param=1e6, grad_clip=0.5, use_kl_loss=False, clip_param=0.2)
        .rl_module(model_config=DefaultModelConfig(fcnet_hiddens=[64, 64], fcnet_activation="tanh", vf_share_layers=False))
        .debugging(seed=seed, log_level="ERROR")
    )
    algorithm = config.build_algo()
    steps = 0
    while steps < 100_000:
        result = algorithm.train()["env_runners"]
        steps = int(result["num_env_steps_sampled_lifetime"])
        if steps % 20_000 < 2000:
            say(f"{environment}: {steps} steps, mean return {result['episode_return_mean']:.0f}")
    module = algorithm.get_module()

    def act(seen):
        with torch.no_grad():
            return module.forward_inference({"obs": torch.as_tensor(seen)})["action_dist_inputs"].argmax(-1).numpy()

    return act, algorithm.stop


def rllib(seed: int) -> dict:
    """RLlib on our engine through our environment creator; beside it the very same on Gymnasium's own CartPole."""
    import gymnasium
    import ray
    import torch

    import consac
    import consac.rllib

    torch.set_num_threads(1)
    ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False, logging_level="ERROR", object_store_memory=100_000_000)
    consac.rllib.register("consac")
    with our_cartpole() as url:
        act, stop = rllib_learn("consac", {"url": url}, "vector_entry_point", seed)
        stop()
    with our_cartpole() as url:
        envs = consac.make_vec(url, autoreset_mode="SameStep")
        result = mean_return(envs, act, 1000 + seed)
        envs.close()
    seconds = time.monotonic()
    act, stop = rllib_learn("CartPole-v1", {}, "sync", seed)
    stop()
    envs = gymnasium.make_vec("CartPole-v1", 8, vectorization_mode="sync", vector_kwargs={"autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP})
    native = mean_return(envs, act, 1000 + seed)
    ray.shutdown()
    return {"return": result, "beside": native, "seconds_beside": time.monotonic() - seconds}


def consac_train(world: str, envs: int, steps: int, settings: dict, seed: int, algorithm: str = "ppo") -> dict:
    """`consac train` on somebody else's world that consac.serve offers, judged by `consac eval` on the same."""
    with tempfile.TemporaryDirectory() as folder:
        with engine(sys.executable, "-m", "consac.serve", world, "--envs", envs, "--no-render", "--seed", seed) as url:
            say(f"{world} at {url}")
            chosen = [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]
            # In lock step, as the agents were trained that it is compared with.
            subprocess.run([CONSAC, "train", url, "--lockstep", "--algo", algorithm, "--steps", str(steps), "--seed", str(seed), "--name", "run", "--dir", folder, "--no-table", "--no-tensorboard", *chosen],
                           check=True, stdout=sys.stderr)
            verdict = subprocess.run([CONSAC, "eval", "run", url, "--dir", folder, "--episodes", str(EPISODES), "--seed", str(1000 + seed), "--json"],
                                     check=True, stdout=subprocess.PIPE, text=True).stdout
    return {"return": json.loads(verdict)["mean_reward"]}


# ---- the table

@dataclasses.dataclass
class Proof:
    """One claim: this, learned so, reaches that."""

    name: str
    what: str  # for the table: who learns where, through what
    budget: str  # steps x environments
    run: Callable[[int], dict]  # seed -> {"return": ...}; "beside": the same without us
    packages: list[str]  # whose versions the row depends on
    median_at_least: float
    every_seed_at_least: float
    published: str  # what it is compared with, where nothing is measured beside
    seeds: int = 3
    row: dict | None = None  # of sb3_curves.json: with one, each seed's answer is kept in KEPT until the line is written


# Settings of the last two: RL Baselines3 Zoo's for PPO (hyperparams/ppo.yml); what is not named is Stable Baselines3's default, as in ours.
LUNAR_LANDER = {"n_steps": 1024, "batch_size": 64, "gae_lambda": 0.98, "gamma": 0.999, "n_epochs": 4, "ent_coef": 0.01}
SWIMMER = {"gamma": 0.9999, "norm_obs": "true"}


# What Stable Baselines3 learned, or will, in Gymnasium's worlds: bench/compare/sb3_curves.py.
SERVED = [row for row in json.loads((ROOT / "bench/results/sb3_curves.json").read_text()) if "served" in row]


def beside_stable_baselines3() -> list[Proof]:
    """Our trainer in those worlds at the same settings; where Stable Baselines3's side is not measured there is nothing to reach yet."""
    return [Proof(row["name"], f"`consac train --algo {row['algorithm']}` on {row['world']} through `consac.serve`, settings of [sb3_curves.md](sb3_curves.md)",
                  f"{row['steps']:,} x {row['envs']}",
                  functools.partial(consac_train, row["world"], row["envs"], row["steps"], {"policy": row["policy"]} | row["settings"], algorithm=row["algorithm"]),
                  ["gymnasium", *row["served"]], row["median"] - row["standard_error"], -math.inf,
                  f"Stable Baselines3, the same settings, {len(row['results'])} seeds: median {row['median']:g} +- {row['standard_error']:g}",
                  seeds=len(row["results"]), row={name: row[name] for name in ("world", "envs", "steps", "algorithm", "policy", "settings")})
            for row in SERVED if "median" in row]


PROOFS = [
    Proof("sb3", "Stable Baselines3's PPO on `consac serve cartpole-v1` through `consac.sb3.ConsacVecEnv`", "100,000 x 8", stable_baselines3,
          ["stable-baselines3", "torch", "gymnasium"], 475, 475, "solved: 475"),
    Proof("single-file", "a CleanRL-like PPO (`tests/slow/single_file_ppo.py`) on `consac serve cartpole-v1` through `consac.make_vec`", "100,000 x 8", single_file,
          ["torch", "gymnasium"], 475, 475, "solved: 475"),
    Proof("rllib", "RLlib's PPO, new API stack, on `consac serve cartpole-v1` through `consac.rllib.env_creator`", "100,000 x 8", rllib,
          ["ray", "torch", "gymnasium"], 450, 450, ""),
    Proof("lunar-lander", "`consac train` on Gymnasium's LunarLander-v3 through `consac.serve`", "1,000,000 x 16",
          functools.partial(consac_train, "LunarLander-v3", 16, 1_000_000, LUNAR_LANDER), ["gymnasium", "box2d"], 200, 200, "RL Zoo (v2): 242.1 +- 31.8"),
    Proof("mujoco", "`consac train` on Gymnasium's Swimmer-v5 (MuJoCo) through `consac.serve`", "1,000,000 x 1",
          functools.partial(consac_train, "Swimmer-v5", 1, 1_000_000, SWIMMER), ["gymnasium", "mujoco"], 282, -math.inf, "RL Zoo (v3), one agent: 282 +- 10"),
    *beside_stable_baselines3(),
]

HEAD = f"""# Ecosystem proofs

Written by `make test-slow`: other people's libraries learn in our worlds unchanged, and our trainer learns in theirs. Seeds
from 1 upwards. Result: mean return over {EPISODES} deterministic evaluation episodes. "Compared with" is measured in the same run
where it says so, else published. Settings: `tests/slow/ecosystem_proofs.py`. A row that was run alone replaced its own line only.

Swimmer ends near 300 or near 150, by the seed. Its runs are in lock step, as the published agent's was; with the next step under way
while the model learns, the default with engines, seeds 1 and 2 ended at 150.0 and 143.1 (commit b205c9e). On point-v0, reach3-v0 and
cartpole-v1, ten seeds each of 60,000 steps, the two ways do not differ: -18.03 +- 2.2 beside -18.02 +- 2.3, -69.3 +- 4.5 beside -69.4 +- 4.5,
263 +- 31 beside 243 +- 37 (mean and deviation of the last 100 episodes' mean).

| proof | who learns where | steps x worlds | seeds | median | needs median / every seed | compared with | s per run | holds | measured with |
|---|---|---|---|---|---|---|---|---|---|
"""


def run_one(proof: Proof, seed: int) -> dict:
    """One seed in a process of its own, whose messages are shown as they come; what it reached, or NaN."""
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        answer = pathlib.Path(folder) / "answer"
        code = subprocess.run([sys.executable, __file__, "--child", proof.name, "--seed", str(seed), str(answer)], env=ENVIRONMENT, stdout=sys.stderr).returncode
        result = json.loads(answer.read_text()) if code == 0 else {"return": math.nan}
    return {"seconds": time.monotonic() - started - result.pop("seconds_beside", 0.0), "with": measured_with(proof)} | result


def kept_file(proof: Proof, seed: int) -> pathlib.Path:
    return KEPT / f"{proof.name} {seed}.json"


def kept_or_run(proof: Proof, seed: int) -> dict:
    """As run_one. A proof with a row keeps the answer, and takes a kept one of the same settings, whatever build measured it: the line names each."""
    path = kept_file(proof, seed)
    known = json.loads(path.read_text()) if proof.row and path.exists() else {}
    if known.get("row") == proof.row and "return" in known:
        return known
    run = run_one(proof, seed)
    if proof.row and not math.isnan(run["return"]):
        KEPT.mkdir(exist_ok=True)
        path.write_text(json.dumps({"row": proof.row} | run) + "\n")
    return run


def machine() -> str:
    with contextlib.suppress(OSError, IndexError):
        return pathlib.Path("/proc/cpuinfo").read_text().split("model name\t: ")[1].split("\n")[0]
    return platform.machine()


def measured_with(proof: Proof) -> str:
    commit = subprocess.run([CONSAC, "--version"], capture_output=True, text=True).stdout.split("commit ")[-1].split("\n")[0]  # the program's, not the folder's
    versions = [f"consac {commit}", f"Python {platform.python_version()}"] + [f"{name} {importlib.metadata.version(name)}" for name in proof.packages]
    return f"{', '.join(versions)}; {machine()}"


def prove(proof: Proof) -> tuple[str, bool]:
    """The row's line, and whether the claim holds."""
    runs = []
    for seed in range(1, proof.seeds + 1):
        print(f"{proof.name}, seed {seed} of {proof.seeds}: {proof.what}", flush=True)
        runs.append(kept_or_run(proof, seed))
        print(f"{proof.name}, seed {seed} of {proof.seeds}: {runs[-1]['return']:.1f} in {runs[-1]['seconds']:.0f} s", flush=True)
    returns = [run["return"] for run in runs]
    holds = not any(map(math.isnan, returns)) and statistics.median(returns) >= proof.median_at_least and min(returns) >= proof.every_seed_at_least
    beside = [f"{run['beside']:.4g}" for run in runs if "beside" in run]
    compared = f"the same on Gymnasium's own, measured: {', '.join(beside)}" if beside else proof.published
    cells = [proof.name, proof.what, proof.budget, ", ".join(f"{value:.4g}" for value in returns), f"{statistics.median(returns):.4g}",
             f"{proof.median_at_least:g} / {proof.every_seed_at_least:g}".replace("-inf", "any"), compared, f"{statistics.mean(run['seconds'] for run in runs):.0f}",
             "yes" if holds else "**no**", " and ".join(dict.fromkeys(run["with"] for run in runs))]
    return f"| {' | '.join(cells)} |\n", holds


def write(path: pathlib.Path, lines: dict[str, str]) -> None:
    missing = [f"`{name}`" for name in dict.fromkeys([proof.name for proof in PROOFS] + [row["name"] for row in SERVED]) if name not in lines]
    path.write_text(HEAD + "".join(lines[proof.name] for proof in PROOFS if proof.name in lines) + (f"\nNot measured yet: {', '.join(missing)}.\n" if missing else ""))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="the table")
    parser.add_argument("--only", choices=[proof.name for proof in PROOFS], help="run one row; the table keeps the others' lines")
    parser.add_argument("--child", choices=[proof.name for proof in PROOFS], help=argparse.SUPPRESS)
    parser.add_argument("--seed", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        (proof,) = [proof for proof in PROOFS if proof.name == options.child]
        options.out.write_text(json.dumps(proof.run(options.seed)))
        return 0
    lines, all_hold = {}, True
    if options.only and options.out.exists():
        old = options.out.read_text().splitlines(keepends=True)
        lines = {proof.name: line for proof in PROOFS for line in old if line.startswith(f"| {proof.name} |")}
    for proof in PROOFS:
        if options.only in (None, proof.name):
            lines[proof.name], holds = prove(proof)
            all_hold &= holds
            write(options.out, lines)
            files = [kept_file(proof, seed) for seed in range(1, proof.seeds + 1)]
            if all(file.exists() for file in files):  # a seed that failed has none, and is run again
                for file in files:
                    file.unlink()
    print(options.out.read_text())
    return 0 if all_hold else 1


if __name__ == "__main__":
    sys.exit(main())
