@tool
extends EditorPlugin
## The editor's side of the add-on: the dock, and one entry of the menu Project > Tools. The nodes and resources are global
## classes and need no registration.

const COPY_COMMAND := "CONSAC: copy the command that trains this scene"
const Dock := preload("res://addons/consac/editor/dock.gd")
const Debugger := preload("res://addons/consac/editor/debugger.gd")

var _debugger := Debugger.new()
var _dock := Dock.new()


func _enter_tree() -> void:
	add_tool_menu_item(COPY_COMMAND, _copy_command)
	add_debugger_plugin(_debugger)
	_dock.set_up(_debugger)
	add_control_to_dock(DOCK_SLOT_RIGHT_BL, _dock)


func _exit_tree() -> void:
	remove_tool_menu_item(COPY_COMMAND)
	remove_debugger_plugin(_debugger)
	remove_control_from_docks(_dock)
	_dock.queue_free()


func _run_scene(_scene: String, args: PackedStringArray) -> PackedStringArray:
	var own := _dock.take_arguments()
	if own.is_empty():
		return args
	if not args.has("--"):
		args.append("--")
	args.append_array(own)
	return args


func _copy_command() -> void:
	var root := EditorInterface.get_edited_scene_root()
	var found: Array[Node] = []
	if root != null:
		found = ConsacSceneCheck.nodes_of_class(root, &"ConsacSync")
	if found.is_empty():
		printerr("consac: the edited scene has no ConsacSync node; add one, then copy its command")
		return
	var sync: ConsacSync = found[0]
	var command := "consac train tcp://127.0.0.1:%d --name %s" % [sync.port, root.name.to_snake_case()]
	DisplayServer.clipboard_set(command)
	print("consac: copied: ", command)
