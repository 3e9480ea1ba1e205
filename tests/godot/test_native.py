"""The native extension in the real engine: protocol 2, models that act, training inside, many agents, misuse."""
import json
import os
import pathlib
import re
import signal
import struct
import subprocess
import sys

import pytest

from engine import DEADLINE_S, PROTOCOL_2, ROOT, TEXT1, kept_port

NATIVE = pathlib.Path(__file__).parent / "native"
# The settings for CartPole that CONSAC's own built-in world suggests, with longer rollouts.
CART_POLE = {"n_steps": "128", "gamma": "0.98", "noptepochs": "10", "learning_rate": "lin_1e-3", "ent_coef": "0"}
# example: actions to train for, settings, the least that the engine's last line must show: "step" or "episode" and how much
TASKS = {
    "road": (20000, {}, ("step", 0.9)),
    "cart_pole": (60000, CART_POLE, ("episode", 400.0)),
    "rolling_ball": (15000, {}, ("episode", 2.0)),  # 1 for the target, and the metres that it came nearer
}
# The same of algorithms that learn at every step.
EVERY_STEP = {"sac": ("rolling_ball", 15000, {"train_freq": "1", "learning_rate": "1e-3", "net_arch": "[128]", "batch_size": "128",
                                             "learning_starts": "500", "gamma": "0.98"}, ("episode", 2.0))}
ENDED = (r"training completed: (\d+) steps in .* \((\d+) steps/s\), mean reward of the last \d+ steps (-?[\d.]+), "
         r"of the last (\d+) episodes (-?[\d.]+|nan)")


@pytest.fixture(autouse=True)
def built():
    if not list((ROOT / "engines/godot/addons/consac/bin").glob("libconsac.*")):
        reason = "the extension is not built: ninja -C build/release consac_godot"
        if os.environ.get("CI") or os.environ.get("CONSAC_REQUIRE_GODOT") == "1":
            pytest.fail(reason)
        pytest.skip(reason)


def serve(godot, example, *arguments, **options):
    """An example that waits for a trainer, served by the extension."""
    return godot.scene(example, "protocol=auto", *arguments, **options)


def play(godot, example, *arguments, program=None, flags=()):
    """An example in one of the modes without a trainer."""
    command = [program] if program else [godot.folder / "godot", "--path", godot.project]
    scene = [] if program else [f"res://examples/{example}/{example}.tscn"]
    return godot.start(*command, "--headless", *flags, *scene, "--", *(f"--consac-{argument}" for argument in arguments))


def script(godot, name, *arguments):
    """A script of native/, run by the engine in the project."""
    copy = godot.project / name
    copy.write_text((NATIVE / name).read_text())
    return godot.start(godot.folder / "godot", "--headless", "--path", godot.project, "--script", f"res://{name}", "--", *arguments)


def train(godot, ports, folder, name, steps=None, settings=None, algorithm=None, protocol=PROTOCOL_2):
    arguments = (["--steps", steps] if steps else []) + (["--algo", algorithm] if algorithm else [])
    for key, value in (settings or {}).items():
        arguments += ["--set", f"{key}={value}"]
    return godot.consac("train", *(f"tcp://127.0.0.1:{port}" for port in ports), "--name", name, "--no-table", "--no-progress",
                        "--json", *protocol, *arguments, cwd=folder)


def summary(trainer):
    code, output = trainer.finish()
    assert code == 0, output
    return json.loads(output.splitlines()[-1])


def check_learned(example, engine, task=None):
    steps, _, (unit, least) = task or TASKS[example]
    said = engine.wait_for(ENDED)
    print(f"{example}: {said.group(0)}")
    assert int(said.group(1)) >= steps * 0.99
    assert float(said.group(3 if unit == "step" else 5)) > least


def tensors(path):
    """The tensors of a safetensors file: name -> (type, shape, bytes)."""
    data = pathlib.Path(path).read_bytes()
    length = struct.unpack("<Q", data[:8])[0]
    header = json.loads(data[8:8 + length])
    rest = data[8 + length:]
    return {name: (row["dtype"], row["shape"], rest[slice(*row["data_offsets"])])
            for name, row in header.items() if name != "__metadata__"}


