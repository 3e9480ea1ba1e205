"""The editor's side of the add-on, in the running editor under Xvfb: dock, live curve, warnings, help, models as resources.
Its pictures lie in the test's folder, for people."""
import re

import pytest

from test_native import built  # noqa: F401 (the extension must be there)
from test_traps import DRAWS, WORLDS

# An agent without entries, two syncs, two parameters of one name, a sensor without its node, a body in loop mode, a twin and one without its files.
WARNED = """[gd_scene format=3]
[ext_resource type="Script" path="res://addons/consac/consac_sync.gd" id="1"]
[ext_resource type="Script" path="res://addons/consac/consac_agent.gd" id="2"]
[ext_resource type="Script" path="res://addons/consac/sensors/ray_sensor_2d.gd" id="3"]
[ext_resource type="Script" path="res://addons/consac/twin/consac_twin.gd" id="4"]
[ext_resource type="Script" path="res://addons/consac/consac_parameter.gd" id="5"]
[sub_resource type="Resource" id="1"]
script = ExtResource("5")
name = &"wind"
[sub_resource type="Resource" id="2"]
script = ExtResource("5")
name = &"wind"
[node name="World" type="Node2D"]
[node name="Body" type="RigidBody2D" parent="."]
[node name="ConsacSync" type="Node" parent="."]
script = ExtResource("1")
loop_mode = true
parameters = [SubResource("1"), SubResource("2")]
[node name="Second" type="Node" parent="."]
script = ExtResource("1")
[node name="Agent" type="Node" parent="."]
script = ExtResource("2")
[node name="Rays" type="Node" parent="Agent"]
script = ExtResource("3")
[node name="Twin" type="Node3D" parent="."]
script = ExtResource("4")
folder = "YUMI"
[node name="Lost" type="Node3D" parent="."]
script = ExtResource("4")
"""

# A game that ends before its sync begins.
QUITS = """[gd_scene format=3]
[ext_resource type="Script" path="res://quits.gd" id="1"]
[ext_resource type="Script" path="res://addons/consac/consac_sync.gd" id="2"]
[node name="World" type="Node2D"]
script = ExtResource("1")
[node name="ConsacSync" type="Node" parent="."]
script = ExtResource("2")
"""


@pytest.fixture
def editor(godot, display, yumi, tmp_path):
    plugin = godot.project / "addons/drive"
    plugin.mkdir(exist_ok=True)
    (plugin / "plugin.cfg").write_text('[plugin]\nname="Drive"\ndescription="Drive"\nauthor="-"\nversion="1"\nscript="plugin.gd"\n')
    source = (WORLDS / "editor_drive.gd").read_text().replace('const FOLDER := ""', f'const FOLDER := "{tmp_path}"')
    (plugin / "plugin.gd").write_text(source)
    (godot.project / "warned.tscn").write_text(WARNED.replace("YUMI", str(yumi)))
    (godot.project / "quits.gd").write_text("extends Node2D\nfunc _ready() -> void:\n\tOS.kill(OS.get_process_id())\n")
    (godot.project / "quits.tscn").write_text(QUITS)
    settings = godot.project / "project.godot"
    before = settings.read_text()
    settings.write_text(before.replace('cfg")', 'cfg", "res://addons/drive/plugin.cfg")'))
    scene = godot.project / "examples/road/road.tscn"
    opened = scene.read_bytes()
    # In one window: an X server's window that is gone again before the editor has asked for it may crash it.
    yield godot.start(godot.folder / "godot", "--path", godot.project, "--editor", *DRAWS, "--single-window", "--resolution", "1600x900")
    settings.write_text(before)
    scene.write_bytes(opened)  # the dock saves what it starts


def test_the_editor_as_a_person_uses_it(editor, tmp_path):
    code, output = editor.finish()
    assert code == 0 and not re.search(r"(SCRIPT ERROR|res://addons/consac.*(ERROR|Error))", output), output
    for warning in ("The scene has several ConsacSync nodes", "Agent: it has no actions; add a ConsacEntry for each.",
                    "Agent/Rays: body is empty", "Two parameters are named 'wind'.", "loop_mode stops the engine's physics, and Body is a RigidBody2D"):
        assert f"drive: warning: {warning}" in output, output
    assert "drive: Twin: 16 joints, []" in output, output
    assert 'drive: Lost: 0 joints, ["folder is empty; set it to what consac twin import has made."]' in output, output
    assert "drive: warnings of the road: []" in output and "drive: by hand of loop_mode: 0" in output, output
    assert int(re.search(r"points of the curve: (\d+)", output).group(1)) >= 6 and '"mean_episode_reward"' in output, output
    assert "drive: caption: 20 steps, nothing new since 0.5 at 10" in output, output
    assert "drive: no game: The game ended before its ConsacSync began" in output, output
    assert "drive: playing after stop: false" in output and "drive: saved: true" in output, output
    assert "drive: model: ConsacModelFile actor: box [1]; coin: box [1] -> (one without a name): discrete 3 choices" in output, output
    for picture in ("dock", "model", "help", "help_agent"):
        assert (tmp_path / f"{picture}.png").stat().st_size > 10000
