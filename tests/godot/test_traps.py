"""What a Godot developer stumbles over, each in the running engine: bodies, timers, pictures, two syncs, agents that come
and go, Ctrl-C. Every world here is one script that builds itself (worlds/)."""
import pathlib
import re
import shutil
import signal
import subprocess

import pytest

from engine import DEADLINE_S, PROTOCOL_2, ROOT, TEXT1
from test_native import ENDED, built, play, tensors  # noqa: F401 (built: the extension must be there)

WORLDS = pathlib.Path(__file__).parent / "worlds"


def start(godot, name, *arguments, flags=("--headless",), **replaced):
    """worlds/NAME.gd as a scene of its own; `replaced`: constants of the script and their new values."""
    source = (WORLDS / f"{name}.gd").read_text()
    for constant, value in replaced.items():
        source, count = re.subn(rf"^const {constant} := .*$", f"const {constant} := {value}", source, flags=re.M)
        assert count == 1, constant
    (godot.project / f"{name}.gd").write_text(source)
    (godot.project / f"{name}.tscn").write_text(
        f'[gd_scene format=3]\n[ext_resource type="Script" path="res://{name}.gd" id="1"]\n'
        f'[node name="World" type="Node2D"]\nscript = ExtResource("1")\n')
    return godot.start(godot.folder / "godot", "--path", godot.project, *flags, f"res://{name}.tscn", "--",
                       *(f"--consac-{argument}" for argument in arguments))


def finished(engine, code=0):
    left, output = engine.finish()
    assert left == code and "SCRIPT ERROR" not in output, output
    return output


TRAIN = ("mode=train", "sessions=1", "quit=1")


def test_a_body_begins_where_reset_puts_it(godot):
    output = finished(start(godot, "bodies", *TRAIN, "steps=40", "set=n_steps:40"))
    found = re.findall(r"bodies: (\S+) (\S+) (\S+)", output)
    assert len(found) >= 6 and set(found) == {("0.5", "0.5", "0.5")}, output  # after a tick of 30 a second
    assert "keeps the speed" not in output, output


def test_a_body_that_keeps_its_speed_is_warned_of_once(godot):
    output = finished(start(godot, "bodies", *TRAIN, "steps=40", "set=n_steps:40", PLACES="false"))
    said = [line for line in output.splitlines() if "reset() puts" in line]
    assert len(said) == 1 and "reset() puts Ball2D elsewhere, but it keeps the speed of the episode before (linear_velocity (30.0, 0.0))" in said[0], output
    assert "ConsacBodies.place_2d()" in said[0], output
    # What the README says: speeds stay, and in 2D the place is lost.
    assert {"30.0 30.0"} == set(re.findall("kept (.*)", output)), output
    assert re.findall(r"bodies: (\d\S*) \S+ \S+", output)[:4] == ["0.5", "3.0", "5.5", "8.0"], output


def test_episodes_of_one_step_are_warned_of(godot):
    output = finished(start(godot, "bodies", *TRAIN, "steps=60", "set=n_steps:32", SHORT="true"))
    assert output.count("20 episodes in a row ended with their first step") == 1, output


def test_timers_tweens_and_frames_go_with_the_ticks_of_fast_training(godot):
    output = finished(start(godot, "frames", *TRAIN, "steps=600", "set=n_steps:100"))
    timer, process, tween, most = map(int, re.search(r"frames: timer (\d+) process (\d+) tween (\d+) most (\d+)", output).groups())
    # In ten seconds of the world, whose timers began before the session.
    assert (process, most) == (600, 1) and 99 <= timer <= 101 and 49 <= tween <= 51, output
    assert "goes with frames, so each tick has one while it learns" in output


def test_ticks_before_a_frame_can_be_set(godot):
    output = finished(start(godot, "frames", *TRAIN, "steps=600", "set=n_steps:600", "ticks-a-frame=64"))
    assert int(re.search(r"most (\d+)", output).group(1)) == 64, output


DRAWS = ["--rendering-driver", "opengl3", "--audio-driver", "Dummy", "--display-driver", "x11"]


def test_a_camera_sees_the_world_as_it_is_in_fast_training(godot, display):
    output = finished(start(godot, "camera_world", *TRAIN, "steps=200", "set=n_steps:48", flags=DRAWS))
    assert re.search(r"camera: 2\d\d right, 0 wrong", output), output


def test_a_camera_that_cannot_see_is_refused_in_one_line(godot):
    output = finished(start(godot, "camera_world", *TRAIN), 1)
    assert "Agent/Eye: nothing is drawn with --headless" in output.splitlines()[-1], output
    assert output.count("ERROR") == 0