@pytest.fixture(scope="session")
def models(tmp_path_factory):
    """example -> a model that `consac train` has learned over protocol 2; the first test that wants one trains it."""
    return tmp_path_factory.mktemp("models"), {}


def learned(godot, models, example):
    folder, done = models
    if example not in done:
        steps, settings, _ = TASKS[example]
        engine, port = serve(godot, example, f"steps={steps}", "sessions=1", "quit=1")
        trainer = train(godot, [port], folder, example, settings=settings)
        assert summary(trainer)["steps"] == steps
        check_learned(example, engine)
        code, output = engine.finish()
        assert code == 0 and "ERROR" not in output, output
        done[example] = folder / "runs" / example / "model.consac"
    return done[example]


@pytest.mark.parametrize("example", TASKS)
def test_consac_train_learns_over_protocol_2(godot, models, example):
    assert learned(godot, models, example).exists()


def test_an_engine_is_killed_and_rejoins(godot, tmp_path):
    first, port = serve(godot, "road", "steps=10000000", f"port={kept_port()}")
    _, other_port = serve(godot, "road", "steps=10000000")
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", f"tcp://127.0.0.1:{other_port}", "--name", "rejoin", "--steps",
                           "100000000", "--log-interval", "1", "--no-progress", *PROTOCOL_2, cwd=tmp_path)
    trainer.wait_for("total_timesteps")
    first.kill()
    trainer.wait_for("an engine is lost")
    serve(godot, "road", "steps=10000000", f"port={port}")
    trainer.wait_for("an engine is back")
    trainer.process.send_signal(signal.SIGINT)  # how long the rest takes is no matter of this test
    code, output = trainer.finish()
    assert code == 130 and (tmp_path / "runs/rejoin/model.consac").exists(), output


def test_a_model_of_text_protocol_1_acts_in_the_extension(godot, tmp_path):
    """It was learned from nothing but GDScript, and its observations have no names."""
    engine, port = godot.scene("road", "steps=10000", "sessions=1", "quit=1")
    assert summary(train(godot, [port], tmp_path, "text", protocol=TEXT1))["steps"] == 10000
    assert engine.finish()[0] == 0
    acted = recorded(godot, "road", tmp_path / "acted", "mode=act", f"model={tmp_path}/runs/text/model.consac", "fast=0",
                     flags=["--fixed-fps", "60", "--quit-after", "1500"])
    rewards = struct.unpack(f"<{acted['rewards'][1][0]}f", acted["rewards"][2])
    assert len(rewards) > 200 and sum(rewards) > 0.8 * len(rewards)


def recorded(godot, example, path, *arguments, **options):
    program = play(godot, example, f"record={path}", *arguments, **options)
    code, output = program.finish()
    assert code == 0 and "ERROR" not in output, output
    return tensors(path)


