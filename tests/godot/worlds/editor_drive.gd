@tool
extends EditorPlugin
## Uses the editor as a person would: opens a scene, looks at the sync's warnings, starts and stops a training with the
## dock, opens help and a model; saves a picture of each and prints what it saw. Run by test_editor.py in the editor itself.

const FOLDER := ""  # of the pictures

var _dock: Control


func _ready() -> void:
	await _until(func() -> bool: return not EditorInterface.get_resource_filesystem().is_scanning())
	EditorInterface.get_editor_settings().set_setting("run/window_placement/game_embed_mode", -1)
	var base := EditorInterface.get_base_control()
	await _until(func() -> bool: return base.find_child("CONSAC", true, false) != null)
	await _wait(1.0)  # windows of its own beginning are gone
	_dock = base.find_child("CONSAC", true, false)
	var tab: Control = _dock
	while not tab.get_parent() is TabContainer:
		tab = tab.get_parent()
	tab.get_parent().current_tab = tab.get_index()
	var sync := (await _open("res://warned.tscn")).get_node("ConsacSync")
	for warning in sync._get_configuration_warnings():
		print("drive: warning: ", warning)
	for twin: ConsacTwin in [sync.get_node("../Twin"), sync.get_node("../Lost")]:
		print("drive: ", twin.name, ": ", twin.joint_names().size(), " joints, ", twin._get_configuration_warnings())
	sync.mode = ConsacSync.Mode.BY_HAND
	var of_loop := Array(sync._get_configuration_warnings()).filter(func(text: String) -> bool: return text.contains("loop_mode"))
	print("drive: by hand of loop_mode: ", of_loop.size())
	sync = (await _open("res://examples/road/road.tscn")).get_node("ConsacSync")
	print("drive: warnings of the road: ", sync._get_configuration_warnings())
	_dock._model.text = "res://docked.consac"
	_dock._steps.value = 1e9
	_dock._start.pressed.emit()
	await _until(func() -> bool: return _dock._curves.has("mean_episode_reward") and _dock._curve.count() >= 6)
	await _picture("dock")
	print("drive: points of the curve: ", _dock._curve.count(), ", curves: ", _dock._curves.keys())
	_dock._stop.pressed.emit()
	await _until(func() -> bool: return not EditorInterface.is_playing_scene())
	print("drive: playing after stop: ", EditorInterface.is_playing_scene())
	var saved := FileAccess.file_exists("res://docked.stopped.consac")
	print("drive: saved: ", saved)
	if saved:
		var model: Resource = load("res://docked.stopped.consac")
		print("drive: model: ", model.get_script().get_global_name(), " ", model.observes.replace("\n", "; "), " -> ", model.does)
		EditorInterface.edit_resource(model)
		EditorInterface.get_file_system_dock().navigate_to_path("res://docked.stopped.consac")
		await _wait(1.0)
		await _picture("model")
	# A number of the game's own that is told now and then.
	for numbers: Dictionary in [{steps = 10, steps_per_s = 1.0, hit = 0.5}, {steps = 20, steps_per_s = 1.0}]:
		_dock._hear("progress", [numbers, 100])
	_dock._shown.select(range(_dock._shown.item_count).filter(
			func(i: int) -> bool: return _dock._shown.get_item_metadata(i) == "hit")[0])
	_dock._show_curve()
	print("drive: caption: ", _dock._curve.caption())
	await _open("res://quits.tscn")
	_dock._start.pressed.emit()
	await _until(func() -> bool: return _dock._stop.disabled)
	print("drive: no game: ", _dock._state.text)
	EditorInterface.set_main_screen_editor("Script")
	EditorInterface.get_script_editor().goto_help("class_method:ConsacWorld:poll")
	await _wait(1.5)
	await _picture("help")
	EditorInterface.get_script_editor().goto_help("class_name:ConsacAgent")
	await _wait(1.0)
	await _picture("help_agent")
	get_tree().quit()


# Opens a scene and returns its root, which is in the tree and ready until the next `await`. The editor opens the project's
# main scene by itself, some time after it has begun: it is asked again then.
func _open(scene: String) -> Node:
	while true:
		EditorInterface.open_scene_from_path(scene)
		await _wait(0.1)
		var root := EditorInterface.get_edited_scene_root()
		if root != null and root.scene_file_path == scene:
			return root
	return null


# Waits for what must come: without an end, which the test has.
func _until(holds: Callable) -> void:
	while not holds.call():
		await _wait(0.1)


func _wait(seconds: float) -> void:
	await get_tree().create_timer(seconds).timeout


func _picture(what: String) -> void:
	RenderingServer.force_draw()  # the editor itself draws only where something has changed
	EditorInterface.get_base_control().get_viewport().get_texture().get_image().save_png(FOLDER + "/" + what + ".png")
	print("drive: picture ", what)
