"""Text protocol 1 as the GDScript engine speaks it: its rules, its errors, its pace, its repeatability."""
import random
import re
import time

import pytest

from engine import ROOT, Trainer


def play(port, actions):
    """Every line of a session with these actions."""
    with Trainer(port) as trainer:
        setup, first = trainer.begin()
        lines = ["#".join(setup), first]
        for action in actions:
            lines += trainer.step(action)
        return lines


def test_a_session_by_the_rules(godot):
    engine, port = godot.scene("road", "steps=60", "name=walker")
    with Trainer(port) as trainer:
        setup, first = trainer.begin()
        assert setup == ["D", "3", "0", "B", "2", "0,0,40,40", "60", "walker"]
        actor, coin = map(float, first.split("#")[0].split(","))
        assert first.split("#")[1:] == ["0.0", "0"] and actor == 10 and coin != actor
        for _ in range(60):
            lines = trainer.step(0)  # always to the left: the road ends
            place, reward, done = lines[0].split("#")
            assert (len(lines) == 2) == (done == "1")
            if done == "1":  # the road's end, and the next episode's beginning
                assert place.startswith("0,") and lines[1].endswith("#0.0#0")
            else:
                assert float(reward) in (0, 1)
    engine.wait_for("training completed: 60 steps")


def test_a_second_trainer_is_told_that_the_engine_is_busy(godot):
    _, port = godot.scene("road")
    with Trainer(port) as first:
        first.begin()
        with Trainer(port) as second:
            assert second.line().startswith("busy: ")
            assert second.line() == ""  # closed
        assert first.step(1)[0].endswith("#0")  # undisturbed


@pytest.mark.parametrize("example, bad, expected", [
    ("road", b"7\n", "no choice from 0 to 2"),
    ("road", b"left\n", "no choice from 0 to 2"),
    ("road", b"\xc0\xde\x00\xff", "no text"),
    ("rolling_ball", b"0.5\n", "it holds 1 numbers, expected 2"),
    ("rolling_ball", b"0,5,0,5\n", "it holds 4 numbers, expected 2"),
    ("rolling_ball", b"0.5,nan\n", "expected a finite number"),
    ("rolling_ball", b"0.5,1e999\n", "expected a finite number"),
    ("rolling_ball", b"0.5,\xff\n", "no text"),
    # On a busy machine there may be a silence in its midst, which ends a message: what came until then is answered.
    ("rolling_ball", b"1" * ((1 << 20) + 9), "(longer than 1048576 bytes|it holds 1 numbers, expected 2)"),
], ids=lambda value: value[:12].hex() if isinstance(value, bytes) else None)
def test_bad_bytes_are_one_line_and_the_engine_goes_on(godot, example, bad, expected):
    engine, port = godot.scene(example)
    with Trainer(port) as trainer:
        trainer.begin()
        trainer.socket.sendall(bad)
        engine.wait_for("consac: .*" + expected)
    with Trainer(port) as trainer:
        trainer.begin()
        assert len(trainer.step(1 if example == "road" else "0,0")[0].split("#")) == 3
    engine.kill()
    assert "SCRIPT ERROR" not in engine.finish()[1]


def test_a_bad_action_is_told_to_the_trainer(godot):
    _, port = godot.scene("road")
    with Trainer(port) as trainer:
        trainer.begin()
        assert trainer.step(9) == ["error: action '9': it is no choice from 0 to 2"]


def test_actions_without_newlines_and_beyond_the_bounds(godot):
    _, port = godot.scene("rolling_ball")
    with Trainer(port) as bounded, Trainer(port):
        bounded.begin()
        bounded.socket.sendall(b"9,-9")  # ends by silence, and is clipped
        clipped = bounded.line()
    with Trainer(port) as again:
        again.begin()
        assert again.step("1,-1") != [] and clipped.count("#") == 2


def test_a_silent_trainer_is_given_up(godot):
    engine, port = godot.scene("road", "deadline=0.5")
    with Trainer(port) as trainer:
        trainer.begin()
        engine.wait_for("the trainer is silent for 0.5 s")
    with Trainer(port) as trainer:
        assert len(trainer.begin()[0]) == 7


