extends Node2D
## An agent whose ConsacSync leaves the scene while it drives: freed, or with a scene that is changed.

const HOW := "free"  # "change": to a scene without a sync; "again": to this scene once more
const MASKS := false
const AFTER := 200  # steps

static var _scenes := 0

var _sync := ConsacSync.new()
var _done := false


class Walks:
	extends ConsacAgent
	var place := 0.0

	func reset(_seed: int) -> void:
		place = rng.randf_range(-1.0, 1.0)

	func observe(into: Dictionary) -> void:
		into[&"place"] = place

	func act(chosen: Dictionary) -> void:
		place = clampf(place + 0.1 * (chosen[&"move"] - 1), -1.0, 1.0)

	func judge() -> void:
		add_reward(-absf(place))


func _ready() -> void:
	_scenes += 1
	Engine.physics_ticks_per_second = 600
	var agent := Walks.new()
	agent.name = "Walker"
	agent.observations = [ConsacEntry.box(&"place", 1)]
	agent.actions = [ConsacEntry.discrete(&"move", 3)]
	agent.max_steps = 50
	agent.masks_actions = MASKS
	add_child(agent)
	add_child(_sync)
	process_mode = Node.PROCESS_MODE_ALWAYS


func _physics_process(_delta: float) -> void:
	if _done or _sync.steps < AFTER:
		return
	_done = true
	if HOW == "free":
		_sync.queue_free()
	elif HOW == "again" and _scenes == 2:
		print("leaving: the second scene goes on")
		get_tree().quit()
	else:
		get_tree().change_scene_to_file("res://leaving.tscn" if HOW == "again" else "res://empty.tscn")
