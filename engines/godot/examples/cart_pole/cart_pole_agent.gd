extends ConsacAgent
## Balances a pole on a cart. The engine's physics moves both: the cart slides along one axis, a
## hinge holds the pole. The tasks' numbers (forces, limits, reward) are those of Gymnasium's
## CartPole; the motion is the engine's.

const FORCE := 10.0  # N
const HALF_LENGTH := 0.5  # m, from the hinge to the pole's middle
const FARTHEST := 2.4  # m
const LARGEST_ANGLE := deg_to_rad(12.0)
const START := 0.05  # m, rad, and of both a second: the most that an episode begins with
const HINGE := Vector3(0.0, 0.1, 0.0)  # in the cart

## What slides.
@export var cart: RigidBody3D
## What is to stand upright.
@export var pole: RigidBody3D

var _push := 0.0


func _physics_process(_delta: float) -> void:
	cart.apply_central_force(Vector3(_push, 0.0, 0.0))


func reset(_episode_seed: int) -> void:
	_push = 0.0
	var angle := rng.randf_range(-START, START)
	var position := Vector3(rng.randf_range(-START, START), 0.5, 0.0)
	var speed := Vector3(rng.randf_range(-START, START), 0.0, 0.0)
	var turn := Vector3(0.0, 0.0, rng.randf_range(-START, START))
	var arm := Vector3(-sin(angle), cos(angle), 0.0) * HALF_LENGTH
	_place(cart, Transform3D(Basis(), position), speed, Vector3.ZERO)
	_place(pole, Transform3D(Basis(Vector3.BACK, angle), position + HINGE + arm), speed + turn.cross(arm), turn)


func observe(into: Dictionary) -> void:
	into[&"position"] = cart.position.x
	into[&"speed"] = cart.linear_velocity.x
	into[&"angle"] = -_angle()  # positive to the right, as the position
	into[&"turn"] = -pole.angular_velocity.z


func act(chosen: Dictionary) -> void:
	_push = FORCE if chosen[&"push"] == 1 else -FORCE


func judge() -> void:
	add_reward(1.0)
	if absf(cart.position.x) > FARTHEST or absf(_angle()) > LARGEST_ANGLE:
		end_episode()


func heuristic(into: Dictionary) -> void:
	var held := Input.get_axis(&"ui_left", &"ui_right")
	into[&"push"] = int(held > 0.0) if held != 0.0 else int(_angle() < 0.0)


func _angle() -> float:
	return pole.rotation.z


static func _place(body: RigidBody3D, where: Transform3D, speed: Vector3, turn: Vector3) -> void:
	body.transform = where
	body.linear_velocity = speed
	body.angular_velocity = turn
