extends ConsacAgent
## Drives to a lamp that it sees with its own eye and nothing else: the picture of a camera on its head, in grey. It turns
## and rolls by itself, with no physics.

const ROOM := 4.0  # m from the middle to a wall
const NEAR := 0.9  # m: the lamp is reached
const ROLL := 0.35  # m a decision
const TURN := deg_to_rad(25.0)

## What drives.
@export var robot: Node3D
## What it looks for.
@export var lamp: Node3D

var _before := 0.0


func reset(_episode_seed: int) -> void:
	robot.position = _somewhere()
	robot.rotation.y = rng.randf_range(-PI, PI)
	_move_lamp()


func act(chosen: Dictionary) -> void:
	match chosen[&"move"]:
		0:
			robot.rotation.y += TURN
		1:
			robot.position -= robot.basis.z * ROLL
		2:
			robot.rotation.y -= TURN
	robot.position = robot.position.clamp(Vector3(-ROOM, 0, -ROOM), Vector3(ROOM, 0, ROOM))


func judge() -> void:
	var distance := _distance()
	add_reward(_before - distance - 0.02)
	_before = distance
	if distance < NEAR:
		add_reward(1.0)
		note(&"lamps", 1.0)
		_move_lamp()


func heuristic(into: Dictionary) -> void:
	var to := robot.to_local(lamp.position)
	var angle := atan2(to.x, -to.z)
	var keys := Input.get_axis(&"ui_left", &"ui_right")
	if keys != 0.0 or Input.is_action_pressed(&"ui_up"):
		into[&"move"] = 1 + int(signf(keys))
	else:
		into[&"move"] = 1 if absf(angle) < TURN else (2 if angle > 0.0 else 0)


func _move_lamp() -> void:
	lamp.position = _somewhere()
	while _distance() < 2.0 * NEAR:
		lamp.position = _somewhere()
	_before = _distance()


func _distance() -> float:
	return Vector2(lamp.position.x - robot.position.x, lamp.position.z - robot.position.z).length()


func _somewhere() -> Vector3:
	return Vector3(rng.randf_range(-ROOM, ROOM), 0.0, rng.randf_range(-ROOM, ROOM))
