class_name LanderAgent
extends ConsacAgent
## Lands a rigid body in two dimensions on a pad: three engines turn and lift it, the engine's physics does the rest. The
## task is that of Gymnasium's LunarLander in pixels and seconds; the motion is the engine's.

const LIFT := 260.0  # pixels/s^2
const TURN := 6.0  # rad/s^2
const WIDTH := 640.0
const GROUND := 300.0
const FEET := 14.0  # below the middle
const PAD := Vector2(320.0, GROUND - FEET)
const PAD_HALF := 44.0
const GENTLE := 55.0  # pixels/s
const UPRIGHT := 0.3  # rad

## What lands.
var body: RigidBody2D
## What burns: 0 nothing, 1 left, 2 below, 3 right.
var burns := 0
## How the latest episode ended, for the picture.
var landed := false

var _before := 0.0


func _init() -> void:
	observations = [ConsacEntry.box(&"place", 2, -2.0, 2.0), ConsacEntry.box(&"speed", 2, -4.0, 4.0),
			ConsacEntry.box(&"tilt", 2), ConsacEntry.box(&"turn", 1, -4.0, 4.0)]
	actions = [ConsacEntry.discrete(&"engine", 4)]
	max_steps = 250


func _physics_process(_delta: float) -> void:
	match burns:
		1:
			body.apply_torque(TURN * body.inertia)
		2:
			body.apply_central_force(body.global_transform.basis_xform(Vector2.UP) * LIFT * body.mass)
		3:
			body.apply_torque(-TURN * body.inertia)


func reset(_episode_seed: int) -> void:
	burns = 0
	var place := Vector2(rng.randf_range(90.0, WIDTH - 90.0), rng.randf_range(30.0, 90.0))
	ConsacBodies.place_2d(body, Transform2D(rng.randf_range(-0.3, 0.3), place),
			Vector2(rng.randf_range(-40.0, 40.0), rng.randf_range(0.0, 30.0)))
	_before = _worth()


func observe(into: Dictionary) -> void:
	into[&"place"] = (body.position - PAD) / 200.0
	into[&"speed"] = body.linear_velocity / 100.0
	into[&"tilt"] = Vector2(sin(body.rotation), cos(body.rotation))
	into[&"turn"] = clampf(body.angular_velocity, -4.0, 4.0)


func act(chosen: Dictionary) -> void:
	burns = chosen[&"engine"]


func judge() -> void:
	var worth := _worth()
	add_reward(worth - _before - 0.01)  # to hover must not pay
	_before = worth
	var there := body.position.y >= PAD.y
	landed = (there and absf(body.position.x - PAD.x) < PAD_HALF and body.linear_velocity.length() < GENTLE
			and absf(body.rotation) < UPRIGHT)
	if there or body.position.x < 0.0 or body.position.x > WIDTH or body.position.y < -120.0:
		add_reward(4.0 if landed else -1.0)
		note(&"landed", float(landed))
		end_episode()


func heuristic(into: Dictionary) -> void:
	var keys := int(Input.is_action_pressed(&"ui_right")) + 3 * int(Input.is_action_pressed(&"ui_left"))
	keys = 2 if Input.is_action_pressed(&"ui_up") else keys
	into[&"engine"] = keys if keys != 0 else _rule()


# Leans towards the pad, and burns where it falls faster than it should at this height.
func _rule() -> int:
	var away := PAD - body.position
	var lean := clampf(away.x * 0.004 - body.linear_velocity.x * 0.008, -0.35, 0.35)
	var off := lean - body.rotation - 0.4 * body.angular_velocity
	if body.linear_velocity.y > 22.0 + 0.28 * away.y and absf(body.rotation) < 0.5:
		return 2
	return 1 if off > 0.06 else (3 if off < -0.06 else 0)


# How good its place is: near the pad, slow, upright.
func _worth() -> float:
	return -((body.position - PAD).length() / 200.0 + body.linear_velocity.length() / 150.0 + absf(body.rotation))
