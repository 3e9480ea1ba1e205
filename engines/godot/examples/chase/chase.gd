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
	var middle := get_viewport_rect().size / 2.0
	var corner := Vector2.ONE * ChaseAgent.ROOM * SCALE
	draw_rect(Rect2(middle - corner, 2.0 * corner), Color.SLATE_GRAY, false, 2.0)
	for agent in _agents:
		var at := middle + agent.place * SCALE
		if agent.chases:
			draw_line(at, middle + agent.other.place * SCALE, Color(1.0, 1.0, 1.0, 0.15))
		draw_circle(at, 4.0, Color.TOMATO if agent.chases else Color.MEDIUM_SEA_GREEN)