def test_a_second_sync_is_refused_until_the_first_is_gone(godot):
    output = finished(start(godot, "two_syncs", "mode=by_hand"), 1)
    assert re.search(r"\S*First drives this game already, and two would stop each other", output), output
    assert "two_syncs: first went on: true, the next one after it: true" in output


def test_a_recording_of_two_behaviours_wants_a_file_for_each(godot, tmp_path):
    code, output = play(godot, "chase", "mode=by_hand", f"record={tmp_path}/played", "quit=1").finish()
    assert code == 1 and "2 behaviours, each with a file of its own; put {behaviour} into record_path" in output, output


@pytest.mark.parametrize("mode", ["by_hand", "act"])
def test_a_recording_of_nobody_is_refused(godot, tmp_path, mode):
    output = finished(start(godot, "spawning", f"mode={mode}", f"record={tmp_path}/played", "quit=1"), 1)
    assert "record_path is set, and there is no agent to record" in output.splitlines()[-1], output


@pytest.mark.parametrize("bad, said", [
    ("steps=1.5", "'1.5' is no whole number"), ("steps=-1", "expected 0 to 1000000000000"),
    ("fast=maybe", "expected 1 or 0"), ("port=70000", "expected 0 to 65535"), ("stpes=3", "there are mode"),
])
def test_a_bad_argument_ends_the_program_wherever_it_stands(godot, bad, said):
    code, output = play(godot, "road", bad, "quit=1").finish()
    assert code == 1 and f"argument '--consac-{bad}': {said}" in output, output


def test_help_lists_the_arguments(godot):
    code, output = play(godot, "road", "help").finish()
    lines = output.splitlines()
    at = lines.index("Arguments behind --, as this scene sets them, and what they take:")
    table = dict(re.fullmatch(r"  --consac-([a-z-]+)=\S* +(\S.*)", line).groups() for line in lines[at + 1:])
    assert code == 0 and table["mode"] == "serve, train, act, by_hand" and table["port"] == "a whole number, 0 to 65535", output
    assert "  --consac-port=5005" in output and table["quit"] == "0, 1" and table["set"] == "NAME:VALUE,NAME:VALUE", output


def test_numbers_that_no_trainer_takes_are_told_of_by_hand(godot):
    output = finished(start(godot, "careless", "mode=by_hand", "steps=30", "sessions=1", "quit=1", SEES="[NAN, 3.0]", PLAYS="7.0"))
    assert output.count("observe() gave nan for entry 'place', whose bounds are -1.0 to 1.0; mend where it comes from") == 1, output
    assert output.count("heuristic() gave 7.0 for entry 'move', whose bounds are -1.0 to 1.0; widen them") == 1, output


def test_agents_come_and_go_in_a_game_that_acts_from_none_on(godot, tmp_path):
    model = tmp_path / "model.consac"
    finished(start(godot, "spawning", *TRAIN, "steps=256", "set=n_steps:64", f"model={model}", AGENTS="1"))
    for mode in ("act", "by_hand"):
        output = finished(start(godot, "spawning", f"mode={mode}", f"model={model}", flags=("--headless", "--fixed-fps", "60"),
                                SCRIPTED="true"))
        assert "spawning: alive [3, 2, 3], steps of the last one 20" in output and "ERROR" not in output, output
        assert ("consac: acting" in output) == (mode == "act"), output


def test_an_agent_that_comes_while_others_learn_is_told_of(godot):
    output = finished(start(godot, "spawning", *TRAIN, "steps=200", "set=n_steps:48", AGENTS="1", SCRIPTED="true"))
    assert re.search("takes no part: it has come while others learn; .* set room_for_agents", output), output


def test_ctrl_c_saves_what_was_learned(godot, tmp_path):
    for sent in (signal.SIGINT, signal.SIGTERM):
        engine = start(godot, "spawning", "mode=train", "steps=1e8", "set=n_steps:64", "report=0.2", "model=%s" % (tmp_path / "m.consac"),
                       AGENTS="1")
        engine.wait_for("updates [1-9]")
        engine.process.send_signal(sent)
        output = finished(engine, 130)
        assert "interrupted after" in output and (tmp_path / "m.stopped.consac").stat().st_size > 1000, output
        (tmp_path / "m.stopped.consac").unlink()


def test_ctrl_c_before_the_first_update_says_that_nothing_was_learned(godot, tmp_path):
    engine = start(godot, "spawning", "mode=train", "steps=1e8", "set=n_steps:100000", "report=0.2", "model=%s" % (tmp_path / "m.consac"),
                   AGENTS="1")
    engine.wait_for("steps/s")
    engine.process.send_signal(signal.SIGINT)
    output = finished(engine, 130)
    assert output.count("nothing was learned yet, so no model is saved") == 1 and not list(tmp_path.glob("*.consac")), output


