@tool
class_name ConsacTwinBodies
extends Node
## The rigid bodies of a [ConsacTwin] whose motion is DYNAMIC: one for all links that do not move against each other,
## with the table's masses and capsules, and between two of them a hinge or a slide with the table's limits, driven by a
## motor. The engine's motors take a speed; each tick it is what is left of the way times the twin's stiffness.

const NO_EFFORT_LIMIT := 1e5  ## N m or N, of a motor whose joint has no limit of effort
const NO_SPEED_LIMIT := 20.0  ## rad/s or m/s, of one whose joint has no limit of speed
const BALL := 0.05  ## m: a body whose mass the user gives turns as a ball of this radius

# The engine's hinge counts turns clockwise about its own Z axis: with that along the joint's -X they are the joint's.
const HINGE_TURN := Basis(Vector3(0, 0, 1), Vector3(0, 1, 0), Vector3(-1, 0, 0))


## A joint of the engine, and what drives it.
class Drive:
	var joint: ConsacTwinTable.Joint
	var parent: PhysicsBody3D
	var child: RigidBody3D
	var anchor := Transform3D()  ## the joint's rest frame in the parent body
	var node: Joint3D
	var target := 0.0  ## rad or m
	var position := 0.0  ## likewise, where it was seen last: a turn beyond half a circle counts on


var _twin: ConsacTwin
var _drives: Array[Drive] = []
var _drive_of := {}  # joint -> Drive
var _heads: Array[ConsacTwinTable.Link] = []  # the first link of each body
var _bodies: Array[PhysicsBody3D] = []
var _body_of := {}  # link -> number of its body
var _in_body := {}  # link -> its frame in its body, at any pose
var _rest := {}  # link -> its frame in the twin, all positions 0


## Makes the bodies of [param twin] at position 0, below this node. What is missing for that in one sentence, or "".
func build(twin: ConsacTwin) -> String:
	_twin = twin
	_sort(twin.table)
	for number in _heads.size():
		var mass := _mass(number)
		if number > 0 and mass <= 0.0:
			return ("motion is DYNAMIC, and twin.json says no mass of link '%s'; import with --density, or set missing_mass"
					% _heads[number].name)
		_bodies.append(_body(number, mass))
		add_child(_bodies[number])
	for joint in twin.table.joints:
		if joint.moves():
			_add_drive(joint)
	_except()
	return ""


## What each joint of the table is to come to, all of them in its order.
func aim(positions: PackedFloat64Array) -> void:
	for i in _twin.table.joints.size():
		if _twin.table.joints[i].moves():
			(_drive_of[_twin.table.joints[i]] as Drive).target = positions[i]


## Puts all bodies where [param links], the twin's nodes, stand for [param positions], at rest.
func place(positions: PackedFloat64Array, links: Array[Node3D]) -> void:
	aim(positions)
	for drive in _drives:
		drive.position = drive.target
	for number in range(1, _bodies.size()):
		ConsacBodies.place_3d(_bodies[number] as RigidBody3D, links[_heads[number].index].global_transform)


## Where a joint is, rad or m.
func position_of(joint: ConsacTwinTable.Joint) -> float:
	return _look(_drive_of[joint])


func _ready() -> void:
	process_physics_priority = -900  # after a sync and its agents, before the world's own nodes
	for number in _bodies.size():
		_bodies[number].global_transform = _twin.global_transform * _rest[_heads[number]]
	for drive in _drives:
		drive.node.global_transform = drive.parent.global_transform * drive.anchor * (
				Transform3D(HINGE_TURN, Vector3.ZERO) if drive.node is HingeJoint3D else Transform3D())
		drive.node.node_a = drive.node.get_path_to(drive.parent)
		drive.node.node_b = drive.node.get_path_to(drive.child)


