"""ConsacTwin in the running engine: reference poses of the real robot, joints and limits, rigid bodies, bad input; and the
sample yumi_reach against the built-in world."""
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys

import numpy
import pytest

from engine import CONSAC, DEADLINE_S, ROBOT, ROOT
from test_native import built, recorded, summary  # noqa: F401 (built: the extension must be there)

sys.path.insert(0, str(ROOT / "python"))
import consac  # noqa: E402

SCRIPT = pathlib.Path(__file__).parent / "twin.gd"


def checked(godot, checks, *arguments):
    """What the checks of twin.gd have said; all of them are right."""
    (godot.project / SCRIPT.name).write_text(SCRIPT.read_text())
    engine = godot.start(godot.folder / "godot", "--headless", "--fixed-fps", "60", "--path", godot.project, "--script",
                         f"res://{SCRIPT.name}", "--", checks, *arguments)
    code, output = engine.finish()
    assert code == 0 and "FAIL" not in output and "SCRIPT ERROR" not in output and "leaked" not in output, output
    assert re.search("^ok ", output, re.M), output
    return output


def frame(numbers):
    """A 4 x 4 matrix of three axes and the origin, one after the other."""
    matrix = numpy.eye(4)
    matrix[:3] = numpy.array(numbers).reshape(4, 3).T
    return matrix


