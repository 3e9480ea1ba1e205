"""The real TensorBoard reads what a run writes, under Stable Baselines' tags."""
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONSAC = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev")) / "cli/consac"

SB2_TAGS = {
    "episode_reward", "loss/entropy_loss", "loss/policy_gradient_loss", "loss/value_function_loss", "loss/approximate_kullback-leibler",
    "loss/clip_factor", "loss/loss", "input_info/discounted_rewards", "input_info/learning_rate", "input_info/advantage", "input_info/clip_range",
    "input_info/clip_range_vf", "input_info/old_neglog_action_probability", "input_info/old_value_pred",
}
SB3_TAGS = {
    "rollout/ep_rew_mean", "rollout/ep_len_mean", "time/fps", "train/approx_kl", "train/clip_fraction", "train/clip_range", "train/entropy_loss",
    "train/explained_variance", "train/learning_rate", "train/loss", "train/policy_gradient_loss", "train/value_loss",
}


@pytest.mark.parametrize("algorithm, folder, tags", [("ppo2", "PPO2_1", SB2_TAGS), ("ppo", "PPO_1", SB3_TAGS)])
def test_tensorboard_reads_our_events(tmp_path, algorithm, folder, tags):
    from tensorboard.backend.event_processing import event_accumulator

    subprocess.run([CONSAC, "train", "cartpole-v1", "--algo", algorithm, "--steps", "8192", "--envs", "4", "--set", "n_steps=256",
                    "--name", "run", "--no-progress", "--no-table"], cwd=tmp_path, check=True)
    events = event_accumulator.EventAccumulator(str(tmp_path / "runs/run/tensorboard" / folder))
    events.Reload()
    assert tags <= set(events.Tags()["scalars"])
    tag = "loss/loss" if algorithm == "ppo2" else "train/loss"
    steps = [event.step for event in events.Scalars(tag)]
    assert steps == sorted(steps) and steps[-1] == 8192 and len(steps) == 8


def test_monitor_and_progress_are_what_stable_baselines_reads(tmp_path):
    import csv
    import json

    subprocess.run([CONSAC, "train", "cartpole-v1", "--steps", "4096", "--envs", "4", "--name", "run", "--no-progress", "--no-table"], cwd=tmp_path, check=True)
    lines = (tmp_path / "runs/run/monitor.csv").read_text().splitlines()
    header = json.loads(lines[0][1:])
    assert lines[0].startswith("#") and header["env_id"] == "cartpole-v1" and header["t_start"] > 0
    assert lines[1] == "r,l,t"
    rows = [line.split(",") for line in lines[2:]]
    assert rows and all(float(r) == float(length) for r, length, _ in rows)
    with open(tmp_path / "runs/run/progress.csv") as file:
        progress = list(csv.DictReader(file))
    keys = {"approxkl", "clipfrac", "ep_len_mean", "ep_reward_mean", "explained_variance", "fps", "n_updates", "policy_entropy", "policy_loss",
            "serial_timesteps", "time_elapsed", "total_timesteps", "value_loss"}
    assert keys <= set(progress[-1]) and progress[-1]["total_timesteps"] == "4096" and progress[-1]["serial_timesteps"] == "1024"
