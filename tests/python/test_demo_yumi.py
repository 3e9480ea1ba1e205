"""The robot's demo: its story in few steps, what it draws, and what it says where it finds no robot."""
import os
import pathlib
import re
import signal
import struct
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("CONSAC_BUILD_DIR", ROOT / "build/dev"))
YUMI = ROOT / "examples/robots/yumi/yumi_description/urdf/yumi_calibrated.urdf"


def demo(folder, *arguments):
    return subprocess.run([BUILD / "cli/consac", "demo", "yumi", "--steps", "300", *arguments], cwd=folder, capture_output=True, text=True)


def size_of(png):
    data = png.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


def test_tells_the_whole_story(tmp_path):
    outcome = demo(tmp_path, "--robot", YUMI)
    assert outcome.returncode == 0, outcome.stderr
    assert "23 links, 16 joints that move" in outcome.stdout
    assert re.search(r"3\. The arm reaches \d+ of 20 targets", outcome.stdout)
    assert size_of(tmp_path / "runs/yumi-twin.png") == (640, 640)
    assert size_of(tmp_path / "runs/yumi/reach.png") == (1280, 640)
    assert (tmp_path / "runs/yumi/model.consac").exists() and (tmp_path / "runs/yumi-twin/twin.glb").exists()
    first = (tmp_path / "runs/yumi/reach.png").read_bytes()
    assert demo(tmp_path, "--robot", YUMI).returncode == 0, "it writes over what it wrote"
    assert (tmp_path / "runs/yumi/reach.png").read_bytes() == first, "the same seed is the same picture"


def test_finds_the_robot_around_the_program(tmp_path):
    assert f"1. ABB's YuMi comes from {ROOT}" in demo(tmp_path).stdout


def test_says_in_one_line_what_is_missing(tmp_path):
    outcome = demo(tmp_path, "--robot", "none.urdf")
    assert outcome.returncode != 0
    assert outcome.stderr.count("\n") == 1 and "none.urdf" in outcome.stderr
    (tmp_path / "alone").mkdir()
    program = tmp_path / "alone/consac"
    program.write_bytes((BUILD / "cli/consac").read_bytes())
    program.chmod(0o755)
    outcome = subprocess.run([program, "demo", "yumi"], cwd=tmp_path, capture_output=True, text=True)
    assert outcome.returncode != 0
    assert outcome.stderr.count("\n") == 1 and "--robot" in outcome.stderr
    assert not list((tmp_path / "runs").glob("*")), "nothing but the empty folder of the runs"


def test_a_robot_that_is_no_yumi_is_refused(tmp_path):
    """Its joint has the name and does not move."""
    (tmp_path / "other.urdf").write_text('<robot name="other"><link name="a"/><link name="b"/><joint name="yumi_joint_1_r" type="fixed">'
                                         '<parent link="a"/><child link="b"/></joint></robot>')
    outcome = demo(tmp_path, "--robot", "other.urdf")
    assert outcome.returncode > 0 and outcome.stderr.count("\n") == 1, outcome
    assert "'other' has no joint 'yumi_joint_1_r' that moves, so it is no YuMi" in outcome.stderr


def test_ctrl_c_says_where_what_was_learned_is(tmp_path):
    program = subprocess.Popen([BUILD / "cli/consac", "demo", "yumi", "--steps", "100000000", "--robot", YUMI], cwd=tmp_path,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for line in program.stdout:
        if line.startswith("2."):
            break
    while not (tmp_path / "runs/yumi/progress.csv").exists():
        assert program.poll() is None
    program.send_signal(signal.SIGINT)
    _, said = program.communicate(timeout=120)
    assert program.returncode == 130 and said.splitlines()[-1] == "consac demo: interrupted; what was learned is in runs/yumi", said
