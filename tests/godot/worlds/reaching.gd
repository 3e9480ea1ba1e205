extends Node2D
## A point in a square that is to go where it is wanted, 50 steps an episode: point-reach-v0 in the engine.

const DENSE := false
const OWN := 0.0  # a reward that its script gives in each step
const NAME := &"desired_goal"

var agent: Reaches


class Reaches:
	extends ConsacAgent
	const SIDE := 1.0
	const STRIDE := 0.1
	var place := Vector2.ZERO
	var goal := Vector2.ZERO
	var own := 0.0

	func reset(_seed: int) -> void:
		place = _anywhere()
		goal = _anywhere()

	func act(chosen: Dictionary) -> void:
		var move: PackedFloat32Array = chosen[&"move"]
		place = (place + STRIDE * Vector2(move[0], move[1])).clampf(-SIDE, SIDE)

	func judge() -> void:
		if own != 0.0:
			add_reward(own)

	func observe(into: Dictionary) -> void:
		into[&"achieved_goal"] = place
		into[&"desired_goal"] = goal

	func _anywhere() -> Vector2:
		return Vector2(rng.randf_range(-SIDE, SIDE), rng.randf_range(-SIDE, SIDE))


func _ready() -> void:
	agent = Reaches.new()
	agent.name = &"Reaches"
	agent.observations = [ConsacEntry.box(&"achieved_goal", 2), ConsacEntry.box(NAME, 2)]
	agent.actions = [ConsacEntry.box(&"move", 2)]
	agent.max_steps = 50
	agent.own = OWN
	agent.goals = ConsacGoals.new()
	agent.goals.pay = ConsacGoals.Pay.DENSE if DENSE else ConsacGoals.Pay.SPARSE
	add_child(agent)
	add_child(ConsacSync.new())