def test_counted_are_sessions_in_which_a_trainer_has_stepped(godot):
    engine, port = godot.scene("road", "sessions=1", "quit=1", "steps=3")
    with Trainer(port) as stray:
        stray.begin()
    engine.wait_for("the trainer left after 0 of 3 steps")
    with Trainer(port) as trainer:
        trainer.begin()
        for _ in range(3):
            trainer.step(1)
    code, output = engine.finish()
    assert code == 0 and "training completed: 3 steps" in output and "(none has ended: " in output


def test_a_slow_world_is_no_silent_trainer(godot):
    # A step of this world takes a second and a half of the clock, and the trainer answers at once.
    engine, port = godot.scene("road", "deadline=1", "period=90", "fast=0", "loop=0")
    with Trainer(port) as trainer:
        trainer.begin()
        for _ in range(2):
            assert trainer.step(1)[0].count("#") == 2
        engine.wait_for("the trainer is silent for 1.0 s")


def test_what_does_not_fit_is_refused_with_one_line(godot):
    def refused(example, *arguments):
        engine = godot.start(godot.folder / "godot", "--headless", "--path", godot.project,
                             f"res://examples/{example}/{example}.tscn", "--", "--consac-quit=1",
                             *(f"--consac-{argument}" for argument in arguments))
        code, output = engine.finish()
        assert code == 1 and "SCRIPT ERROR" not in output
        return output.splitlines()[-1]

    assert "one agent, this scene has 64" in refused("chase", "mode=serve", "protocol=text1")
    assert "training length 0 without a model name" in refused("road", "protocol=text1", "steps=0")
    _, port = godot.scene("road")
    assert f"port {port} of 127.0.0.1 is taken" in refused("road", "protocol=text1", f"port={port}")


@pytest.mark.parametrize("example", ["cart_pole", "rolling_ball"])
def test_the_same_actions_give_the_same_bits(godot, example):
    rng = random.Random(1)
    actions = [rng.randrange(2) if example == "cart_pole" else f"{rng.uniform(-1, 1)},{rng.uniform(-1, 1)}"
               for _ in range(600)]
    # The third one counts on the engine's own fixed step instead of ours.
    sessions = [play(godot.scene(example, *arguments, flags=flags)[1], actions)
                for arguments, flags in [((), ()), ((), ()), (("fast=0",), ("--fixed-fps", "60"))]]
    assert len(sessions[0]) > 600 and sum(line.endswith("#1") for line in sessions[0]) > 1
    assert sessions[0] == sessions[1] == sessions[2]


def test_loop_mode_is_much_faster_than_frames(godot):
    def speed(count, *arguments):
        _, port = godot.scene("road", "period=1", *arguments)
        with Trainer(port) as trainer:
            trainer.begin()
            start = time.monotonic()
            for _ in range(count):
                trainer.step(1)
            return count / (time.monotonic() - start)

    frames, fixed, loop = speed(120, "loop=0", "fast=0"), speed(5000, "loop=0"), speed(5000)
    print(f"road, steps/s: frame-bound {frames:.0f}, fixed step {fixed:.0f}, loop mode {loop:.0f}")
    assert loop > 10 * frames and fixed > 10 * frames


def start_script(godot, name, *flags, arguments=()):
    """A script of this folder inside the engine."""
    (godot.project / name).write_text((ROOT / "tests/godot" / name).read_text())
    return godot.start(godot.folder / "godot", "--path", godot.project, *flags, "--script", f"res://{name}", "--",
                       *arguments)


def test_the_scripts_by_themselves(godot):
    """What the wire does not show; unit.gd prints one line a check."""
    transcripts = f"--transcripts={ROOT}/spec/conformance/text1/transcripts.json"
    code, output = start_script(godot, "unit.gd", "--headless", arguments=[transcripts]).finish()
    failed = [line for line in output.splitlines() if re.match("FAIL|SCRIPT ERROR", line)]
    assert code == 0 and not failed and output.count("\nok ") > 20, output


