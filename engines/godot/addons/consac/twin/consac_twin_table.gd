@tool
class_name ConsacTwinTable
extends RefCounted
## The joint table of a robot, read from [code]twin.json[/code] (format 1 of docs/twin.md), with poses as the engine
## writes them. [ConsacTwin] stands on it.

## The number of the format that is read.
const VERSION := 1
const TYPES: Array[StringName] = [&"fixed", &"revolute", &"continuous", &"prismatic"]


## A link, and where its mass is.
class Link:
	var name := ""
	var index := 0  ## among the links
	var joint: Joint  ## that moves it; null for the first link
	var mass := 0.0  ## kg; 0 where the file says none
	var centre := Vector3.ZERO  ## of mass, in the link's frame, m
	var inertia := Basis()  ## about that centre, kg m^2
	var capsules: Array[Capsule] = []


## A joint, and what may move it.
class Joint:
	var name := ""
	var type := &"fixed"
	var number := 0  ## among the joints; it moves the link after this number
	var parent := 0  ## the link that carries it, a number
	var frame_node := ""  ## in the scene: stands still
	var node := ""  ## and moves in it
	var rest := Transform3D()  ## in the parent link's frame, at position 0
	var lower := -INF  ## rad or m
	var upper := INF
	var velocity := INF  ## rad/s or m/s
	var effort := INF  ## N m or N
	var leader: Joint  ## whose position it takes; null where it moves by itself
	var multiplier := 1.0
	var offset := 0.0
	var index := -1  ## of its own position among those of a pose; -1: fixed, or follows another

	func moves() -> bool:
		return type != &"fixed"


## A ball swept along a line.
class Capsule:
	var from := Vector3.ZERO  ## in the link's frame, m
	var to := Vector3.ZERO
	var radius := 0.0


## What the robot is called.
var robot_name := ""
## The first one stands still.
var links: Array[Link] = []
## Joint j moves link j + 1, and stands after its parent's.
var joints: Array[Joint] = []
## Those that move by themselves, in the order of a pose.
var leaders: Array[Joint] = []
## Links that carry no others.
var end_effectors := PackedStringArray()
## Pairs of names of links that may touch.
var allowed_collisions: Array[PackedStringArray] = []
## What was wrong with the file, in one sentence; "" nothing.
var fault := ""

var _joints_by_name := {}
var _links_by_name := {}


## The table of [param path]; look at its [member fault].
static func of_file(path: String) -> ConsacTwinTable:
	var table := ConsacTwinTable.new()
	if not FileAccess.file_exists(path):
		table.fault = "there is no file '%s'; make it with: consac twin import ROBOT.urdf -o FOLDER" % path
		return table
	table._read(FileAccess.get_file_as_string(path))
	if not table.fault.is_empty():
		table.fault = "%s: %s" % [path, table.fault]
	return table


## The joint of that name; null where there is none.
func joint(name: String) -> Joint:
	return _joints_by_name.get(name)


## The link of that name; null where there is none.
func link(name: String) -> Link:
	return _links_by_name.get(name)


func _read(text: String) -> void:
	var json := JSON.new()
	if json.parse(text) != OK:
		fault = "it is no JSON (line %d: %s)" % [json.get_error_line(), json.get_error_message()]
		return
	if not (json.data is Dictionary and json.data.get("format") is String and json.data["format"] == "consac-twin"):
		fault = "it is no joint table: its format is not \"consac-twin\""
		return
	var data: Dictionary = json.data
	if not (data.get("version") is float and data["version"] == VERSION):
		fault = "its version is %s, and this add-on reads %d; import the robot again" % [data.get("version"), VERSION]
		return
	robot_name = str(data.get("name", ""))
	for row: Variant in _list(data, "links"):
		_read_link(row)
	for row: Variant in _list(data, "joints"):
		_read_joint(row)
	if fault.is_empty():
		_connect(data)


func _read_link(row: Variant) -> void:
	if not (row is Dictionary and row.get("name") is String and not _links_by_name.has(row["name"])):
		_refuse("link %d has no name, or another's" % links.size())
		return
	var made := Link.new()
	made.name = row["name"]
	made.index = links.size()
	if row.get("mass") is float:
		made.mass = row["mass"]
		var inertia := _numbers(row, "inertia", 6, "link", made.name)
		var centre := _numbers(row, "centre_of_mass", 3, "link", made.name)
		if not fault.is_empty():
			return
		made.inertia = ConsacTwinConvention.inertia(inertia)
		made.centre = ConsacTwinConvention.point(_vector(centre))
	links.append(made)
	_links_by_name[made.name] = made


