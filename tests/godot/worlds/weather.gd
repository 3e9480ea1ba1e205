extends Node2D
## Walkers in the wind, which is a parameter of their world; they note how far they came, and win together.

const KINDS := ["one"]  # a behaviour for each walker
const GROUPS := ["red"]  # likewise
const TRAINING := ""  # of the wind
const DEFAULT := 4.0
const MASKS := false
const NAMED := "wind"
const EARLY := "wind"  # what one asks for before it begins
const ADDED := ""  # a parameter that the script adds after that
const LATE := false  # one more comes, in the group of the first
const GOALS := false

var _sync := ConsacSync.new()


class Walker:
	extends ConsacAgent
	var winds := PackedFloat64Array()
	var named := &"wind"

	func reset(_seed: int) -> void:
		winds.append(parameter(named))
		add_group_reward(100.0)  # what a reset brings about counts for nothing
		if winds.size() <= 3:
			print("weather: %s begins with %s" % [name, winds[-1]])

	func observe(into: Dictionary) -> void:
		into[&"wind"] = parameter(named)
		if goals != null:
			into[&"achieved_goal"] = 0.0
			into[&"desired_goal"] = 0.5

	func mask(legal: Dictionary) -> void:
		legal[&"move"] = PackedByteArray([1, 0])

	func judge() -> void:
		add_reward(0.25)
		if name == &"Walker0":
			add_group_reward(1.0)
		note(&"metres", 2.5)


func _ready() -> void:
	Engine.physics_ticks_per_second = 600
	for i in KINDS.size():
		_come(i)
	var wind := ConsacParameter.of(&"wind", DEFAULT, TRAINING)
	wind.bounded = true
	wind.low = 0.0
	wind.high = 9.0
	wind.description = "m/s"
	_sync.parameters = [wind]
	_sync.session_ended.connect(_tell)
	_sync.progressed.connect(func(numbers: Dictionary) -> void: print("weather: metres ", numbers.get("metres")))
	add_child(_sync)
	for walker in get_children():
		if walker is Walker:
			print("weather: before it begins %s" % walker.parameter(EARLY))
	if ADDED != "":
		_sync.parameters.append(ConsacParameter.of(ADDED, 1.0))


func _come(i: int) -> void:
	var walker := Walker.new()
	walker.name = "Walker%d" % i
	walker.named = NAMED
	walker.behaviour = KINDS[i % KINDS.size()]
	walker.group = GROUPS[i % GROUPS.size()]
	walker.observations = [ConsacEntry.box(&"wind", 1, -100.0, 100.0)]
	if GOALS:
		walker.observations.append_array([ConsacEntry.box(&"achieved_goal", 1), ConsacEntry.box(&"desired_goal", 1)])
		walker.goals = ConsacGoals.new()
	walker.actions = [ConsacEntry.discrete(&"move", 2)]
	walker.masks_actions = MASKS
	walker.max_steps = 3
	walker.episode_ended.connect(func(total: float, steps: int) -> void:
		if walker.winds.size() == 2:
			print("weather: %s earned %s in %d steps" % [walker.name, total, steps]))
	add_child(walker)


func _physics_process(_delta: float) -> void:
	if LATE and _sync.steps > 10 and get_child_count() == KINDS.size() + 1:
		_come(KINDS.size())


func _tell(_fault: String) -> void:
	for walker in get_children():
		if walker is Walker:
			print("weather: %s had %s to %s" % [walker.name, Array(walker.winds).min(), Array(walker.winds).max()])
