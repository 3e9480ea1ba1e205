"""Parameters of the world, notes and groups of agents (worlds/weather.gd), in the running engine: over protocol 2, in a training
inside, by hand, and what text protocol 1 does not carry."""
import csv
import os
import re
import subprocess
import sys

import pytest

from engine import DEADLINE_S, ROOT, TEXT1, Trainer
from test_native import NATIVE, built, summary, train  # noqa: F401 (the extension must be there)
from test_traps import TRAIN, finished, start

TWO = {"KINDS": '["keeper", "striker"]', "GROUPS": '["red"]'}


def winds(output, walker="Walker0"):
    return tuple(map(float, re.search(rf"weather: {walker} had (\S+) to (\S+)", output).groups()))


def test_a_trainer_sets_them_and_is_told_of_notes_and_groups(godot):
    engine = start(godot, "weather", "port=0", "sessions=1", "quit=1", **TWO)
    client = subprocess.run([sys.executable, NATIVE / "weather_client.py", str(engine.port())], capture_output=True, text=True,
                            timeout=DEADLINE_S, env={**os.environ, "PYTHONPATH": str(ROOT / "python")})
    assert client.returncode == 0, client.stderr + engine.output()
    assert "client: declared 4.0 0.0 9.0 m/s" in client.stdout
    assert re.search(r"client: groups .*red.*keeper_0.*striker_0", client.stdout), client.stdout
    steps = re.findall(r"step \d sees (.*) paid (.*) group (.*) told (.*)", client.stdout)
    # An episode has three steps, and what was set while it went on is the next one's.
    assert [seen for seen, *_ in steps] == ["[[7.0], [7.0]]"] * 2 + ["[[2.0], [2.0]]"] * 4, client.stdout
    # A quarter for itself, and 1 for the group, which the keeper's call pays both.
    assert {paid for _, paid, *_ in steps} == {"[[1.25], [1.25]]"} and {group for *_, group, _ in steps} == {"[[1.0]]"}, client.stdout
    assert {told for *_, told in steps} == {"{'metres': [2.5, 2.5]}"}, client.stdout
    output = finished(engine)
    assert "weather: Walker0 earned 3.75 in 3 steps" in output and "weather: Walker1 earned 3.75 in 3 steps" in output, output


def test_consac_train_draws_them_and_logs_what_is_noted(godot, tmp_path):
    engine = start(godot, "weather", "port=0", "steps=512", "sessions=1", "quit=1")
    trained = train(godot, [engine.port()], tmp_path, "windy", settings={"environment_parameters": "wind=uniform 5 8", "n_steps": "64"})
    assert summary(trained)["steps"] == 512
    low, high = winds(finished(engine))
    assert 5.0 <= low < 6.0 and 7.0 < high <= 8.0
    rows = list(csv.DictReader((tmp_path / "runs/windy/progress.csv").open()))
    assert {float(row["game/metres"]) for row in rows if row["game/metres"]} == {2.5}, rows


def test_a_training_inside_that_writes_no_log_leaves_nothing_in_the_project(godot):
    finished(start(godot, "weather", *TRAIN, "steps=128", "set=n_steps:64"))
    assert not (godot.project / ".gdignore").exists()
    _, output = start(godot, "weather", *TRAIN, "steps=128", "set=n_steps:64", "log=res://").finish()
    assert "log_folder res:// is the project itself; name a folder below it" in output and not (godot.project / ".gdignore").exists(), output


@pytest.mark.parametrize("meanwhile", ["0", "1"])
def test_a_training_inside_draws_them_and_logs_what_is_noted(godot, tmp_path, meanwhile):
    logs = {"0": (f"{tmp_path}/logs", tmp_path / "logs"), "1": ("res://logs", godot.project / "logs")}[meanwhile]
    engine = start(godot, "weather", *TRAIN, "steps=512", "set=n_steps:64", f"act-while-learning={meanwhile}", f"log={logs[0]}",
                   f"model={tmp_path}/windy.consac", TRAINING='"uniform 6 8"')
    output = finished(engine)
    low, high = winds(output)
    assert 6.0 <= low < 6.5 and 7.5 < high <= 8.0
    assert "weather: metres 2.5" in output and f"what was learned is in {tmp_path}/windy.consac" in output, output
    written = logs[1] / "PPO2_1"
    rows = list(csv.DictReader((written / "progress.csv").open()))
    assert rows[-1]["total_timesteps"] == "512" and {row["game/metres"] for row in rows} == {"2.5"}, rows
    assert b"game/metres" in next(written.glob("events.out.tfevents.*")).read_bytes()
    assert (logs[1] / ".gdignore").is_file() == logs[0].startswith("res://")  # or the editor takes the CSV for translations