def turn(quaternion):
    x, y, z, w = quaternion
    matrix = numpy.eye(4)
    matrix[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                      [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                      [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return matrix


def shift(z):
    matrix = numpy.eye(4)
    matrix[2, 3] = z
    return matrix


def angle_between(a, b):
    """rad; exact for small ones, too."""
    off = a[:3, :3].T @ b[:3, :3]
    sine = numpy.linalg.norm([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]]) / 2
    return numpy.arctan2(sine, (numpy.trace(off) - 1) / 2)


def test_the_running_engine_is_where_robotstudio_says(godot, yumi, tmp_path):
    """Ten poses of both arms: position within 0.01 mm, orientation within 0.01 degrees, in Godot's single precision."""
    reference = json.loads((ROBOT / "reference_fk.json").read_text())
    table = json.loads((yumi / "twin.json").read_text())
    back = {joint["child"]: numpy.linalg.inv(turn(joint["axis_turn"])) for joint in table["joints"]}  # to the file's frames
    poses = [{f"yumi_{joint}_{arm}": 0.0 for joint in reference["joint_order_physical"] for arm in "rl"}]
    poses += [{f"yumi_{joint}_{arm}": numpy.radians(q) for joint, q in zip(reference["joint_order_physical"], pose["q"]) for arm in "rl"}
              for pose in reference["poses"]]
    (tmp_path / "poses.json").write_text(json.dumps(poses))
    output = checked(godot, "poses", yumi, tmp_path / "poses.json")
    frames = [json.loads(line) for line in re.findall("^frames: (.*)$", output, re.M)]
    assert len(frames) == 11
    position, orientation = 0.0, 0.0
    for pose, found in zip(reference["poses"], frames[1:]):
        roll, pitch, yaw = numpy.radians(pose["rpy"])
        expected = turn([0, 0, numpy.sin(yaw / 2), numpy.cos(yaw / 2)]) @ turn([0, numpy.sin(pitch / 2), 0, numpy.cos(pitch / 2)])
        expected = expected @ turn([numpy.sin(roll / 2), 0, 0, numpy.cos(roll / 2)])
        for arm in "rl":
            base = frame(frames[0][f"yumi_link_1_{arm}"]) @ back[f"yumi_link_1_{arm}"] @ turn([0, 0, 1, 0]) @ shift(-0.206)
            flange = frame(found[f"yumi_link_7_{arm}"]) @ back[f"yumi_link_7_{arm}"] @ shift(0.007) @ turn([0, 0, 1, 0])
            seen = numpy.linalg.inv(base) @ flange
            position = max(position, numpy.linalg.norm(1000 * seen[:3, 3] - pose["position"]))
            orientation = max(orientation, numpy.degrees(angle_between(seen, expected)))
    print(f"twin: {position:.4f} mm, {orientation:.4f} degrees from RobotStudio at most")
    assert position < 0.01 and orientation < 0.01
    # And of every link, against the program's own double precision.
    most = 0.0
    for pose, found in zip(poses, frames):
        wanted = ",".join(f"{joint}={q}" for joint, q in pose.items())
        answer = subprocess.run([CONSAC, "twin", "fk", yumi, "--json", "--q", wanted], check=True, capture_output=True, text=True)
        for link in json.loads(answer.stdout):
            most = max(most, 1000 * numpy.linalg.norm(frame(found[link["link"]])[:3, 3] - link["position"]))
    print(f"twin: {most:.5f} mm from consac twin fk at most")
    assert most < 0.002


def test_joints_move_what_they_carry_within_their_limits(godot, yumi):
    checked(godot, "moves", yumi)


def test_a_scene_that_the_editor_has_imported_will_do(godot, yumi):
    """As in an exported game, where the file itself is not."""
    inside = godot.project / "twins/yumi"
    shutil.copytree(yumi, inside, ignore=shutil.ignore_patterns("meshes"))
    subprocess.run([godot.folder / "godot", "--headless", "--path", godot.project, "--import"], check=True,
                   capture_output=True, timeout=DEADLINE_S, env=godot.environment)
    (inside / "twin.glb").unlink()
    checked(godot, "moves", "res://twins/yumi")
    shutil.rmtree(inside)


def edited(yumi, folder, edit=lambda table: None, scene=lambda glb: glb):
    """A copy of the twin whose table was edited."""
    folder.mkdir()
    table = json.loads((yumi / "twin.json").read_text())
    edit(table)
    (folder / "twin.json").write_text(json.dumps(table))
    (folder / "twin.glb").write_bytes(scene((yumi / "twin.glb").read_bytes()))
    return folder


def weak(table):
    next(joint for joint in table["joints"] if joint["name"] == "yumi_joint_2_r")["effort"] = 60.0


def test_motors_reach_their_targets_and_limits_hold(godot, yumi, tmp_path):
    checked(godot, "dynamic", edited(yumi, tmp_path / "weak", weak))


def without_masses(table):
    for link in table["links"]:
        link.pop("mass", None)


def test_a_robot_without_masses_is_no_body_unless_the_user_gives_one(godot, yumi, tmp_path):
    checked(godot, "massless", edited(yumi, tmp_path / "light", without_masses))


def renamed(glb):
    """Another name of the same length for a node."""
    return glb.replace(b'"yumi_joint_5_l"', b'"yumi_joint_X_l"')


REFUSED = {
    "version": (lambda table: table.update(version=2), None, "its version is 2.0, and this add-on reads 1; import the robot again"),
    "format": (lambda table: table.update(format="urdf"), None, 'it is no joint table: its format is not "consac-twin"'),
    "joints": (lambda table: table.pop("joints"), None, "it has no list 'joints'"),
    "type": (lambda table: table["joints"][3].update(type="ball"), None, "is of type 'ball'; there are fixed, revolute"),
    "limits": (lambda table: table["joints"][3].update(lower=9), None, "has its lower limit 9.000000 above its upper one"),
    "number": (lambda table: table["joints"][3]["rest"]["gltf"].update(translation=[0, "1", 2]), None, "has no 3 numbers of 'translation'"),
    "turn": (lambda table: table["joints"][3]["rest"]["gltf"].update(rotation=[0, 0, 0, 2]), None, "has a rotation of length 2.0"),
    "order": (lambda table: table["joints"].reverse(), None, "does not carry link 1 from one before it"),
    "mimic": (lambda table: table["joints"][11].update(mimic={"joint": "thumb"}), None, "follows 'thumb', which is no joint"),
    "place": (lambda table: table["joints"][3]["rest"]["gltf"].update(translation=[0, 1, 2]), None,
              "node 'yumi_joint_2_r_frame' is not where twin.json has it; import both again"),
    "node": (lambda table: None, renamed, "it has no node 'yumi_joint_5_l', which twin.json names; import both again"),
    "cut": (lambda table: None, lambda glb: glb[:1000], "it is no glTF that this engine can read"),
}


def test_bad_input_is_one_line(godot, yumi, tmp_path):
    folders = [edited(yumi, tmp_path / name, edit, scene or (lambda glb: glb)) for name, (edit, scene, _) in REFUSED.items()]
    (tmp_path / "text").mkdir()
    (tmp_path / "text/twin.json").write_text('{"format": "consac-twin",\n')
    (tmp_path / "half").mkdir()
    shutil.copy(yumi / "twin.json", tmp_path / "half")
    output = checked(godot, "refused", *folders, tmp_path / "none", tmp_path / "text", tmp_path / "half")
    expected = {name: text for name, (_, _, text) in REFUSED.items()}
    expected |= {"none": "there is no file '", "text": "it is no JSON (line ", "half": "twin.glb: there is no such file; make it with: consac twin import"}
    for name, text in expected.items():
        said = re.search(f"^{name}: (.*)$", output, re.M).group(1)
        assert text in said and f"{tmp_path / name}/twin." in said, said


def test_the_robot_of_the_extension_moves_its_tool(godot, yumi):
    checked(godot, "robot", yumi)


def test_the_sample_sees_and_earns_what_the_built_in_world_does(godot, yumi, tmp_path):
    """50 steps of yumi-reach-v0 in process, and the same goal and actions in the engine: the same rewards, and observations
    within 1e-5 (m, m/s, rad, rad/s; Godot holds the tool's point as float32)."""
    server = godot.start(CONSAC, "serve", "yumi-reach-v0", "--port", "0", "--protocol", "2", "--sessions", "1")
    address = server.wait_for(r"tcp://\S+").group(0)
    actions = numpy.random.default_rng(1).uniform(-1, 1, (50, 3)).astype(numpy.float32)
    actions[20:] = [0.3, 0.9, 1.0]  # as far as limits and speeds let it
    rows, rewards = [], []
    with consac.make(address) as env:
        seen, _ = env.reset(seed=3)
        goal = numpy.array(seen["desired_goal"], numpy.float64)
        for i in range(50):
            if i < 12:  # to the goal, so that both rewards are there
                actions[i] = numpy.clip((goal - seen["achieved_goal"]) / 0.05, -1, 1)
            rows.append(seen)
            seen, reward, *_ = env.step(actions[i])
            rewards.append(reward)
    assert {0.0, -1.0} == set(rewards)
    (tmp_path / "actions.json").write_text(json.dumps({"goal": goal.tolist(), "actions": actions.tolist()}))
    output = checked(godot, "reach", yumi, tmp_path / "actions.json")
    found = re.findall(r"^row: (\w+) (\S+)$", output, re.M)
    assert len(found) == 51 and [float(reward) for _, reward in found[1:]] == rewards
    most = 0.0
    for row, (in_engine, _) in zip(rows, found):
        expected = numpy.concatenate([row[part] for part in ("achieved_goal", "desired_goal", "observation")])
        most = max(most, numpy.abs(numpy.frombuffer(bytes.fromhex(in_engine), numpy.float32) - expected).max())
    print(f"twin: observations are {most:.1e} apart at most")
    assert most < 1e-5


def test_a_model_of_the_built_in_world_reaches_in_the_engine(godot, yumi, tmp_path):
    """Of 100 targets as many as in process, within one."""
    trained = godot.consac("train", "yumi-reach-v0", "--algo", "sac", "--steps", "8000", "--seed", "1", "--name", "reach", "--json",
                           "--no-table", "--no-progress", "--set", "replay_buffer_class=HerReplayBuffer", "gamma=0.95", "learning_rate=1e-3",
                           "batch_size=256", "learning_starts=1000", "buffer_size=100000", "net_arch=[64,64]", "norm_obs=true", cwd=tmp_path)
    assert summary(trained)["steps"] == 8000
    inside = godot.project / "examples/yumi_reach/yumi"
    shutil.copytree(yumi, inside, ignore=shutil.ignore_patterns("meshes"), dirs_exist_ok=True)
    acted = recorded(godot, "yumi_reach", tmp_path / "acted", "mode=act", f"model={tmp_path}/runs/reach/model.consac", "steps=5000",
                     "sessions=1", "quit=1", "fast=1", flags=["--fixed-fps", "60"])
    rewards = numpy.array(struct.unpack(f"<{acted['rewards'][1][0]}f", acted["rewards"][2])).reshape(-1, 50)
    assert len(rewards) == 100
    in_process = summary(godot.consac("eval", "reach", "--episodes", "100", "--json", cwd=tmp_path))["mean_reward"]
    reached = int((rewards[:, -1] == 0).sum())
    print(f"twin: {reached} of 100 targets reached in Godot, mean return {rewards.sum(1).mean():.2f}; in process {in_process:.2f}")
    assert reached >= 99 and abs(rewards.sum(1).mean() - in_process) < 0.5
    shutil.rmtree(inside)