@pytest.mark.parametrize("masks", ["true", "false"])
def test_masks_that_text_1_cannot_carry_are_told_of(godot, masks):
    engine = start(godot, "leaving", "port=0", "protocol=text1", MASKS=masks)
    engine.port()
    engine.kill()
    output = engine.finish()[1]
    said = re.findall(r"Walker masks its actions, .* mask\(\) counts for nothing.* leave protocol as it is", output)
    assert len(said) == (masks == "true"), output


@pytest.mark.parametrize("how", ["free", "change"])
@pytest.mark.parametrize("mode, code", [("train", 1), ("serve", 1), ("by_hand", 0)])
def test_a_sync_that_leaves_while_it_drives_says_so_saves_and_quits(godot, tmp_path, how, mode, code):
    (godot.project / "empty.tscn").write_text('[gd_scene format=3]\n[node name="Empty" type="Node2D"]\n')
    if mode == "serve":
        engine = start(godot, "leaving", "port=0", "quit=1", HOW=f'"{how}"')
        godot.consac("train", f"tcp://127.0.0.1:{engine.port()}", "--name", "left", *PROTOCOL_2, cwd=tmp_path)
    else:
        engine = start(godot, "leaving", f"mode={mode}", "quit=1", "set=n_steps:64", f"model={tmp_path}/m.consac", HOW=f'"{how}"')
    output = finished(engine, code)
    assert len(re.findall(r"^consac: the ConsacSync has left the scene after \d+ steps", output, re.M)) == 1, output
    assert (tmp_path / "m.stopped.consac").exists() == (mode == "train"), output


def test_a_sync_that_follows_in_the_next_scene_goes_on(godot):
    output = finished(start(godot, "leaving", "mode=by_hand", "quit=1", HOW='"again"'))
    assert output.count("has left the scene") == 1 and "leaving: the second scene goes on" in output, output


def test_ctrl_c_saves_what_was_recorded(godot, tmp_path):
    engine = start(godot, "spawning", "mode=by_hand", f"record={tmp_path}/played", AGENTS="1", SCRIPTED="true")
    engine.wait_for("spawning: alive")
    engine.process.send_signal(signal.SIGTERM)
    finished(engine, 130)
    assert tensors(f"{tmp_path}/played")["rewards"][1][0] > 10


def test_by_hand_counts_sessions(godot, tmp_path):
    output = finished(start(godot, "spawning", "mode=by_hand", "steps=30", "sessions=2", "quit=1", f"record={tmp_path}/played", AGENTS="1"))
    assert output.count("the session ended: 30 steps") == 2, output
    assert tensors(f"{tmp_path}/played")["rewards"][1][0] == 60


def test_loop_mode_with_bodies_of_the_engine_is_refused(godot):
    output = finished(start(godot, "bodies", *TRAIN, "loop=1"), 1)
    assert "loop_mode stops the engine's physics, and Ball2D is a RigidBody2D that it moves" in output, output


def test_a_sensor_without_its_node_is_one_line(godot):
    output = finished(start(godot, "bodies", *TRAIN, RAYS="true"), 1)
    assert "Agent/Rays: set body to the node that the rays begin at" in output.splitlines()[-1], output


def test_a_trainer_of_text_1_that_wants_fewer_steps_is_no_failure(godot, tmp_path):
    engine, port = godot.scene("road", "steps=5000", "sessions=1", "quit=1")
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "short", "--steps", "1000", *TEXT1, cwd=tmp_path)
    assert trainer.finish()[0] == 0
    output = finished(engine)
    assert "the session ended: 1000 steps" in output and "the trainer left after 1000 of 5000 steps" in output, output


def test_the_example_of_the_readme_learns(godot):
    code = re.search(r"```gdscript\n(extends ConsacAgent.*?)```", (ROOT / "engines/godot/README.md").read_text(), re.S).group(1)
    (godot.project / "readme_agent.gd").write_text(code)
    output = finished(start(godot, "readme", *TRAIN, "steps=4e4", "set=n_steps:256,gamma:0.98,noptepochs:10,learning_rate:lin_1e-3"))
    assert float(re.search(ENDED, output).group(5)) > 155, output  # of 200; whoever pushes at random has less than 147