def test_by_hand_and_without_laws_they_are_as_they_are_by_default(godot):
    for mode in (["mode=by_hand", "steps=30", "sessions=1", "quit=1"], [*TRAIN, "steps=128", "set=n_steps:64"]):
        output = finished(start(godot, "weather", *mode))
        assert winds(output) == (4.0, 4.0), output
        assert output.count("weather: before it begins 4.0") == 1, output


def test_agents_of_one_behaviour_are_paid_together_and_whoever_comes_too(godot):
    output = finished(start(godot, "weather", *TRAIN, "steps=200", "set=n_steps:64", "room=4", KINDS='["one", "one", "one"]',
                            GROUPS='["red", "red", "blue"]', LATE="true"))
    assert "weather: Walker0 earned 3.75" in output and "weather: Walker1 earned 3.75" in output, output
    assert "weather: Walker2 earned 0.75" in output and "weather: Walker3 earned 3.75" in output, output  # the fourth is red


def test_text_1_carries_none_of_it_and_says_so_in_one_line(godot):
    engine = start(godot, "weather", "port=0", "protocol=text1", "steps=6", "sessions=1", "quit=1")
    with Trainer(engine.port()) as trainer:
        trainer.begin()
        for _ in range(6):
            trainer.step(0)
    output = finished(engine)
    assert winds(output) == (4.0, 4.0), output
    said = re.findall(r"text protocol 1 carries no parameters, notes or groups: .*leave protocol as it is \(auto\)", output)
    assert len(said) == 1, output


def test_a_trainer_of_text_1_before_the_extension_is_warned_of(godot, tmp_path):
    """The protocol is found out by what the trainer says: masks and parameters are lost in this session alone."""
    engine = start(godot, "weather", "port=0", "steps=64", "sessions=1", "quit=1", MASKS="true")
    trained = train(godot, [engine.port()], tmp_path, "text", settings={"n_steps": "64"}, protocol=TEXT1)
    assert summary(trained)["steps"] == 64
    output = finished(engine)
    said = re.findall(r"the trainer speaks text protocol 1, which does not carry what is offered here: (.*); protocol 2 does", output)
    assert said == ["action masks (it may choose what is not legal) and environment parameters (all are at their defaults)"], output
    assert winds(output) == (4.0, 4.0), output


def test_what_cannot_be_is_one_line(godot):
    def refused(mode="by_hand", **replaced):
        output = finished(start(godot, "weather", f"mode={mode}", "steps=20", "sessions=1", "quit=1", **replaced), 1)
        return output.splitlines()[-1]

    assert "parameter 'wind' has the default_value 12.0, which is not within its 0.0 to 9.0" in refused(DEFAULT="12.0")
    assert "Walker0 is in the group 'red', and its goals say what it is paid" in refused(GOALS="true")
    assert "wind" in refused("train", TRAINING='"uniform 6"') and "20" in refused("train", TRAINING='"uniform 6 20"')


@pytest.mark.parametrize("mode", ["by_hand", "train"])
@pytest.mark.parametrize("when", ["NAMED", "EARLY"])
def test_a_parameter_that_is_not_there_ends_the_session(godot, mode, when):
    output = finished(start(godot, "weather", f"mode={mode}", "steps=200", "sessions=1", "quit=1", **{when: '"wnd"'}), 1)
    assert len(re.findall(r"consac: there is no parameter 'wnd'; \S+ has wind: use one of these, or add it", output)) == 1 and "the session failed: 0 steps" in output, output


def test_a_parameter_that_a_script_adds_before_the_session_may_be_asked_for_earlier(godot):
    output = finished(start(godot, "weather", "mode=by_hand", "steps=20", "sessions=1", "quit=1", EARLY='"calm"', ADDED='"calm"'))
    assert "there is no parameter" not in output and winds(output) == (4.0, 4.0), output


def test_each_trainer_is_refused_a_world_whose_parameter_is_not_there(godot, tmp_path):
    engine = start(godot, "weather", "port=0", "steps=64", "sessions=2", "quit=1", NAMED='"wnd"')
    port = engine.port()
    for name in ("first", "second"):
        left, output = train(godot, [port], tmp_path, name, settings={"n_steps": "64"}).finish()
        assert left != 0 and "there is no parameter 'wnd'" in output, output
