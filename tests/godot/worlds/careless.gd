extends Node2D
## Agents made without a thought of the add-on: scripts with a life of their own and with errors, sensors that go, what are
## no numbers.

const COMES_AND_GOES := false
const LOSES_SENSOR := false
const SEES := [true, false]
const PLAYS := 0.0
const NOTED := ""  # a metric's name
const SYNCS := 1
const AGENTS := 2
const ERRS := ""  # in which function a script has an error, from the fourth step on

var _tick := 0


# What any script may have: GDScript leaves the function here, and goes on.
static func fail() -> void:
	var nobody: Node = null
	nobody.queue_free()


class Sees:
	extends ConsacSensor
	var agent: Careless

	func entries() -> Array[ConsacEntry]:
		return [ConsacEntry.box(entry_name, 1)]

	func sense(into: Dictionary) -> void:
		into[entry_name] = 0.5
		agent.err(&"sense")


class Careless:
	extends ConsacAgent
	var sees: Array
	var noted := ""
	var errs := &""
	var taken := 0

	func _init() -> void:
		observations = [ConsacEntry.box(&"place", 2)]
		actions = [ConsacEntry.box(&"move", 1)]
		max_steps = 20

	func _enter_tree() -> void:
		pass

	func _exit_tree() -> void:
		pass

	func err(where: StringName) -> void:
		if where == errs and taken >= 4:
			get_parent().fail()

	func reset(_episode_seed: int) -> void:
		err(&"reset")

	func observe(into: Dictionary) -> void:
		into[&"place"] = sees
		err(&"observe")

	func act(_chosen: Dictionary) -> void:
		taken += 1
		err(&"act")

	func heuristic(into: Dictionary) -> void:
		err(&"heuristic")
		into[&"move"] = get_parent().PLAYS

	func judge() -> void:
		err(&"judge")
		if errs == &"reset" and taken >= 4:
			end_episode()
		if not noted.is_empty():
			note(noted, 5.0)


func _come() -> Careless:
	var agent := Careless.new()
	agent.sees = SEES
	agent.noted = NOTED
	agent.errs = ERRS
	var sensor := Sees.new()
	sensor.agent = agent
	sensor.name = "Sees"
	agent.add_child(sensor)
	add_child(agent)
	return agent


func _ready() -> void:
	for i in AGENTS:
		_come()
	for i in SYNCS:
		var sync := ConsacSync.new()
		sync.room_for_agents = 4
		sync.name = "Sync%d" % i
		add_child(sync)


func _physics_process(_delta: float) -> void:
	_tick += 1
	var there := get_children().filter(func(node: Node) -> bool: return node is Careless)
	if LOSES_SENSOR and _tick == 30:
		there[0].get_node("Sees").queue_free()
	if COMES_AND_GOES and _tick % 20 == 0:
		there[0].queue_free()
		_come()
