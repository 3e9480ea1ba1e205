extends ConsacAgent
## Rolls a ball to a target on a plate without falling off. The engine's physics rolls it: the
## action is a torque, friction turns it into motion.

const TORQUE := 1.5  # N m
const RADIUS := 0.25  # m
const HALF := 3.0  # m, from the plate's middle to its edge
const NEAR := 0.5  # m: the target is reached
const ROOM := 2.2  # m from the middle: where ball and target may begin

## What rolls.
@export var ball: RigidBody3D
## Where it is to go; no body.
@export var target: Node3D

var _torque := Vector3.ZERO
var _before := 0.0


func _physics_process(_delta: float) -> void:
	ball.apply_torque(_torque)


func reset(_episode_seed: int) -> void:
	_torque = Vector3.ZERO
	ball.transform = Transform3D(Basis(), _place(RADIUS))
	ball.linear_velocity = Vector3.ZERO
	ball.angular_velocity = Vector3.ZERO
	target.position = _place(0.02)
	_before = _distance()


func act(chosen: Dictionary) -> void:
	var torque: PackedFloat32Array = chosen[&"torque"]
	_torque = Vector3(torque[1], 0.0, -torque[0]) * TORQUE  # about z to roll along x, about x to roll along z


func judge() -> void:
	var distance := _distance()
	add_reward(_before - distance)
	_before = distance
	if distance < NEAR:
		add_reward(1.0)
		end_episode()
	elif ball.position.y < -0.5:
		add_reward(-1.0)
		end_episode()


func observe(into: Dictionary) -> void:
	into[&"ball"] = Vector2(ball.position.x, ball.position.z) / HALF


func heuristic(into: Dictionary) -> void:
	var keys := Input.get_vector(&"ui_left", &"ui_right", &"ui_up", &"ui_down")
	into[&"torque"] = keys if keys != Vector2.ZERO else _towards_target()


# What a simple rule would do: towards the target, slower the faster it is.
func _towards_target() -> Vector2:
	var to := target.position - ball.position - 0.6 * ball.linear_velocity
	return Vector2(to.x, to.z).limit_length(1.0)


func _distance() -> float:
	var between := target.position - ball.position
	return Vector2(between.x, between.z).length()


func _place(height: float) -> Vector3:
	return Vector3(rng.randf_range(-ROOM, ROOM), height, rng.randf_range(-ROOM, ROOM))
