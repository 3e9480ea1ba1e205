extends Node2D
## The world that the README's example agent lives in.


func _ready() -> void:
	var floor := StaticBody3D.new()
	var plane := CollisionShape3D.new()
	plane.shape = BoxShape3D.new()
	plane.shape.size = Vector3(20, 1, 20)
	plane.position.y = -0.5
	floor.add_child(plane)
	var ball := RigidBody3D.new()
	var shape := CollisionShape3D.new()
	shape.shape = SphereShape3D.new()
	shape.shape.radius = 0.25
	ball.add_child(shape)
	var agent: ConsacAgent = load("res://readme_agent.gd").new()
	agent.ball = ball
	agent.observations = [ConsacEntry.box(&"place", 1, -3.0, 3.0), ConsacEntry.box(&"speed", 1, -10.0, 10.0)]
	agent.actions = [ConsacEntry.discrete(&"push", 3)]
	agent.max_steps = 200
	for node: Node in [floor, ball, agent, ConsacSync.new()]:
		add_child(node)