def first_rows(all_tensors, rows):
    """The first rows of observations and actions, as bytes."""
    out = {}
    for name, (dtype, shape, data) in all_tensors.items():
        if name.split("/")[0] in ("observations", "actions"):
            assert shape[0] >= rows, (name, shape)
            out[name] = (dtype, data[:len(data) // shape[0] * rows])
    return out


@pytest.mark.parametrize("example, place", [("road", "editor"), ("rolling_ball", "editor"), ("rolling_ball", "exported game")])
def test_the_model_acts_as_consac_eval_does_bit_for_bit(godot, models, tmp_path, example, place):
    """From the same seed the same observations lead to the same actions, which lead to the same observations."""
    rows = 200
    model = learned(godot, models, example)
    engine, port = serve(godot, example, "sessions=1", "quit=1", f"record={tmp_path / 'judged'}")
    judge = godot.consac("eval", model, f"tcp://127.0.0.1:{port}", "--episodes", "40" if example != "road" else "1",
                         "--max-episode-steps", "300", "--seed", "5", cwd=tmp_path)
    code, output = judge.finish()
    assert code == 0, output
    assert engine.finish()[0] == 0
    program = None
    if place == "exported game":
        code, output = godot.start(ROOT / "tools/godot_export.sh", example, tmp_path / "games").finish()
        assert code == 0, output
        program = tmp_path / "games" / example
    acted = recorded(godot, example, tmp_path / "acted", "mode=act", f"model={model}", "seed=5", "fast=0", program=program,
                     flags=["--fixed-fps", "60", "--quit-after", "1800"])
    assert first_rows(acted, rows) == first_rows(tensors(tmp_path / "judged"), rows)


@pytest.mark.parametrize("example, meanwhile", [*((example, "wait") for example in TASKS), ("road", "act")])
def test_training_inside_the_engine(godot, tmp_path, example, meanwhile):
    """The same return as with the program `consac`, without it."""
    steps, settings, _ = TASKS[example]
    model = tmp_path / "inside.consac"
    engine = play(godot, example, "mode=train", f"steps={steps}", "sessions=1", "quit=1", f"model={model}",
                  "set=" + ",".join(f"{key}:{value}" for key, value in settings.items()),
                  f"act-while-learning={int(meanwhile == 'act')}")
    if meanwhile == "wait":
        check_learned(example, engine)
    else:  # steps that the model acted during learning count for nothing; their number depends on the clock
        assert int(engine.wait_for(ENDED).group(1)) >= steps
    assert engine.finish()[0] == 0
    assert model.stat().st_size > 1000


@pytest.mark.parametrize("place", ["consac train", "inside the engine"])
@pytest.mark.parametrize("algorithm", EVERY_STEP)
def test_learning_at_every_step(godot, tmp_path, algorithm, place):
    """By the engine's physics; the program and the engine reach the same."""
    example, *task = EVERY_STEP[algorithm]
    steps, settings, _ = task
    arguments = [f"steps={steps}", "sessions=1", "quit=1"]
    if place == "consac train":
        engine, port = serve(godot, example, *arguments)
        assert summary(train(godot, [port], tmp_path, "every_step", settings=settings, algorithm=algorithm))["steps"] == steps
    else:
        engine = play(godot, example, "mode=train", *arguments, f"model={tmp_path}/inside.consac", f"algorithm={algorithm}",
                      "set=" + ",".join(f"{key}:{value}" for key, value in settings.items()))
    check_learned(example, engine, task)
    assert engine.finish()[0] == 0


def test_several_behaviours_and_many_agents_learn_inside(godot, tmp_path):
    engine = play(godot, "chase", "mode=train", "steps=20000", "sessions=1", "quit=1", f"model={tmp_path}/{{behaviour}}.consac")
    engine.wait_for(ENDED)
    assert engine.finish()[0] == 0
    assert {path.name for path in tmp_path.glob("*.consac")} == {"chaser.consac", "runner.consac"}


def test_what_does_not_fit_is_one_line(godot, models, tmp_path):
    def refused(example, *arguments):
        code, output = play(godot, example, *arguments, "quit=1").finish()
        assert code == 1 and "SCRIPT ERROR" not in output, output
        return output.splitlines()[-1]

    (tmp_path / "broken.consac").write_bytes(b"x" * 100)
    model = learned(godot, models, "road")
    assert "there is no file 'res://none.consac'" in refused("road", "mode=act", "model=res://none.consac")
    assert "broken.consac" in refused("road", "mode=act", f"model={tmp_path}/broken.consac")
    assert "observation" in refused("rolling_ball", "mode=act", f"model={model}")
    assert "did you mean 'gamma'" in refused("road", "mode=train", "set=gama:0.9")
    _, port = serve(godot, "road")
    assert str(port) in refused("road", f"port={port}")


def test_misuse_of_the_classes_harms_nothing(godot, models, yumi):
    """2,000 sequences of 40 random calls; most of them wrong."""
    program = script(godot, "misuse.gd", "1", "2000", str(learned(godot, models, "road")), str(yumi / "twin.json"))
    said = program.wait_for(r"misuse: 2000 sequences, (\d+) calls, (\d+) offers, cues \[(\d+), (\d+), (\d+), (\d+), (\d+)\]")
    calls, offers, *cues = map(int, said.groups())
    assert calls == 80000 and offers > 1000 and all(cues)  # not all of it was refused
    program.wait_for(r"afterwards: \[(1.0, ){7}1.0\]")
    assert program.finish()[0] == 0


def test_the_classes_by_themselves(godot, models):
    """What the scenes do not show; classes.gd prints one line a check."""
    program = script(godot, "classes.gd", str(learned(godot, models, "road")))
    code, output = program.finish()
    failed = [line for line in output.splitlines() if re.match("FAIL|SCRIPT ERROR", line)]
    assert code == 0 and not failed and output.count("\nok ") >= 20, output


def wire_rate(godot, *crowd):
    """Agent steps a second of a crowd that a trainer drives which learns nothing."""
    engine = script(godot, "crowd.gd", crowd[0], "serve", crowd[1], str(DEADLINE_S))
    port = engine.port()
    client = subprocess.run([sys.executable, NATIVE / "client.py", str(port), "2"], capture_output=True, text=True, timeout=DEADLINE_S,
                            env={**os.environ, "PYTHONPATH": str(ROOT / "python")})
    assert client.returncode == 0, client.stderr
    engine.kill()
    return int(client.stdout)


def test_64_agents_in_one_scene(godot):
    """A tick of the engine and a message there and back serve them all: of 64 times the steps a quiet machine reaches 35 to 45
    (bench/results/godot.md), and a busy one far more than the 1 or 2 of messages for each."""
    one, many = wire_rate(godot, "1", "fixed"), wire_rate(godot, "64", "fixed")
    print(f"agent steps/s over protocol 2: 1 agent {one}, 64 agents {many}")
    assert many > 8 * one


def test_loop_mode_of_the_extension_is_much_faster_than_frames(godot):
    frames, loop = wire_rate(godot, "1", "frame"), wire_rate(godot, "1", "loop")
    print(f"steps/s over protocol 2: frame-bound {frames}, loop mode {loop}")
    assert loop > 10 * frames


SCENE = """[gd_scene format=3]
[ext_resource type="Script" path="res://addons/consac/consac_sync.gd" id="1"]
[ext_resource type="Script" path="res://NAME.gd" id="2"]
[node name="World" type="Node"]
[node name="ConsacSync" type="Node" parent="."]
script = ExtResource("1")
[node name="Agent" type="Node" parent="."]
script = ExtResource("2")
"""
ONE_NUMBER = """extends ConsacAgent

var place := 0.0


func _init() -> void:
	observations = [ConsacEntry.box(&"place", 1)]
	actions = [ConsacEntry.box(&"move", 1)]


func reset(_episode_seed: int) -> void:
	place = rng.randf()


func observe(into: Dictionary) -> void:
	into[&"place"] = WHAT
"""


PAUSES = """

func judge() -> void:
	if steps == 50 and not get_tree().paused:
		get_tree().paused = true
		get_tree().create_timer(4.0, true, false, true).timeout.connect(func() -> void: get_tree().paused = false)
"""


QUITS = """

func judge() -> void:
	if steps == AT:
		get_tree().quit()
"""


def world(godot, name, source):
    """A scene of one agent with this script: the command that plays it."""
    (godot.project / f"{name}.gd").write_text(source)
    (godot.project / f"{name}.tscn").write_text(SCENE.replace("NAME", name))
    return [godot.folder / "godot", "--headless", "--path", godot.project, f"res://{name}.tscn"]


def test_pictures_and_a_person_are_recorded_as_they_were(godot, tmp_path):
    command = world(godot, "pictures", (NATIVE / "pictures.gd").read_text())
    program = godot.start(*command, "--fixed-fps", "60", "--quit-after", "60", "--", "--consac-mode=by_hand",
                          f"--consac-record={tmp_path}/played")
    code, output = program.finish()
    assert code == 0 and "ERROR" not in output, output
    played = tensors(tmp_path / "played")
    dtype, (steps, *shape), pixels = played["observations/eye"]
    assert (dtype, shape) == ("U8", [2, 3, 1]) and steps >= 9
    # An episode's last observation and the next one's first are both seen, but only the second one is acted upon.
    seen = [number for number in range(1, 2 * steps) if number % 4 != 0][:steps]
    assert struct.unpack(f"<{steps}f", played["observations/number"][2]) == tuple(seen)
    assert list(pixels) == [number % 40 + i for number in seen for i in range(6)]
    assert struct.unpack(f"<{2 * steps}f", played["actions/push"][2]) == (0.25, -0.5) * steps
    assert list(struct.unpack(f"<{steps}i", played["actions/jump"][2])) == [step % 3 for step in range(steps)]
    assert list(played["truncated"][2]) == [step % 3 == 2 for step in range(steps)]


def test_an_environment_is_reset_in_the_midst_of_a_session(godot):
    """As Gymnasium means it: a seed gives the same episodes again."""
    command = world(godot, "seeded", ONE_NUMBER.replace("WHAT", "place"))
    engine = godot.start(*command, "--", "--consac-port=0", "--consac-loop=1")
    port = engine.port()
    client = f"""if True:
        import consac, json
        env = consac.make("tcp://127.0.0.1:{port}", protocol=2)
        def episode(seed):
            first, _ = env.reset(seed=seed)
            for _ in range(3):
                last = env.step(env.action_space.low)[0]
            return float(first[0]), float(last[0])
        print(json.dumps([episode(3), episode(4), episode(3), episode(None) != episode(None)]))
        env.close()"""
    done = subprocess.run([sys.executable, "-c", client], capture_output=True, text=True, timeout=DEADLINE_S,
                          env={**os.environ, "PYTHONPATH": str(ROOT / "python")})
    assert done.returncode == 0, done.stderr
    first, other, again, differ = json.loads(done.stdout)
    assert first == again != other and differ


def test_a_reset_in_the_midst_of_a_session_that_goes_wrong_ends_it_and_not_the_engine(godot):
    wrong = '"text" if steps == 0 and get_node("../ConsacSync").steps > 0 else place'
    engine = godot.start(*world(godot, "stuck", ONE_NUMBER.replace("WHAT", wrong)), "--", "--consac-port=0", "--consac-loop=1")
    port = engine.port()

    def client(*resets):
        lines = ["import consac", f"env = consac.make('tcp://127.0.0.1:{port}', protocol=2)"]
        for seed in resets:
            lines += [f"env.reset(seed={seed})", "env.step(env.action_space.low)"]
        return subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, timeout=DEADLINE_S,
                              env={**os.environ, "PYTHONPATH": str(ROOT / "python")})

    ended = client(3, 4)
    assert ended.returncode != 0 and "gave a String for entry 'place'" in ended.stderr, "the trainer hears why"
    engine.wait_for("consac: Agent: observe\\(\\) gave a String for entry 'place'")
    again = client(3)
    assert again.returncode == 0, again.stderr  # the next trainer is served
    engine.kill()
    assert "SCRIPT ERROR" not in engine.finish()[1]


def test_a_trainer_that_leaves_in_the_handshake_was_no_session(godot):
    """As one does whose model does not fit: the next is served at once, and nothing is said of steps that it did not take."""
    engine = godot.start(*world(godot, "shy", ONE_NUMBER.replace("WHAT", "place")), "--", "--consac-port=0", "--consac-loop=1")
    port = engine.port()
    client = f"""if True:
        import consac
        from consac.client import Connection
        for session in range(2):
            env = consac.make("tcp://127.0.0.1:{port}", protocol=2)
            env.reset(seed=1)
            for _ in range(3):
                env.step(env.action_space.low)
            env.close()
            for attempt in range(3):
                try:
                    Connection("tcp://127.0.0.1:{port}", expect=[{{"name": "somebody else"}}])
                    raise SystemExit("it fits")
                except consac.ConsacError as error:
                    assert "SPEC_MISMATCH" in str(error), error"""
    done = subprocess.run([sys.executable, "-c", client], capture_output=True, text=True, timeout=DEADLINE_S,
                          env={**os.environ, "PYTHONPATH": str(ROOT / "python")})
    assert done.returncode == 0, done.stderr
    engine.wait_for("the session ended: 3 steps")
    engine.wait_for("the session ended: 3 steps")
    engine.kill()
    output = engine.finish()[1]
    assert len(re.findall(r"the session \w+: \d+ steps", output)) == 2, output


def test_a_training_that_is_stopped_keeps_what_was_learned_under_a_name_of_its_own(godot, tmp_path):
    finished, stopped = tmp_path / "model.consac", tmp_path / "model.stopped.consac"
    finished.write_bytes(b"a finished model")
    for at, learns in ((20, False), (150, True)):
        source = ONE_NUMBER.replace("WHAT", "place") + QUITS.replace("AT", str(at))
        engine = godot.start(*world(godot, "quitting", source), "--", "--consac-mode=train", "--consac-steps=1000000",
                             "--consac-set=n_steps:64", f"--consac-model={finished}")
        code, output = engine.finish()
        assert code == 0 and stopped.exists() == learns, output
    assert finished.read_bytes() == b"a finished model" and str(stopped) in output


def test_a_training_that_goes_wrong_keeps_what_was_learned(godot, tmp_path):
    source = ONE_NUMBER.replace("WHAT", 'NAN if get_node("../ConsacSync").steps > 150 else place')
    engine = godot.start(*world(godot, "late", source), "--", "--consac-mode=train", "--consac-quit=1", "--consac-set=n_steps:64",
                         f"--consac-model={tmp_path}/model.consac")
    code, output = engine.finish()
    assert code == 1 and "sees NaN" in output and "SCRIPT ERROR" not in output, output
    assert (tmp_path / "model.stopped.consac").stat().st_size > 1000


@pytest.mark.parametrize("who", ["a rule", "a model"])
def test_what_goes_wrong_where_nobody_learns_ends_it_with_one_line(godot, tmp_path, who):
    model = tmp_path / "model.consac"
    right = ONE_NUMBER.replace("WHAT", "place")
    if who == "a rule":
        source = right.replace("_init() -> void:", "_init() -> void:\n\tcontrol = ControlMode.BY_HAND")
        source += '\n\nfunc heuristic(into: Dictionary) -> void:\n\tinto[&"move"] = "left"\n'
        said = "heuristic() gave a String for entry 'move'"
    else:
        engine = godot.start(*world(godot, "right", right), "--", "--consac-mode=train", "--consac-steps=64", "--consac-set=n_steps:64",
                             "--consac-sessions=1", "--consac-quit=1", f"--consac-model={model}")
        assert engine.finish()[0] == 0
        source, said = ONE_NUMBER.replace("WHAT", "NAN if steps == 20 else 0.0"), "sees NaN"
    engine = godot.start(*world(godot, "faulty", source), "--", "--consac-mode=act", f"--consac-model={model}", "--consac-quit=1")
    code, output = engine.finish()
    assert code == 1 and said in output and output.count("the session failed") == 1 and "SCRIPT ERROR" not in output, output


def test_a_training_writes_to_model_path_and_nowhere_else(godot):
    """What `model` names is for acting."""
    kept = godot.project / "kept.consac"
    quick = ["--consac-mode=train", "--consac-steps=64", "--consac-set=n_steps:64", "--consac-sessions=1", "--consac-quit=1"]
    source = ONE_NUMBER.replace("WHAT", "place")
    assert godot.start(*world(godot, "keeping", source), "--", *quick, f"--consac-model={kept}").finish()[0] == 0
    before = kept.read_bytes()
    source += '\n\nfunc _ready() -> void:\n\tget_node("../ConsacSync").model = load("res://kept.consac")\n'
    code, output = godot.start(*world(godot, "keeping", source), "--", *quick, "--consac-seed=2").finish()
    assert code == 0 and "model_path is empty, so what is learned will not be saved" in output, output
    assert kept.read_bytes() == before


STOPS = """

func _process(_delta: float) -> void:
	if get_node("../ConsacSync").state() == "stopped":
		print("it has stopped")
		set_process(false)
"""
HANGS = """

func judge() -> void:
	if steps == 100:
		print("it hangs")
		while true:
			OS.delay_msec(1)
"""


TELLS = """

var _told := 0


func _ready() -> void:
	process_mode = PROCESS_MODE_ALWAYS
	get_node("../ConsacSync").progressed.connect(func(_numbers: Dictionary) -> void:
		_told += 1
		if _told == 3:
			print("told three times before a frame")
			get_tree().quit())


func _process(_delta: float) -> void:
	_told = 0
"""


def test_the_clock_is_looked_at_while_the_world_waits_for_its_learner(godot):
    """As many ticks as go before a frame wait each, and Ctrl-C is heard where lines are told."""
    engine = godot.start(*world(godot, "telling", ONE_NUMBER.replace("WHAT", "place") + TELLS), "--", "--consac-mode=train",
                         "--consac-steps=64", "--consac-set=n_steps:64,noptepochs:100000", "--consac-report=0.01",
                         "--consac-ticks-a-frame=64", "--consac-sessions=1", "--consac-quit=1")
    code, output = engine.finish()
    assert code == 0 and "told three times before a frame" in output, output


def test_ctrl_c_is_the_engines_own_once_the_sync_has_stopped(godot):
    engine = godot.start(*world(godot, "stopping", ONE_NUMBER.replace("WHAT", "place") + STOPS), "--", "--consac-mode=train",
                         "--consac-steps=64", "--consac-set=n_steps:64", "--consac-sessions=1")
    engine.wait_for("it has stopped")
    engine.process.send_signal(signal.SIGINT)
    assert engine.finish()[0] == -signal.SIGINT


def test_the_second_signal_ends_it_at_once_whichever_it_is(godot):
    engine = godot.start(*world(godot, "hanging", ONE_NUMBER.replace("WHAT", "place") + HANGS), "--", "--consac-mode=train")
    engine.wait_for("it hangs")

    def noted(number):
        status = pathlib.Path(f"/proc/{engine.process.pid}/status").read_text()
        return int(re.search(r"SigCgt:\s*(\w+)", status).group(1), 16) >> (number - 1) & 1

    assert noted(signal.SIGINT) and noted(signal.SIGTERM)
    engine.process.send_signal(signal.SIGINT)
    while noted(signal.SIGINT):
        pass
    engine.process.send_signal(signal.SIGTERM)
    assert engine.finish()[0] == -signal.SIGTERM


def test_the_native_trainer_hears_why_a_session_cannot_go_on(godot, tmp_path):
    wrong = '"text" if get_node("../ConsacSync").steps > 50 else place'
    engine = godot.start(*world(godot, "muddled", ONE_NUMBER.replace("WHAT", wrong)), "--", "--consac-port=0", "--consac-loop=1",
                         "--consac-steps=500")
    port = engine.port()
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "muddled", *PROTOCOL_2, cwd=tmp_path)
    assert "ends the session: Agent: observe() gave a String for entry 'place'" in trainer.finish()[1]
    engine.kill()