def test_every_setting_that_a_session_changes_is_put_back(godot):
    engine = start_script(godot, "pace.gd", "--headless", arguments=["--consac-port=0", "--consac-protocol=text1"])
    before = engine.wait_for("^before: (.*)").group(1)
    with Trainer(engine.port()) as trainer:
        trainer.begin()
        trainer.step(1)
        during = engine.wait_for(r"^during: (\[.*\])").group(1)
    after = engine.wait_for(r"^after: (\[.*\])").group(1)
    gone = engine.wait_for("^gone: (.*)").group(1)
    assert not before.startswith(during) and before.startswith(after) and gone == before
    assert engine.finish()[0] == 0


def test_a_camera_sees_what_is_drawn(godot, display):
    flags = ["--rendering-driver", "opengl3", "--audio-driver", "Dummy", "--display-driver", "x11"]
    code, output = start_script(godot, "camera.gd", *flags).finish()
    assert code == 0 and "camera: 96 of 96" in output, output
    assert re.search(r"camera: first \[2[45]\d, [0-9], [0-9]\], last [0-9]+", output), output


def scene_file(godot, name, script, below="."):
    """A world of one agent with this script's lines, beside the examples; `below`: the node above the agent."""
    (godot.project / f"{name}.gd").write_text("extends ConsacAgent\n" + script)
    (godot.project / f"{name}.tscn").write_text(SCENE.replace("NAME", name).replace("BELOW", below))
    return f"res://{name}.tscn"


def test_a_picture_is_refused_with_one_line(godot):
    scene = scene_file(godot, "picture", "func prepare() -> String:\n\tobservations[0] = ConsacEntry.image(&'eye', Vector2i(8, 4), 3)\n\treturn super()\n")
    code, output = godot.start(godot.folder / "godot", "--headless", "--path", godot.project, scene, "--",
                               "--consac-quit=1", "--consac-protocol=text1").finish()
    assert code == 1 and "entry 'eye' is an image: protocol 2 carries it" in output.splitlines()[-1], output


@pytest.mark.parametrize("fault, said", [
    ("into[&'place'] = NAN if steps == 2 else 0.0", "observe() gave nan for entry 'place'"),
    ("into[&'place'] = 0.0\n\nfunc judge() -> void:\n\tadd_reward(INF if steps == 1 else 0.0)", "the reward of step 2 of its episode is inf"),
    ("into[&'place'] = Vector3.ZERO if steps == 2 else 0.0", "observe() gave 3 numbers for entry 'place', expected 1"),
    ("into[&'plaze' if steps == 2 else &'place'] = 0.0", "observe() gave nothing for entry 'place', expected numbers; no entry is named 'plaze'"),
], ids=["not a number", "reward", "too many", "misspelt"])
def test_a_world_that_goes_wrong_ends_its_session_and_the_engine_goes_on(godot, fault, said):
    scene = scene_file(godot, "wrong", f"func observe(into: Dictionary) -> void:\n\t{fault}\n", below="Stall")
    engine = godot.start(godot.folder / "godot", "--headless", "--path", godot.project, scene, "--", "--consac-port=0",
                         "--consac-protocol=text1", "--consac-loop=1")
    port = engine.port()
    for _ in range(2):
        with Trainer(port) as trainer:
            trainer.begin()
            assert trainer.step("0.5") == ["0#0.0#0"]
            answer = trainer.step("0.5")[0]
            assert answer.startswith("error: Stall/Agent: " + said)  # of many stalls it says which
    engine.kill()
    assert "SCRIPT ERROR" not in engine.finish()[1]


SCENE = """[gd_scene format=3]
[ext_resource type="Script" path="res://addons/consac/consac_sync.gd" id="1"]
[ext_resource type="Script" path="res://NAME.gd" id="2"]
[ext_resource type="Script" path="res://addons/consac/consac_entry.gd" id="3"]
[sub_resource type="Resource" id="place"]
script = ExtResource("3")
name = &"place"
[sub_resource type="Resource" id="move"]
script = ExtResource("3")
name = &"move"
[node name="World" type="Node"]
[node name="ConsacSync" type="Node" parent="."]
script = ExtResource("1")
[node name="Stall" type="Node" parent="."]
[node name="Agent" type="Node" parent="BELOW"]
script = ExtResource("2")
observations = Array[ExtResource("3")]([SubResource("place")])
actions = Array[ExtResource("3")]([SubResource("move")])
"""
