extends Node2D
## Many pairs of a chaser and a runner in one room; makes the agents and draws them.

const SCALE := 33.0  # pixels in a metre

## How many pairs; twice as many agents.
@export_range(1, 1000) var pairs: int = 32

var _agents: Array[ChaseAgent] = []


func _ready() -> void:
	for i in pairs:
		var chaser := ChaseAgent.create(true)
		var runner := ChaseAgent.create(false)
		chaser.name = "Chaser%d" % i
		runner.name = "Runner%d" % i
		chaser.other = runner
		runner.other = chaser
		for agent: ChaseAgent in [chaser, runner]:
			_agents.append(agent)
			add_child(agent)


func _process(_delta: float) -> void:
	queue_redraw()


func _draw() -> void:
	draw_rect(Rect2(Vector2.ZERO, get_viewport_rect().size), Color("1b2430"))
	var middle := Vector2(get_viewport_rect().size.x - 190.0, get_viewport_rect().size.y / 2.0)  # beside the texts
	var corner := Vector2.ONE * ChaseAgent.ROOM * SCALE
	draw_rect(Rect2(middle - corner, 2.0 * corner), Color("dfe6e0"))
	for i in 10:
		for j in 10:
			if (i + j) % 2 == 0:
				draw_rect(Rect2(middle - corner + Vector2(i, j) * SCALE, Vector2.ONE * SCALE), Color("d2dbd4"))
	draw_rect(Rect2(middle - corner, 2.0 * corner), Color("8d99a6"), false, 4.0)
	for agent in _agents:
		var at := middle + agent.place * SCALE
		if agent.chases:
			draw_line(at, middle + agent.other.place * SCALE, Color(0.1, 0.2, 0.3, 0.15))
		draw_circle(at + Vector2(1, 2), 5.0, Color(0, 0, 0, 0.2))
		draw_circle(at, 5.0, Color("d1495b") if agent.chases else Color("2e8b74"))
		draw_circle(at + Vector2(-1.5, -1.5), 1.5, Color(1, 1, 1, 0.6))