@pytest.mark.parametrize("fault, said", [
    ("pass", "observe\\(\\) gave nothing for entry 'eye', expected a PackedByteArray of 6"),
    ('into[&"eye"] = PackedByteArray([1, 2])', "observe\\(\\) gave 2 bytes for entry 'eye', expected a PackedByteArray of 6"),
], ids=["missing", "too small"])
def test_a_picture_that_goes_wrong_ends_its_training_and_not_the_engine(godot, fault, said):
    source = (NATIVE / "pictures.gd").read_text().replace(
        '\tinto[&"eye"] = pixels', f'\tif _drawn < 7:\n\t\tinto[&"eye"] = pixels\n\telse:\n\t\t{fault}')
    engine = godot.start(*world(godot, "blind", source), "--", "--consac-mode=train", "--consac-loop=1",
                         "--consac-sessions=1", "--consac-quit=1")
    engine.wait_for("consac: Agent: " + said)
    code, output = engine.finish()
    assert code == 1 and "ERROR" not in output, output


@pytest.mark.parametrize("loop", ["0", "1"])
def test_a_game_that_is_paused_tells_its_trainer(godot, tmp_path, loop):
    """So that the trainer waits longer than its deadline."""
    source = ONE_NUMBER.replace("WHAT", "place") + PAUSES
    engine = godot.start(*world(godot, "pausing", source), "--", "--consac-port=0", "--consac-steps=200",
                         f"--consac-loop={loop}")
    port = engine.port()
    trainer = godot.consac("train", f"tcp://127.0.0.1:{port}", "--name", "paused", "--no-table", "--no-progress", "--steps", "200",
                           "--deadline", "2", *PROTOCOL_2, cwd=tmp_path)
    trainer.wait_for("is paused")
    engine.wait_for("training completed: 200 steps")
    assert trainer.finish()[0] == 0


