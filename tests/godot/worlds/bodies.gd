extends Node2D
## A rigid body in 2D and one in 3D, put at a place with a speed at each beginning; prints what became of it after a tick.

const SHORT := false  # every episode ends with its first step
const PLACES := true  # else reset() sets position alone
const RAYS := false  # a ray sensor that was forgotten

var ball_2d := RigidBody2D.new()
var ball_3d := RigidBody3D.new()


class Puts:
	extends ConsacAgent

	func _init() -> void:
		observations = [ConsacEntry.box(&"place", 2, -1000.0, 1000.0)]
		actions = [ConsacEntry.box(&"nothing", 1)]

	func reset(_seed: int) -> void:
		var world := get_parent()
		if not world.PLACES:
			world.ball_2d.position = Vector2(100, 50)
			world.ball_3d.position = Vector3(100, 50, 7)
			return
		ConsacBodies.place_2d(world.ball_2d, Transform2D(0.0, Vector2(100, 50)), Vector2(30, 0), 30.0)
		ConsacBodies.place_3d(world.ball_3d, Transform3D(Basis(), Vector3(100, 50, 7)), Vector3(30, 0, 0), Vector3.ZERO)

	func observe(into: Dictionary) -> void:
		into[&"place"] = get_parent().ball_2d.position

	func judge() -> void:
		var world := get_parent()
		if steps == 0:
			var moved: float = world.ball_3d.position.x - 100.0
			print("bodies: %.1f %.1f %.1f" % [world.ball_2d.position.x - 100.0, moved, world.ball_2d.rotation])
		if not world.PLACES:
			print("bodies: kept %s %s" % [world.ball_2d.linear_velocity.x, world.ball_3d.linear_velocity.x])
		if steps == 4 or world.SHORT:
			end_episode()


func _ready() -> void:
	Engine.physics_ticks_per_second = 60
	ball_2d.name = "Ball2D"
	for body: Node in [ball_2d, ball_3d]:
		var shape: Node = CollisionShape2D.new() if body is RigidBody2D else CollisionShape3D.new()
		shape.shape = CircleShape2D.new() if body is RigidBody2D else SphereShape3D.new()
		body.add_child(shape)
		body.gravity_scale = 0.0
		body.linear_damp_mode = 1
		body.angular_damp_mode = 1
		body.linear_damp = 0.0
		body.angular_damp = 0.0
		add_child(body)
	var agent := Puts.new()
	agent.name = "Agent"
	if RAYS:
		var rays := ConsacRaySensor2D.new()
		rays.name = "Rays"
		agent.add_child(rays)
	add_child(agent)
	if not PLACES:
		ball_2d.linear_velocity = Vector2(30, 0)
		ball_3d.linear_velocity = Vector3(30, 0, 0)
	add_child(ConsacSync.new())
