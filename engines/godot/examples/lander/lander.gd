extends Node2D
## Several landers over one pad, none in another's way; makes and draws them.

const STARS := 60
const HULL: PackedVector2Array = [Vector2(-9, 4), Vector2(-7, -8), Vector2(0, -13), Vector2(7, -8), Vector2(9, 4)]

## How many at once.
@export_range(1, 64) var landers: int = 8

var _agents: Array[LanderAgent] = []
var _stars := PackedVector2Array()


func _ready() -> void:
	var rng := RandomNumberGenerator.new()
	rng.seed = 4
	for i in STARS:
		_stars.append(Vector2(rng.randf() * 640.0, rng.randf() * 250.0))
	for i in landers:
		var body := RigidBody2D.new()
		body.name = "Lander%d" % i
		body.collision_layer = 0  # they pass one another
		body.collision_mask = 0
		body.mass = 1.0
		body.inertia = 100.0
		body.gravity_scale = 0.1  # of 980 pixels/s^2
		body.can_sleep = false
		var shape := CollisionShape2D.new()
		shape.shape = CircleShape2D.new()
		body.add_child(shape)
		var agent := LanderAgent.new()
		agent.name = "Agent%d" % i
		agent.body = body
		_agents.append(agent)
		add_child(body)
		add_child(agent)


func _process(_delta: float) -> void:
	queue_redraw()


func _draw() -> void:
	var sky := PackedColorArray([Color("0b1026"), Color("0b1026"), Color("3a3f6b"), Color("3a3f6b")])
	draw_polygon([Vector2.ZERO, Vector2(640, 0), Vector2(640, 360), Vector2(0, 360)], sky)
	for star in _stars:
		draw_circle(star, 0.8, Color(1, 1, 1, 0.6))
	draw_circle(Vector2(540, 70), 26.0, Color("d9d3c0"))
	draw_circle(Vector2(531, 64), 5.0, Color("c4bda7"))
	draw_circle(Vector2(548, 80), 7.0, Color("c4bda7"))
	var ridge := PackedVector2Array([Vector2(0, 270), Vector2(80, 235), Vector2(150, 262), Vector2(240, 225), Vector2(330, 265),
			Vector2(420, 238), Vector2(520, 268), Vector2(600, 240), Vector2(640, 258), Vector2(640, 360), Vector2(0, 360)])
	draw_colored_polygon(ridge, Color("2a2c4d"))
	draw_rect(Rect2(0, LanderAgent.GROUND, 640, 60), Color("565066"))
	draw_rect(Rect2(0, LanderAgent.GROUND, 640, 3), Color("8a8299"))
	var half := LanderAgent.PAD_HALF
	draw_rect(Rect2(LanderAgent.PAD.x - half, LanderAgent.GROUND - 2.0, 2.0 * half, 5), Color("f2c14e"))
	for side: float in [-half, half]:
		var foot := Vector2(LanderAgent.PAD.x + side, LanderAgent.GROUND)
		draw_line(foot, foot - Vector2(0, 22), Color("d9d3c0"), 1.5)
		draw_colored_polygon([foot - Vector2(0, 22), foot - Vector2(0, 14), foot + Vector2(11 * signf(side), -18)], Color("e4572e"))
	for agent in _agents:
		_draw_lander(agent)


func _draw_lander(agent: LanderAgent) -> void:
	draw_set_transform(agent.body.position, agent.body.rotation)
	match agent.burns:
		1:
			draw_line(Vector2(-9, -6), Vector2(-16, -6), Color("ffd166"), 3.0)
		2:
			draw_colored_polygon([Vector2(-4, 6), Vector2(4, 6), Vector2(0, 24)], Color("ff9f1c"))
			draw_colored_polygon([Vector2(-2, 6), Vector2(2, 6), Vector2(0, 15)], Color("fff3b0"))
		3:
			draw_line(Vector2(9, -6), Vector2(16, -6), Color("ffd166"), 3.0)
	for side: float in [-1.0, 1.0]:
		draw_line(Vector2(6 * side, 3), Vector2(11 * side, LanderAgent.FEET), Color("b8c0cc"), 2.0)
		draw_line(Vector2(8 * side, LanderAgent.FEET), Vector2(14 * side, LanderAgent.FEET), Color("b8c0cc"), 2.0)
	draw_colored_polygon(HULL, Color("e8ecf1"))
	draw_circle(Vector2(0, -4), 3.5, Color("3d9be9"))
	draw_set_transform(Vector2.ZERO)