@pytest.mark.parametrize("who", ["serve", "train", "by_hand"])
def test_agents_come_and_go(godot, tmp_path, who):
    command = world(godot, "crowding", (NATIVE / "crowding.gd").read_text())
    arguments = [f"--consac-mode={who}", "--consac-room=5", "--consac-steps=3000", "--consac-sessions=1", "--consac-quit=1"]
    if who == "by_hand":
        arguments += [f"--consac-record={tmp_path}/played"]
    engine = godot.start(*command, *(["--fixed-fps", "60", "--quit-after", "200"] if who == "by_hand" else []), "--", *arguments,
                         "--consac-port=0")
    if who == "serve":
        port = engine.port()
        assert summary(train(godot, [port], tmp_path, "crowd", settings={"n_steps": "64"}))["steps"] >= 3000
    code, output = engine.finish()
    assert code == 0 and "ERROR" not in output, output
    assert "takes no part: room_for_agents is 5, and so many of the behaviour 'default' are there" in output
    if who == "by_hand":
        steps = len(tensors(f"{tmp_path}/played")["rewards"][2]) // 4
        assert steps > 600  # of about 200 ticks: several agents at nearly all times
    else:
        # The trainer counts the step in which an agent leaves, too; here each lives for 16.
        assert 2600 < int(re.search(ENDED, output).group(1)) < 3100


