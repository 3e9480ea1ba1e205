@tool
extends EditorPlugin
## Uses the editor as a person would: opens a scene, looks at the sync's warnings, starts and stops a training with the
## dock, opens help and a model; saves a picture of each and prints what it saw. Run by test_editor.py in the editor itself.

const FOLDER := ""  # of the pictures

var _dock: Control


func _ready() -> void:
	while EditorInterface.get_resource_filesystem().is_scanning():
		await _wait(0.2)
	EditorInterface.get_editor_settings().set_setting("run/window_placement/game_embed_mode", -1)
	await _wait(1.0)
	_dock = EditorInterface.get_base_control().find_child("CONSAC", true, false)
	var tab: Control = _dock
	while not tab.get_parent() is TabContainer:
		tab = tab.get_parent()
	tab.get_parent().current_tab = tab.get_index()
	EditorInterface.open_scene_from_path("res://warned.tscn")
	await _wait(1.5)
	var sync := EditorInterface.get_edited_scene_root().get_node("ConsacSync")
	for warning in sync._get_configuration_warnings():
		print("drive: warning: ", warning)
	EditorInterface.open_scene_from_path("res://examples/road/road.tscn")
	await _wait(1.0)
	print("drive: warnings of the road: ", EditorInterface.get_edited_scene_root().get_node("ConsacSync")._get_configuration_warnings())
	_dock._model.text = "res://docked.consac"
	_dock._steps.value = 1e9
	_dock._start.pressed.emit()
	for i in 240:
		await _wait(0.25)
		if _dock._curve.count() >= 6:
			break
	await _picture("dock")
	print("drive: points of the curve: ", _dock._curve.count(), ", curves: ", _dock._curves.keys())
	_dock._stop.pressed.emit()
	for i in 120:
		await _wait(0.25)
		if not EditorInterface.is_playing_scene():
			break
	print("drive: playing after stop: ", EditorInterface.is_playing_scene())
	await _wait(1.0)
	var saved := FileAccess.file_exists("res://docked.stopped.consac")
	print("drive: saved: ", saved)
	if saved:
		var model: Resource = load("res://docked.stopped.consac")
		print("drive: model: ", model.get_script().get_global_name(), " ", model.observes.replace("\n", "; "), " -> ", model.does)
		EditorInterface.edit_resource(model)
		EditorInterface.get_file_system_dock().navigate_to_path("res://docked.stopped.consac")
		await _wait(1.0)
		await _picture("model")
	EditorInterface.set_main_screen_editor("Script")
	EditorInterface.get_script_editor().goto_help("class_method:ConsacWorld:poll")
	await _wait(1.5)
	await _picture("help")
	EditorInterface.get_script_editor().goto_help("class_name:ConsacAgent")
	await _wait(1.0)
	await _picture("help_agent")
	get_tree().quit()


func _wait(seconds: float) -> void:
	await get_tree().create_timer(seconds).timeout


func _picture(what: String) -> void:
	RenderingServer.force_draw()  # the editor itself draws only where something has changed
	EditorInterface.get_base_control().get_viewport().get_texture().get_image().save_png(FOLDER + "/" + what + ".png")
	print("drive: picture ", what)
