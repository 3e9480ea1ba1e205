@icon("res://addons/consac/icon.svg")
class_name ConsacParameter
extends Resource
## A number of the world that who trains may set and vary from episode to episode, so that what is learned holds for more
## than one world: gravity, a weight, how many enemies there are. One for each in [member ConsacSync.parameters];
## [method ConsacAgent.parameter] says what an episode has of it.

## Under which scripts and trainers know it; no two of a sync share a name.
@export var name: StringName = &""
## What it is where nobody sets it.
@export var default_value: float = 0.0
## Nothing below [member low] or above [member high] may be set.
@export var bounded: bool = false
## The least that may be set.
@export var low: float = 0.0
## The most that may be set.
@export var high: float = 1.0
## For people: a line, with the unit.
@export var description: String = ""
## What a training inside the engine sets: a number, [code]uniform LOW HIGH[/code] or [code]log_uniform LOW HIGH[/code],
## drawn anew for each episode, or [code]ramp FROM TO STEPS[/code]. "" for the default. A trainer that connects has its own
## [code]environment_parameters[/code].
@export var training: String = ""


## A parameter without bounds.
static func of(parameter_name: StringName, usual: float, while_training := "") -> ConsacParameter:
	var parameter := ConsacParameter.new()
	parameter.name = parameter_name
	parameter.default_value = usual
	parameter.training = while_training
	return parameter


## What is wrong with [param parameters], in one sentence; "" when nothing is.
static func fault_of(parameters: Array[ConsacParameter]) -> String:
	var seen := {}
	for parameter in parameters:
		if parameter == null:
			return "one of parameters is empty; make it a ConsacParameter, or remove it"
		if parameter.name == &"":
			return "one of parameters has no name"
		if seen.has(parameter.name):
			return "two parameters are named '%s'" % parameter.name
		seen[parameter.name] = true
		var value := parameter.default_value
		if not is_finite(value):
			return "parameter '%s' has the default_value %s; give a number" % [parameter.name, value]
		if parameter.bounded and not (parameter.low <= value and value <= parameter.high):
			return "parameter '%s' has the default_value %s, which is not within its %s to %s" % [
					parameter.name, value, parameter.low, parameter.high]
	return ""


## As the native class takes them.
static func tables(parameters: Array[ConsacParameter]) -> Array[Dictionary]:
	var all: Array[Dictionary] = []
	for parameter in parameters:
		var table := {name = parameter.name, default = parameter.default_value, description = parameter.description}
		if parameter.bounded:
			table.low = parameter.low
			table.high = parameter.high
		all.append(table)
	return all


## What a training inside sets of them, as the program [code]consac[/code] takes it; "" for nothing.
static func laws(parameters: Array[ConsacParameter]) -> String:
	var set_ones := parameters.filter(func(parameter: ConsacParameter) -> bool: return not parameter.training.is_empty())
	return ", ".join(set_ones.map(func(parameter: ConsacParameter) -> String:
		return "%s=%s" % [parameter.name, parameter.training]))
