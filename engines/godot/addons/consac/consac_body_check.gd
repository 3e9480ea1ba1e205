class_name ConsacBodyCheck
extends RefCounted
## Watches the first episodes of an agent for a rigid body that [method ConsacAgent.reset] puts elsewhere, but that keeps
## the speed of the episode before. Of that people are told once.

const EPISODES := 8  # that are looked at: a reset() that forgets speeds does so each time
const SLOW_2D := 1.0  # pixels a second: what a body at rest may have
const SLOW_3D := 0.01  # metres a second
const SLOW_TURN := 0.01  # radians a second

static var _told := false

var _looks := 0
var _seen: Array[Array] = []  # of each body: itself, transform, velocity, turn


## Before the reset() of [param agent].
func before(agent: ConsacAgent) -> void:
	_seen.clear()
	if _told or _looks >= EPISODES:
		return
	_looks += 1
	for body in _bodies_of(agent):
		# Not global_transform: to read that changes whether the engine keeps a place that is set.
		if not body.freeze and (body.linear_velocity.length() > _slow(body) or _turn(body) > SLOW_TURN):
			_seen.append([body, body.transform, body.linear_velocity, body.angular_velocity])
	ConsacBodies.watched = not _seen.is_empty()


## And after it.
func after() -> void:
	for was in _seen:
		if _told or not is_instance_valid(was[0]) or not was[0].is_inside_tree():
			continue
		var body: Node = was[0]
		if body.transform.is_equal_approx(was[1]) or ConsacBodies.placed.has(body.get_instance_id()):
			continue
		var kept := PackedStringArray()
		if was[2].length() > _slow(body) and body.linear_velocity == was[2]:
			kept.append("linear_velocity %s" % was[2])
		if body.angular_velocity == was[3] and _turn(body) > SLOW_TURN:
			kept.append("angular_velocity %s" % was[3])
		if not kept.is_empty():
			_told = true
			push_warning(("reset() puts %s elsewhere, but it keeps the speed of the episode before (%s); place it with "
					+ "ConsacBodies.%s(), which sets speed and turn too") % [
					body.name, ", ".join(kept), "place_2d" if body is RigidBody2D else "place_3d"])
	_seen.clear()
	ConsacBodies.watched = false
	ConsacBodies.placed.clear()


# What is around the agent, from its parent down, and what its script has in a variable.
static func _bodies_of(agent: ConsacAgent) -> Array[Node]:
	var found: Array[Node] = []
	var around := agent.get_parent()
	if around != null:  # a game may ask an agent that is in no scene
		if _is_body(around):
			found.append(around)
		for kind: String in ["RigidBody2D", "RigidBody3D"]:
			found.append_array(around.find_children("*", kind, true, false))
	for property: Dictionary in agent.get_property_list():
		if property.usage & PROPERTY_USAGE_SCRIPT_VARIABLE and property.type in [TYPE_OBJECT, TYPE_NIL]:
			var value: Variant = agent.get(property.name)
			if is_instance_valid(value) and _is_body(value) and value.is_inside_tree() and not value in found:
				found.append(value)
	return found


static func _is_body(what: Variant) -> bool:
	return what is RigidBody2D or what is RigidBody3D


static func _slow(body: Node) -> float:
	return SLOW_2D if body is RigidBody2D else SLOW_3D


static func _turn(body: Node) -> float:
	return absf(body.angular_velocity) if body is RigidBody2D else body.angular_velocity.length()
