extends Node2D
## A learner beside one who acts by a rule and, with a model, one who acts by it. What each does is counted; a mask forbids
## the learner the first choice in every second step.

const MODEL := ""
const LEAVES := false  # two act by a copy of the model, and one leaves

var by_rule := 0
var by_model := 0
var illegal := 0


class Chooses:
	extends ConsacAgent
	var done := -1
	var leaves := false

	func _init() -> void:
		observations = [ConsacEntry.box(&"b", 1), ConsacEntry.box(&"a", 1)]
		actions = [ConsacEntry.discrete(&"choice", 3)]
		max_steps = 8

	func observe(into: Dictionary) -> void:
		into[&"a"] = 0.5
		into[&"b"] = steps % 2

	func mask(legal: Dictionary) -> void:
		legal[&"choice"][0] = steps % 2

	func act(chosen: Dictionary) -> void:
		done = chosen[&"choice"]
		var world := get_parent()
		if control == ControlMode.BY_HAND:
			world.by_rule += 1
		elif control == ControlMode.MODEL:
			world.by_model += 1
		if masks_actions and done == 0 and steps % 2 == 0:
			world.illegal += 1

	func judge() -> void:
		add_reward(1.0 if done == 2 else 0.0)
		note(&"twos", 1.0 if done == 2 else 0.0)
		if leaves and steps == 2:
			queue_free()

	func heuristic(into: Dictionary) -> void:
		into[&"choice"] = 1


func _ready() -> void:
	var learner := Chooses.new()
	learner.masks_actions = true
	var rival := Chooses.new()
	rival.control = ConsacAgent.ControlMode.BY_HAND
	var all: Array[Node] = [learner, rival]
	if MODEL != "":
		var third := Chooses.new()
		third.masks_actions = true
		third.control = ConsacAgent.ControlMode.MODEL
		third.model = load(MODEL)
		if LEAVES:
			third.model = third.model.duplicate()
			third.model.resource_path = "res://opponents.tscn::model"
			var fourth := third.duplicate()
			fourth.leaves = true
			add_child(fourth)
		all.append(third)
	var sync := ConsacSync.new()
	all.append(sync)
	sync.session_ended.connect(func(_fault: String) -> void:
		var doing := all.map(func(node: Node) -> int: return node.done if node is ConsacAgent else -1)
		print("opponents: rule %d model %d illegal %d, in the end %s" % [by_rule, by_model, illegal, doing.slice(0, -1)]))
	for node in all:
		add_child(node)