@pytest.mark.parametrize("way, loop", [("signal", "0"), ("judge", "0"), ("parent", "0"), ("removed", "0"), ("removed", "1")])
def test_who_leaves_as_its_episode_ends_begins_no_other(godot, tmp_path, way, loop):
    """An episode of one step and no reward was counted for each, and halved the means."""
    engine = godot.start(*world(godot, "landing", (NATIVE / "landing.gd").read_text().replace("WAY", way)), "--", "--consac-room=4",
                         "--consac-port=0", "--consac-sessions=1", "--consac-quit=1", f"--consac-loop={loop}", "--consac-steps=2000")
    assert summary(train(godot, [engine.port()], tmp_path, "landed", settings={"n_steps": "64"}))["steps"] >= 2000
    code, output = engine.finish()
    assert code == 0 and "ERROR" not in output, output
    with open(next(tmp_path.glob("**/*monitor.csv"))) as monitor:
        rows = [line.split(",") for line in monitor.read().splitlines()[2:]]
    assert len(rows) > 300 and {tuple(map(float, row[:2])) for row in rows} == {(5.0, 5.0)}


def test_an_agent_that_leaves_without_room_for_others_ends_it_with_one_line(godot):
    source = ONE_NUMBER.replace("WHAT", "place") + "\n\nfunc judge() -> void:\n\tqueue_free()\n"
    code, output = godot.start(*world(godot, "leaving", source), "--", "--consac-mode=train", "--consac-quit=1").finish()
    assert code == 1 and "an agent has left the scene; where agents come and go, set room_for_agents" in output, output


def test_a_world_that_goes_wrong_ends_its_training_and_not_the_engine(godot):
    command = world(godot, "wrong", ONE_NUMBER.replace("WHAT", "NAN if steps == 2 else 0.0"))
    engine = godot.start(*command, "--", "--consac-mode=train", "--consac-loop=1", "--consac-sessions=1", "--consac-quit=1")
    code, output = engine.finish()
    assert code == 1 and "SCRIPT ERROR" not in output and "sees NaN" in output, output
