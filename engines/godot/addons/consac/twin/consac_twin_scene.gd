@tool
class_name ConsacTwinScene
extends RefCounted
## The nodes of a [code]twin.glb[/code], found by what the joint table calls them. [ConsacTwin] hangs them below itself.

const FARTHEST := 1e-4  ## m, and of an axis: what a frame of the scene may be off that of the table

## The scene; null where there is a [member fault].
var root: Node
## The node of each link of the table.
var links: Array[Node3D] = []
## What was wrong, in one sentence; "" nothing.
var fault := ""


## The scene of [param path], which goes with [param table].
static func of_file(path: String, table: ConsacTwinTable) -> ConsacTwinScene:
	var scene := ConsacTwinScene.new()
	scene.root = scene._load(path)
	if scene.root != null:
		scene._find(table)
	if not scene.fault.is_empty():
		scene.fault = "%s: %s" % [path, scene.fault]
		if scene.root != null:
			scene.root.free()
			scene.root = null
	return scene


# The file itself where it is there; in an exported game the scene that the editor has made of it.
func _load(path: String) -> Node:
	if FileAccess.file_exists(path):
		var state := GLTFState.new()
		var document := GLTFDocument.new()
		var error := document.append_from_file(path, state)
		var made: Node = document.generate_scene(state) if error == OK else null
		if made == null:
			fault = "it is no glTF that this engine can read (%s)" % error_string(error)
		return made
	if path.begins_with("res://") and ResourceLoader.exists(path, "PackedScene"):
		return (load(path) as PackedScene).instantiate()
	fault = "there is no such file; make it with: consac twin import ROBOT.urdf -o FOLDER"
	return null


func _find(table: ConsacTwinTable) -> void:
	var base := _node(root, table.links[0].name, true)
	links.append(base)
	for joint in table.joints:
		var parent: Node3D = links[joint.parent]
		var frame := _node(parent, joint.frame_node, false) if parent != null else null
		var moving := _node(frame, joint.node, false) if frame != null else null
		if not fault.is_empty():
			return
		var off := frame.transform.origin - joint.rest.origin
		for axis in 3:
			if off.length() > FARTHEST or (frame.transform.basis[axis] - joint.rest.basis[axis]).length() > FARTHEST:
				fault = "node '%s' is not where twin.json has it; import both again" % joint.frame_node
				return
		links.append(moving)


# The node that a glTF calls so; the engine's own names of nodes have no dots, colons or slashes.
func _node(above: Node, name: String, deep: bool) -> Node3D:
	var wanted := name.validate_node_name()
	if deep and above.name == wanted:
		return above as Node3D
	var found := above.find_child(wanted, deep, false) as Node3D
	if found == null and fault.is_empty():
		fault = "it has no node '%s', which twin.json names; import both again" % name
	return found
