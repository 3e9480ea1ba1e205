"""What a developer wants of the nodes beside that they do no harm: opponents, masks, checkpoints, going on from a model,
curves, sensors that are drawn, models as resources. Each in the running engine."""
import csv
import re

import pytest

from test_native import ENDED, built, play  # noqa: F401 (the extension must be there)
from test_traps import DRAWS, TRAIN, finished, start


def test_opponents_masks_checkpoints_curves_and_going_on(godot, tmp_path):
    model, curve = tmp_path / "first.consac", tmp_path / "curve.csv"
    settings = "set=n_steps:64,learning_rate:3e-3,ent_coef:0"
    output = finished(start(godot, "opponents", *TRAIN, "steps=4096", settings, f"model={model}", f"curve={curve}",
                            "report=0.05", "checkpoints=2048"))
    rule, _, illegal, done = re.search(r"rule (\d+) model (\d+) illegal (\d+), in the end (.*)", output).groups()
    assert int(rule) >= 4096 and illegal == "0" and done == "[2, 1]", output
    ended = re.search(ENDED, output)
    assert int(ended.group(1)) == 4096 and float(ended.group(3)) > 0.6  # the rival's steps are none of the training
    assert f"what was learned so far is in {tmp_path}/first.2048.consac" in output
    rows = list(csv.DictReader(curve.open()))
    assert {"steps_per_s", "mean_episode_reward", "updates", "twos"} <= {row["name"] for row in rows}, rows

    # The model acts against a learner that goes on from a checkpoint: what that knew it knows from the beginning.
    output = finished(start(godot, "opponents", *TRAIN, "steps=64", "set=n_steps:64,learning_rate:1e-9", f"start-from={model}",
                            MODEL=f'"{model}"'))
    _, by_model, illegal, done = re.search(r"rule (\d+) model (\d+) illegal (\d+), in the end (.*)", output).groups()
    assert int(by_model) >= 64 and illegal == "0" and done == "[2, 1, 2]", output
    assert float(re.search(ENDED, output).group(3)) > 0.9, output


def test_an_opponent_that_leaves_leaves_the_others_of_its_model_alone(godot, tmp_path):
    """Both with masks, and by a copy of the model that is no file of its own."""
    model = tmp_path / "model.consac"
    quick = (*TRAIN, "steps=64", "set=n_steps:64")
    finished(start(godot, "opponents", *quick, f"model={model}"))
    output = finished(start(godot, "opponents", *quick, MODEL=f'"{model}"', LEAVES="true"))
    assert int(re.search(r"model (\d+)", output).group(1)) == 64 + 4, output  # it acts once more before it is gone


def test_the_lander_learns_in_2d_physics(godot):
    def earned(steps):
        settings = "set=n_steps:256,gamma:0.995,noptepochs:8,learning_rate:lin_1e-3,ent_coef:0.005"
        return float(re.search(ENDED, finished(play(godot, "lander", *TRAIN, f"steps={steps}", settings))).group(5))

    assert earned(8192) < 0.0 and earned(200000) > 3.5  # -2.4 and 4.2 where it was last seen


def test_a_model_that_does_not_fit_is_one_line(godot, tmp_path):
    (tmp_path / "wrong.consac").write_bytes(b"x" * 200)
    output = finished(start(godot, "opponents", *TRAIN, f"start-from={tmp_path}/wrong.consac"), 1)
    assert "behaviour 'default' cannot begin with this model" in output.splitlines()[-1], output
    output = finished(start(godot, "opponents", *TRAIN, "start-from=user://none.consac"), 1)
    assert "there is no file 'user://none.consac'" in output.splitlines()[-1], output


def test_sensors_are_drawn_and_a_grid_sees(godot, display, tmp_path):
    output = finished(start(godot, "sensing", "mode=by_hand", "steps=20", "sessions=1", flags=DRAWS, PICTURE=f'"{tmp_path}/drawn.png"'))
    assert "sensing: grid 2D [1, 5], grid 3D [1]" in output, output  # the cells with a wall, of 3 x 3, row by row from far left
    red, blue = map(int, re.search(r"sensing: (\d+) pixels of rays that hit, (\d+) of others", output).groups())
    assert red > 50 and blue > 50, output


@pytest.mark.parametrize("visible", ["true", "false"])
def test_what_is_not_to_be_drawn_is_not(godot, display, visible, tmp_path):
    output = finished(start(godot, "sensing", "mode=by_hand", "steps=20", "sessions=1", flags=DRAWS, DRAWN=visible,
                            PICTURE=f'"{tmp_path}/drawn.png"'))
    assert (re.search(r"sensing: (\d+) pixels", output).group(1) != "0") == (visible == "true"), output
