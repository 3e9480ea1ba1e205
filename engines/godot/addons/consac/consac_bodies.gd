class_name ConsacBodies
extends RefCounted
## Puts rigid bodies where an episode begins, for [method ConsacAgent.reset]. The physics server owns a body's place: a
## RigidBody2D whose [code]position[/code] alone is set keeps the speed and the turn that it had, and stands
## where it was again after the next tick unless its global transform was read since the latest one.

## Whether somebody wants to know which bodies are placed, and these by instance id.
static var watched := false
static var placed := {}


## Puts [param body] there with this velocity (pixels a second) and turn (radians a second), awake.
static func place_2d(body: RigidBody2D, where: Transform2D, velocity := Vector2.ZERO, turn := 0.0) -> void:
	if watched:
		placed[body.get_instance_id()] = true
	PhysicsServer2D.body_set_state(body.get_rid(), PhysicsServer2D.BODY_STATE_TRANSFORM, where)
	body.global_transform = where
	body.linear_velocity = velocity
	body.angular_velocity = turn
	body.sleeping = false
	body.reset_physics_interpolation()


## Puts [param body] there with this velocity (metres a second) and turn (radians a second), awake.
static func place_3d(body: RigidBody3D, where: Transform3D, velocity := Vector3.ZERO, turn := Vector3.ZERO) -> void:
	if watched:
		placed[body.get_instance_id()] = true
	PhysicsServer3D.body_set_state(body.get_rid(), PhysicsServer3D.BODY_STATE_TRANSFORM, where)
	body.global_transform = where
	body.linear_velocity = velocity
	body.angular_velocity = turn
	body.sleeping = false
	body.reset_physics_interpolation()