func _physics_process(_delta: float) -> void:
	for drive in _drives:
		drive.position = _look(drive)
		var fastest := minf(drive.joint.velocity, NO_SPEED_LIMIT)
		var speed := clampf((drive.target - drive.position) * _twin.stiffness, -fastest, fastest)
		if drive.node is HingeJoint3D:
			(drive.node as HingeJoint3D).set_param(HingeJoint3D.PARAM_MOTOR_TARGET_VELOCITY, speed)
		else:
			(drive.node as Generic6DOFJoint3D).set_param_x(Generic6DOFJoint3D.PARAM_LINEAR_MOTOR_TARGET_VELOCITY, speed)
	for number in range(1, _bodies.size()):
		_twin.link_node(_heads[number].name).global_transform = _bodies[number].global_transform


# Which links move together.
func _sort(table: ConsacTwinTable) -> void:
	for link in table.links:
		var joint := link.joint
		_rest[link] = Transform3D() if joint == null else _rest[table.links[joint.parent]] * joint.rest
		if joint == null or joint.moves():
			_body_of[link] = _heads.size()
			_in_body[link] = Transform3D()
			_heads.append(link)
		else:
			_body_of[link] = _body_of[table.links[joint.parent]]
			_in_body[link] = _in_body[table.links[joint.parent]] * joint.rest


func _links_of(number: int) -> Array[ConsacTwinTable.Link]:
	var found: Array[ConsacTwinTable.Link] = []
	for link in _twin.table.links:
		if _body_of[link] == number:
			found.append(link)
	return found


func _mass(number: int) -> float:
	var mass := 0.0
	for link in _links_of(number):
		mass += link.mass
	return mass if mass > 0.0 else _twin.missing_mass


func _body(number: int, mass: float) -> PhysicsBody3D:
	var body: PhysicsBody3D = StaticBody3D.new() if number == 0 else RigidBody3D.new()
	body.name = _heads[number].name.validate_node_name()
	body.collision_layer = _twin.collision_layer
	body.collision_mask = _twin.collision_mask
	for link in _links_of(number):
		for capsule in link.capsules:
			if capsule.radius > 0.0:
				body.add_child(_shape(capsule, _in_body[link]))
	if body is RigidBody3D:
		_weigh(body as RigidBody3D, number, mass)
	return body


static func _shape(capsule: ConsacTwinTable.Capsule, frame: Transform3D) -> CollisionShape3D:
	var node := CollisionShape3D.new()
	var from := frame * capsule.from
	var line := frame * capsule.to - from
	var shape := CapsuleShape3D.new()
	shape.radius = capsule.radius
	shape.height = line.length() + 2.0 * capsule.radius
	node.shape = shape
	var turn := Quaternion()
	if not line.is_zero_approx():
		turn = Quaternion(Vector3.UP, line.normalized())
	node.transform = Transform3D(Basis(turn), from + 0.5 * line)
	return node


# Mass, its centre and inertia of all links of a body. The engine takes three numbers of inertia along the body's axes;
# what a matrix has beside its diagonal is left out.
func _weigh(body: RigidBody3D, number: int, mass: float) -> void:
	body.mass = mass
	body.can_sleep = false
	body.linear_damp_mode = RigidBody3D.DAMP_MODE_REPLACE
	body.angular_damp_mode = RigidBody3D.DAMP_MODE_REPLACE
	var heavy := _links_of(number).filter(func(link: ConsacTwinTable.Link) -> bool: return link.mass > 0.0)
	if heavy.is_empty():
		body.inertia = Vector3.ONE * (0.4 * mass * BALL * BALL + _twin.armature)
		return
	var centre := Vector3.ZERO
	for link: ConsacTwinTable.Link in heavy:
		centre += link.mass / mass * (_in_body[link] * link.centre)
	var inertia := Vector3.ONE * _twin.armature
	for link: ConsacTwinTable.Link in heavy:
		var frame: Transform3D = _in_body[link]
		var turned := frame.basis * link.inertia * frame.basis.transposed()
		var off := frame * link.centre - centre
		for axis in 3:
			inertia[axis] += turned[axis][axis] + link.mass * (off.length_squared() - off[axis] * off[axis])
	body.center_of_mass_mode = RigidBody3D.CENTER_OF_MASS_MODE_CUSTOM
	body.center_of_mass = centre
	body.inertia = inertia


