@tool
@icon("res://addons/consac/icon.svg")
class_name ConsacTwin
extends Node3D
## A robot that [code]consac twin import[/code] has made: its parts, hung under each other so that a joint carries all
## that follows.
##
## Built of [code]twin.glb[/code] and [code]twin.json[/code] in [member folder], in the editor and in the running game;
## no native extension is needed. Positions are rad, of joints that slide m, in the order and by the names of
## [method joint_names]. What can go wrong is one line in the log, which the method returns; "" where it went well.

## It has been built anew from [member folder].
signal built

## How joints move.
enum Motion {
	KINEMATIC,  ## at once to where they are set: nothing has mass
	DYNAMIC,  ## by motors with the limits of the table, as rigid bodies; Jolt Physics
}

## Where [code]twin.glb[/code] and [code]twin.json[/code] are: res://, user:// or a folder of the system.
@export_dir var folder: String = "":
	set(value):
		folder = value
		_changed()
## How joints move. Dynamic bodies are built in the running game alone.
@export var motion: Motion = Motion.KINEMATIC:
	set(value):
		motion = value
		_changed()
@export_group("End effector")
## The link that carries the tool; "" for the first of the table's end effectors.
@export var tool_link: String = "":
	set(value):
		tool_link = value
		update_configuration_warnings()
## The tool's point in that link's frame, m, along the node's own axes.
@export var tool_point: Vector3 = Vector3.ZERO
@export_group("Dynamic")
## Mass of bodies of which the table says none, kg; 0: none is made up, and such a robot is not built.
@export_range(0.0, 1000.0, 0.001, "or_greater", "suffix:kg") var missing_mass: float = 0.0:
	set(value):
		missing_mass = value
		_changed()
## How fast a motor makes up for what is missing: of the way that is left, this part a second.
@export_range(0.1, 50.0, 0.1, "suffix:1/s") var stiffness: float = 15.0
## Inertia that a geared motor's rotor adds to what it turns. The engine's solver wants some 0.1 kg m² for an arm of
## seven joints; with 30 of [code]physics/jolt_physics_3d/simulation/velocity_steps[/code], or 240 ticks a second, 0.01.
@export_range(0.0, 10.0, 0.001, "or_greater", "suffix:kg m²") var armature: float = 0.1
## The capsules of its own links collide, too. They are rough and from outside: see docs/twin.md.
@export var self_collision: bool = false
@export_flags_3d_physics var collision_layer: int = 1
@export_flags_3d_physics var collision_mask: int = 1

## The joint table; null where there is none.
var table: ConsacTwinTable

var _scene: Node
var _links: Array[Node3D] = []  # of each link of the table
var _positions := PackedFloat64Array()  # of the table's leaders; in DYNAMIC what the motors are after
var _lower := PackedFloat64Array()
var _upper := PackedFloat64Array()
var _bodies: ConsacTwinBodies
var _fault := ""
var _stale := false  # something has changed since it was built


func _ready() -> void:
	_build()


func _get_configuration_warnings() -> PackedStringArray:
	var found := PackedStringArray()
	if not _fault.is_empty():
		found.append(_fault)
	elif table != null and not tool_link.is_empty() and table.link(tool_link) == null:
		found.append(_no_link(tool_link))
	if motion == Motion.DYNAMIC and ProjectSettings.get_setting("physics/3d/physics_engine") != "Jolt Physics":
		found.append("motion is DYNAMIC: set Project Settings > Physics > 3D > Physics Engine to Jolt Physics.")
	return found


## Why it is not built, in one sentence; "" where it is.
func fault() -> String:
	return _fault


## The joints that move by themselves, in the order of [method get_pose].
func joint_names() -> PackedStringArray:
	var names := PackedStringArray()
	for joint in table.leaders if table != null else []:
		names.append(joint.name)
	return names


## The least and the largest position of a joint, and its largest speed; infinite where there is no limit.
func limits(joint_name: String) -> PackedFloat64Array:
	var joint := _leader(joint_name)
	return PackedFloat64Array() if joint == null else PackedFloat64Array(
			[_lower[joint.index], _upper[joint.index], joint.velocity])


