extends Node2D
## Agents that come and go by a script: three come, one goes, another one comes.

const AGENTS := 0  # that are there at the beginning
const SCRIPTED := false

var _tick := 0
var _alive := []
var _last: ConsacAgent


class Walks:
	extends ConsacAgent
	var place := 0.0

	func _init() -> void:
		observations = [ConsacEntry.box(&"place", 1)]
		actions = [ConsacEntry.box(&"move", 1)]
		max_steps = 50

	func reset(_seed: int) -> void:
		place = rng.randf_range(-1.0, 1.0)

	func observe(into: Dictionary) -> void:
		into[&"place"] = place

	func act(chosen: Dictionary) -> void:
		place = clampf(place + 0.1 * float(chosen[&"move"] if chosen[&"move"] is float else chosen[&"move"][0]), -1.0, 1.0)

	func judge() -> void:
		add_reward(-absf(place))


func _ready() -> void:
	for i in AGENTS:
		add_child(Walks.new())
	add_child(ConsacSync.new())


func _come() -> void:
	_last = Walks.new()
	add_child(_last)


func _physics_process(_delta: float) -> void:
	_tick += 1
	if not SCRIPTED:
		return
	match _tick:
		10:
			for i in 3 - AGENTS:
				_come()
		20:
			_note()
			if AGENTS == 0:
				_last.queue_free()
		30:
			_note()
			_come()
		51:
			_note()
			print("spawning: alive %s, steps of the last one %d" % [_alive, _last.steps])
			if AGENTS == 0:
				get_tree().quit()


func _note() -> void:
	_alive.append(get_children().filter(func(node: Node) -> bool: return node is Walks and node.steps > 5).size())
