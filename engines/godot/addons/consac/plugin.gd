@tool
extends EditorPlugin
## The editor's side of the add-on. The nodes are global classes and need no registration; this adds
## one entry to the menu Project > Tools.

const COPY_COMMAND := "CONSAC: copy the command that trains this scene"


func _enter_tree() -> void:
	add_tool_menu_item(COPY_COMMAND, _copy_command)


func _exit_tree() -> void:
	remove_tool_menu_item(COPY_COMMAND)


func _copy_command() -> void:
	var root := get_editor_interface().get_edited_scene_root()
	var found: Array[Node] = [] if root == null else root.find_children("*", "ConsacSync", true, false)
	if found.is_empty():
		printerr("consac: the edited scene has no ConsacSync node; add one, then copy its command")
		return
	var sync: ConsacSync = found[0]
	var command := "consac train tcp://127.0.0.1:%d --name %s" % [sync.port, root.name.to_snake_case()]
	DisplayServer.clipboard_set(command)
	print("consac: copied: ", command)