## Moves a joint, within its limits; what it carries and what follows it go along. DYNAMIC: its motor goes there.
func set_joint(joint_name: String, position: float) -> String:
	var joint := _leader(joint_name)
	if joint == null:
		return _fault_of_joint(joint_name)
	return set_pose({joint_name: position})


## Where a joint is, also one that follows another. DYNAMIC: where its body is.
func get_joint(joint_name: String) -> float:
	var joint := table.joint(joint_name) if table != null else null
	if joint == null:
		_refuse(_fault_of_joint(joint_name))
		return NAN
	if _bodies != null and joint.moves():
		return _bodies.position_of(joint)
	return _position_of(joint)


## Moves several joints: a Dictionary of positions by name, or an Array of all in the order of [method joint_names].
## Where one of them is wrong none is moved.
func set_pose(pose: Variant) -> String:
	var wanted := _positions.duplicate()
	var wrong := _read_pose(pose, wanted)
	if not wrong.is_empty():
		return _refuse(wrong)
	_positions = wanted
	if _bodies != null:
		_bodies.aim(_all_positions())
	else:
		_apply()
	return ""


## Like [method set_pose], and in DYNAMIC bodies are there at once and at rest: for [method ConsacAgent.reset].
func place(pose: Variant) -> String:
	var wrong := set_pose(pose)
	if wrong.is_empty() and _bodies != null:
		_apply()
		_bodies.place(_all_positions(), _links)
	return wrong


## Where all joints that move by themselves are, in the order of [method joint_names].
func get_pose() -> PackedFloat64Array:
	var pose := PackedFloat64Array()
	for joint in table.leaders if table != null else []:
		pose.append(get_joint(joint.name))
	return pose


## The node of a link, for what is to move along with it; null where there is none.
func link_node(link_name: String) -> Node3D:
	var link := table.link(link_name) if table != null else null
	if link == null:
		_refuse(_no_link(link_name))
		return null
	return _links[link.index]


## A link's frame as this node sees it.
func get_link_pose(link_name: String) -> Transform3D:
	var node := link_node(link_name)
	return Transform3D() if node == null else _seen(node)


## Where the tool is ([member tool_point] of [member tool_link]), as this node sees it. For the robot's own axes, z up:
## [method ConsacTwinConvention.pose_to_robot].
func get_end_effector() -> Transform3D:
	var name := tool_link
	if name.is_empty() and table != null and not table.end_effectors.is_empty():
		name = table.end_effectors[0]
	return get_link_pose(name) * Transform3D(Basis(), tool_point)


## Builds it anew, as when [member folder] has changed.
func rebuild() -> String:
	_build()
	return _fault


func _changed() -> void:
	if is_node_ready() and not _stale:
		_stale = true
		_build_if_stale.call_deferred()


func _build_if_stale() -> void:
	if _stale:
		_build()


func _build() -> void:
	_stale = false
	for node: Node in [_bodies, _scene]:
		if node != null:
			remove_child(node)
			node.queue_free()
	_bodies = null
	_scene = null
	_links.clear()
	_fault = _make()
	if not _fault.is_empty():
		_links.clear()
		table = null
		if not Engine.is_editor_hint():
			_refuse(_fault)
	update_configuration_warnings()
	if _fault.is_empty():
		built.emit()


func _make() -> String:
	if folder.is_empty():
		return "folder is empty; set it to what consac twin import has made."
	table = ConsacTwinTable.of_file(folder.path_join("twin.json"))
	if not table.fault.is_empty():
		return table.fault
	var loaded := ConsacTwinScene.of_file(folder.path_join("twin.glb"), table)
	if not loaded.fault.is_empty():
		return loaded.fault
	_scene = loaded.root
	_links = loaded.links
	add_child(_scene, false, Node.INTERNAL_MODE_BACK)
	_measure_limits()
	_positions.resize(table.leaders.size())
	for joint in table.leaders:
		_positions[joint.index] = clampf(0.0, _lower[joint.index], _upper[joint.index])
	_apply()
	if motion == Motion.DYNAMIC and not Engine.is_editor_hint():
		return _make_bodies()
	return ""