func _add_drive(joint: ConsacTwinTable.Joint) -> void:
	var drive := Drive.new()
	drive.joint = joint
	var parent := _twin.table.links[joint.parent]
	drive.parent = _bodies[_body_of[parent]]
	drive.child = _bodies[_body_of[_twin.table.links[joint.number + 1]]] as RigidBody3D
	drive.anchor = _in_body[parent] * joint.rest
	var effort := minf(joint.effort, NO_EFFORT_LIMIT)
	drive.node = _slide(joint, effort) if joint.type == &"prismatic" else _hinge(joint, effort)
	add_child(drive.node)
	_drives.append(drive)
	_drive_of[joint] = drive


static func _hinge(joint: ConsacTwinTable.Joint, effort: float) -> HingeJoint3D:
	var hinge := HingeJoint3D.new()
	hinge.set_flag(HingeJoint3D.FLAG_ENABLE_MOTOR, true)
	# The engine takes an impulse a tick, and divides it by the tick.
	hinge.set_param(HingeJoint3D.PARAM_MOTOR_MAX_IMPULSE, effort * Engine.time_scale / Engine.physics_ticks_per_second)
	# Beyond a full turn the engine has no limits; the target keeps them.
	if joint.upper - joint.lower < TAU:
		hinge.set_flag(HingeJoint3D.FLAG_USE_LIMIT, true)
		hinge.set_param(HingeJoint3D.PARAM_LIMIT_LOWER, joint.lower)
		hinge.set_param(HingeJoint3D.PARAM_LIMIT_UPPER, joint.upper)
	return hinge


static func _slide(joint: ConsacTwinTable.Joint, effort: float) -> Generic6DOFJoint3D:
	var slide := Generic6DOFJoint3D.new()
	slide.set_flag_x(Generic6DOFJoint3D.FLAG_ENABLE_LINEAR_MOTOR, true)
	slide.set_param_x(Generic6DOFJoint3D.PARAM_LINEAR_MOTOR_FORCE_LIMIT, effort)
	slide.set_flag_x(Generic6DOFJoint3D.FLAG_ENABLE_LINEAR_LIMIT, is_finite(joint.upper - joint.lower))
	if is_finite(joint.upper - joint.lower):
		slide.set_param_x(Generic6DOFJoint3D.PARAM_LINEAR_LOWER_LIMIT, joint.lower)
		slide.set_param_x(Generic6DOFJoint3D.PARAM_LINEAR_UPPER_LIMIT, joint.upper)
	return slide


# What does not collide: neighbours (by their joint), links that may touch, and all of them without self_collision.
func _except() -> void:
	for a in _bodies.size():
		for b in a:
			if not _twin.self_collision:
				_bodies[a].add_collision_exception_with(_bodies[b])
	for pair in _twin.table.allowed_collisions:
		var first := _twin.table.link(pair[0])
		var second := _twin.table.link(pair[1])
		if first != null and second != null and _body_of[first] != _body_of[second]:
			_bodies[_body_of[first]].add_collision_exception_with(_bodies[_body_of[second]])


# Where a joint is. A hinge's angle is known to a full turn only; what is nearest to where it was is taken.
func _look(drive: Drive) -> float:
	var seen := (drive.parent.global_transform * drive.anchor).affine_inverse() * drive.child.global_transform
	if drive.joint.type == &"prismatic":
		return seen.origin.x
	var angle := atan2(seen.basis.y.z, seen.basis.y.y)
	return drive.position + wrapf(angle - drive.position, -PI, PI)
