"""`consac train tcp://` learns in the real engine, through text protocol 1 and nothing but GDScript."""
import json

import pytest

from engine import TEXT1

# The settings for CartPole that CONSAC's own built-in world suggests, with longer rollouts.
CART_POLE = ["n_steps=128", "gamma=0.98", "noptepochs=10", "learning_rate=lin_1e-3", "ent_coef=0"]


def train(godot, port, folder, *arguments):
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "godot", "--no-table", "--no-progress",
                           "--json", *TEXT1, *arguments, cwd=folder)
    code, output = trainer.finish()
    assert code == 0, output
    return json.loads(output.splitlines()[-1])


def learn(godot, folder, example, steps, settings=()):
    """Mean reward of the last steps and episodes, as the engine saw them, and its steps a second."""
    engine, port = godot.scene(example, f"steps={steps}", "sessions=1", "quit=1")
    train(godot, port, folder, *(part for setting in settings for part in ("--set", setting)))
    said = engine.wait_for(r"training completed: (\d+) steps in .* \(\d+ steps/s\), mean reward of the last \d+ steps "
                           r"(-?[\d.]+), of the last \d+ episodes (-?[\d.]+)")
    assert engine.finish()[0] == 0
    print(f"{example}: {said.group(0)}")
    assert int(said.group(1)) == steps
    return float(said.group(2)), float(said.group(3))


def test_the_road(godot, tmp_path):
    per_step, _ = learn(godot, tmp_path, "road", 20000)
    assert per_step > 0.9


def test_the_cart_pole_on_the_engines_physics(godot, tmp_path):
    _, per_episode = learn(godot, tmp_path, "cart_pole", 60000, CART_POLE)
    assert per_episode > 400


def test_the_rolling_ball_on_the_engines_physics(godot, tmp_path):
    _, per_episode = learn(godot, tmp_path, "rolling_ball", 15000)
    assert per_episode > 2.0  # 1 for the target, and the metres that it came nearer


def test_a_trained_model_is_judged_in_the_same_engine(godot, tmp_path):
    engine, port = godot.scene("road", "steps=20000")
    train(godot, port, tmp_path)
    judge = godot.consac("eval", "godot", f"tcp://127.0.0.1:{port}", "--episodes", "2", "--max-episode-steps", "500",
                         "--json", cwd=tmp_path)
    code, output = judge.finish()
    assert code == 0 and json.loads(output.splitlines()[-1])["mean_reward"] > 0.95 * 500, output


@pytest.mark.parametrize("victim", ["engine", "trainer"])
def test_whoever_is_left_says_so_and_goes_on(godot, tmp_path, victim):
    engine, port = godot.scene("road", "steps=10000000")
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "first", "--log-interval", "1", *TEXT1, cwd=tmp_path)
    trainer.wait_for("total_timesteps")
    if victim == "engine":
        engine.kill()
        code, output = trainer.finish()
        assert code == 3 and "steps" in output.splitlines()[-1], output
        return
    trainer.kill()
    engine.wait_for(r"the trainer left after \d+ of 10000000 steps")
    summary = train(godot, port, tmp_path, "--steps", "1000")
    assert summary["steps"] == 1000