func _make_bodies() -> String:
	var bodies := ConsacTwinBodies.new()
	var wrong := bodies.build(self)
	if not wrong.is_empty():
		bodies.free()
		return wrong
	_bodies = bodies
	add_child(bodies, false, Node.INTERNAL_MODE_BACK)
	bodies.place(_all_positions(), _links)
	return ""


# A leader's limits are also those of its followers, unless nothing would be left. Source: core's LimitsOf.
func _measure_limits() -> void:
	_lower.resize(table.leaders.size())
	_upper.resize(table.leaders.size())
	for joint in table.leaders:
		var low := joint.lower
		var high := joint.upper
		for follower in table.joints:
			if follower.leader == joint and follower.multiplier != 0.0:
				var ends := [(follower.lower - follower.offset) / follower.multiplier,
						(follower.upper - follower.offset) / follower.multiplier]
				low = maxf(low, ends.min())
				high = minf(high, ends.max())
		var some := low <= high
		_lower[joint.index] = low if some else joint.lower
		_upper[joint.index] = high if some else joint.upper


func _position_of(joint: ConsacTwinTable.Joint) -> float:
	if joint.leader != null:
		return joint.multiplier * _positions[joint.leader.index] + joint.offset
	return _positions[joint.index] if joint.index >= 0 else 0.0


func _all_positions() -> PackedFloat64Array:
	var all := PackedFloat64Array()
	for joint in table.joints:
		all.append(_position_of(joint))
	return all


func _apply() -> void:
	for i in table.joints.size():
		if table.joints[i].moves():
			_links[i + 1].transform = ConsacTwinConvention.motion(table.joints[i].type, _position_of(table.joints[i]))


func _read_pose(pose: Variant, into: PackedFloat64Array) -> String:
	if table == null:
		return "it is not built: %s" % _fault
	var by_name := {}
	if pose is Dictionary:
		by_name = pose
	elif typeof(pose) in [TYPE_ARRAY, TYPE_PACKED_FLOAT64_ARRAY, TYPE_PACKED_FLOAT32_ARRAY]:
		if pose.size() != into.size():
			return "the pose has %d positions, expected %d" % [pose.size(), into.size()]
		for i in into.size():
			by_name[table.leaders[i].name] = pose[i]
	else:
		return "the pose is a %s, expected a Dictionary or an Array" % type_string(typeof(pose))
	for name: Variant in by_name:
		var joint := table.joint(str(name))
		if joint == null or joint.index < 0:
			return _fault_of_joint(str(name))
		var position: Variant = by_name[name]
		if not (position is float or position is int):
			return "the position of joint '%s' is a %s, expected a number" % [name, type_string(typeof(position))]
		if not is_finite(position):
			return "the position of joint '%s' is %s, expected a finite number" % [name, position]
		into[joint.index] = clampf(position, _lower[joint.index], _upper[joint.index])
	return ""


# The joint of that name that moves by itself; else null, with a line in the log.
func _leader(joint_name: String) -> ConsacTwinTable.Joint:
	var joint := table.joint(joint_name) if table != null else null
	if joint == null or joint.index < 0:
		_refuse(_fault_of_joint(joint_name))
		return null
	return joint


func _fault_of_joint(joint_name: String) -> String:
	if table == null:
		return "it is not built: %s" % _fault
	var joint := table.joint(joint_name)
	if joint == null:
		return "'%s' has no joint '%s'; there are %s" % [table.robot_name, joint_name, ", ".join(joint_names())]
	if joint.leader != null:
		return "joint '%s' follows '%s'; move that" % [joint_name, joint.leader.name]
	return "joint '%s' is fixed" % joint_name


func _no_link(link_name: String) -> String:
	if table == null:
		return "it is not built: %s" % _fault
	var names := PackedStringArray()
	for link in table.links:
		names.append(link.name)
	return "'%s' has no link '%s'; there are %s" % [table.robot_name, link_name, ", ".join(names)]


# A chain of frames below this node, without going through the world, where numbers may be large.
func _seen(node: Node3D) -> Transform3D:
	var pose := Transform3D()
	var at: Node = node
	while at != self and at is Node3D:
		pose = (at as Node3D).transform * pose
		at = at.get_parent()
	return pose


func _refuse(what: String) -> String:
	push_error("%s: %s" % [name, what])
	return what