def test_any_project_is_exported_with_its_models_and_is_an_engine_too(godot, tmp_path):
    project = tmp_path / "own"
    shutil.copytree(godot.project, project, ignore=shutil.ignore_patterns(".godot"))
    (project / "examples/road").rename(project / "walk")
    scene = project / "walk/road.tscn"
    scene.write_text(scene.read_text().replace("res://examples/road", "res://walk"))
    presets = project / "export_presets.cfg"
    presets.write_text(presets.read_text().replace('include_filter="*.consac,*/twin.json"', 'include_filter=""'))
    finished(play(godot, "road", *TRAIN, "steps=256", f"model={project}/walk/walker.consac"))
    done = subprocess.run([ROOT / "tools/godot_export.sh", "res://walk/road.tscn", tmp_path / "games", project],
                          capture_output=True, text=True, timeout=DEADLINE_S, env=godot.environment)
    assert done.returncode == 0, done.stdout + done.stderr
    game = godot.start(tmp_path / "games/road", "--headless", "--", "--consac-mode=act", "--consac-model=res://walk/walker.consac",
                       "--consac-steps=100", "--consac-sessions=1", "--consac-quit=1")
    assert "the session ended: 100 steps" in finished(game)
    # It is an engine, too, with no project beside it.
    game, port = godot.scene("road", "steps=20000", "sessions=1", "quit=1", program=tmp_path / "games/road")
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "game", "--no-table", "--no-progress", *TEXT1, cwd=tmp_path)
    assert trainer.finish()[0] == 0
    assert float(re.search(ENDED, finished(game)).group(3)) > 0.9


def test_agents_whose_scripts_have_a_life_of_their_own_come_and_go(godot):
    output = finished(start(godot, "careless", *TRAIN, "steps=600", "set=n_steps:32", COMES_AND_GOES="true"))
    assert "training completed" in output and "ERROR" not in output, output


def test_a_sensor_that_is_removed_ends_the_session_in_one_line(godot):
    output = finished(start(godot, "careless", *TRAIN, "steps=600", "set=n_steps:32", LOSES_SENSOR="true"), 1)
    assert output.count("a sensor was removed while it runs; keep it until the session ends") == 1, output


def test_bools_are_numbers_and_words_are_none(godot):
    assert "training completed" in finished(start(godot, "careless", *TRAIN, "steps=100", "set=n_steps:32"))
    output = finished(start(godot, "careless", *TRAIN, "steps=100", "set=n_steps:32", SEES='[1.0, "far"]'), 1)
    assert "observe() gave a String in number 1 of entry 'place', expected numbers" in output, output


@pytest.mark.parametrize("name, said", [("steps", "'steps' is a number of the sync's own"), (r"two\nlines", r"'two\nlines' is no name of one line")])
def test_a_metric_is_not_called_as_the_syncs_own_numbers(godot, name, said):
    output = finished(start(godot, "careless", *TRAIN, "steps=400", "set=n_steps:32", "report=0.01", NOTED=f'"{name}"'))
    assert output.count(said) == 1 and " 5 of 400 steps" not in output, output


FAILS = r"an error in res://careless.gd, line \d+, fail\(\): Cannot call method 'queue_free' on a null value"


@pytest.mark.parametrize("where, mode", [*((where, "train") for where in ("reset", "observe", "act", "judge", "sense")),
                                         ("heuristic", "by_hand")])
def test_an_error_in_a_script_ends_the_session_in_one_line(godot, where, mode):
    """GDScript only leaves the function; what the agents saw or earned would be wrong for all the rest."""
    code, output = start(godot, "careless", f"mode={mode}", "sessions=1", "quit=1", "steps=400", "set=n_steps:32",
                         "loop=" + str(int(where != "act")), ERRS=f'"{where}"').finish()
    assert code == 1 and len(re.findall("^consac: " + FAILS, output, re.M)) == 1, output
    assert "the session failed" in output and "training completed" not in output, output


@pytest.mark.parametrize("protocol", [TEXT1, PROTOCOL_2])
def test_a_trainer_hears_of_an_error_in_a_script(godot, tmp_path, protocol):
    engine = start(godot, "careless", "port=0", "steps=400", "sessions=1", "quit=1", *(["protocol=text1"] if protocol == TEXT1 else []),
                   ERRS='"judge"', AGENTS="1")
    port = engine.port()
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "erring", *protocol, cwd=tmp_path)
    assert re.search(FAILS, trainer.finish()[1]), trainer.output()
    assert engine.finish()[0] == 1 and re.search("^consac: " + FAILS, engine.output(), re.M), engine.output()


def test_a_second_sync_that_is_refused_quits_nobodys_program(godot):
    output = finished(start(godot, "careless", *TRAIN, "steps=300", "set=n_steps:32", SYNCS="2"))
    assert "drives this game already" in output and "training completed" in output, output


def test_each_of_several_behaviours_has_its_mean_reward(godot, tmp_path):
    curve = tmp_path / "curve.csv"
    finished(play(godot, "chase", *TRAIN, "steps=8000", f"curve={curve}", f"model={tmp_path}/{{behaviour}}.consac"))
    last = {name: float(value) for _, name, value in (line.split(",") for line in curve.read_text().splitlines()[1:])}
    chaser, runner = (last[f"mean_episode_reward {behaviour}"] for behaviour in ("chaser", "runner"))
    assert chaser != runner and min(chaser, runner) <= last["mean_episode_reward"] <= max(chaser, runner), last