func _read_joint(row: Variant) -> void:
	if not (row is Dictionary and row.get("name") is String and not _joints_by_name.has(row["name"])):
		_refuse("joint %d has no name, or another's" % joints.size())
		return
	var made := Joint.new()
	made.name = row["name"]
	made.type = StringName(str(row.get("type", "")))
	made.number = joints.size()
	var parent := link(str(row.get("parent", "")))
	var child := link(str(row.get("child", "")))
	made.frame_node = str(row.get("frame_node", ""))
	made.node = str(row.get("node", ""))
	if made.type not in TYPES:
		_refuse("joint '%s' is of type '%s'; there are %s" % [made.name, made.type, ", ".join(TYPES)])
	elif parent == null or child == null or child.index != made.number + 1 or parent.index > made.number:
		_refuse("joint '%s' does not carry link %d from one before it" % [made.name, made.number + 1])
	else:
		made.parent = parent.index
		_read_motion(row, made)
	if fault.is_empty():
		child.joint = made
		joints.append(made)
		_joints_by_name[made.name] = made


func _read_motion(row: Dictionary, made: Joint) -> void:
	var rests: Variant = row.get("rest")
	var rest: Variant = rests.get("gltf") if rests is Dictionary else null
	if not rest is Dictionary:
		_refuse("joint '%s' has no rest.gltf" % made.name)
		return
	var translation := _numbers(rest, "translation", 3, "joint", made.name)
	var turn := _numbers(rest, "rotation", 4, "joint", made.name)
	if not fault.is_empty():
		return
	var rotation := Quaternion(turn[0], turn[1], turn[2], turn[3])
	if absf(rotation.length() - 1.0) > 1e-3:
		_refuse("joint '%s' has a rotation of length %f, expected 1" % [made.name, rotation.length()])
		return
	made.rest = Transform3D(Basis(rotation.normalized()), _vector(translation))
	for limit: String in ["lower", "upper", "velocity", "effort"]:
		if row.get(limit) is float:
			made.set(limit, row[limit])
	if made.lower > made.upper:
		_refuse("joint '%s' has its lower limit %f above its upper one, %f" % [made.name, made.lower, made.upper])


# Who follows whom, and what else names links.
func _connect(data: Dictionary) -> void:
	if links.size() != joints.size() + 1:
		_refuse("it has %d links and %d joints; a joint is missing" % [links.size(), joints.size()])
		return
	var rows: Array = data["joints"]
	for i in joints.size():
		var mimic: Variant = rows[i].get("mimic")
		if mimic is Dictionary:
			joints[i].leader = joint(str(mimic.get("joint", "")))
			joints[i].multiplier = mimic.get("multiplier", 1.0)
			joints[i].offset = mimic.get("offset", 0.0)
			if joints[i].leader == null:
				_refuse("joint '%s' follows '%s', which is no joint" % [joints[i].name, mimic.get("joint")])
				return
		elif joints[i].moves():
			joints[i].index = leaders.size()
			leaders.append(joints[i])
	for follower in joints:
		if follower.leader != null and follower.leader.index < 0:
			_refuse("joint '%s' follows '%s', which does not move by itself" % [follower.name, follower.leader.name])
	for name: Variant in _list(data, "end_effectors"):
		end_effectors.append(str(name))
	for pair: Variant in _list(data, "allowed_collisions"):
		if pair is Array and pair.size() == 2:
			allowed_collisions.append(PackedStringArray([str(pair[0]), str(pair[1])]))
	for row: Variant in _list(data, "capsules"):
		_read_capsule(row)


func _read_capsule(row: Variant) -> void:
	var of := link(str(row.get("link", ""))) if row is Dictionary else null
	if of == null or not row.get("radius") is float:
		_refuse("a capsule has no link or no radius")
		return
	var made := Capsule.new()
	made.radius = row["radius"]
	var ends := [_numbers(row, "from", 3, "capsule", of.name), _numbers(row, "to", 3, "capsule", of.name)]
	if fault.is_empty():
		made.from = ConsacTwinConvention.point(_vector(ends[0]))
		made.to = ConsacTwinConvention.point(_vector(ends[1]))
		of.capsules.append(made)


func _list(data: Dictionary, member: String) -> Array:
	if data.get(member) is Array:
		return data[member]
	_refuse("it has no list '%s'" % member)
	return []


func _numbers(row: Dictionary, member: String, count: int, what: String, name: String) -> PackedFloat64Array:
	var found := PackedFloat64Array()
	var list: Variant = row.get(member)
	for number: Variant in (list if list is Array else []):
		if number is float and is_finite(number):
			found.append(number)
	if found.size() != count or (list as Array).size() != count:
		_refuse("%s '%s' has no %d numbers of '%s'" % [what, name, count, member])
		found.resize(count)
	return found


func _refuse(what: String) -> void:
	if fault.is_empty():
		fault = what


static func _vector(numbers: PackedFloat64Array) -> Vector3:
	return Vector3(numbers[0], numbers[1], numbers[2])
