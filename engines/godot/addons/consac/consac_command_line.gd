class_name ConsacCommandLine
extends RefCounted
## Settings of a [ConsacSync] from the command line, behind "--", so that scripts need not edit a
## scene:
## [codeblock]
## godot --headless --path PROJECT res://examples/road/road.tscn -- --consac-port=0 --consac-loop=1
## [/codeblock]

const PREFIX := "--consac-"
## Name of an argument: the property that it sets.
const ARGUMENTS := {
	"mode": &"mode",  # serve, train, act, by_hand
	"protocol": &"protocol",  # auto, text1
	"port": &"port",
	"period": &"decision_period",
	"fast": &"as_fast_as_possible",  # 0 or 1
	"loop": &"loop_mode",
	"steps": &"training_length",
	"name": &"model_name",
	"model": &"model_path",
	"algorithm": &"algorithm",
	"set": &"hyperparameters",  # name:value,name:value; a value may hold commas: net_arch:[64,64]
	"act-while-learning": &"act_while_learning",
	"room": &"room_for_agents",
	"record": &"record_path",
	"seed": &"world_seed",
	"sessions": &"sessions",
	"quit": &"quit_at_end",
	"deadline": &"deadline_s",
	"budget": &"show_budget",
}


## Sets what the command line says. The first argument that it does not know or cannot read, and why, or "".
static func apply(sync: ConsacSync) -> String:
	for argument in OS.get_cmdline_user_args():
		if not argument.begins_with(PREFIX):
			continue
		var parts := argument.trim_prefix(PREFIX).split("=", true, 1)
		var fault := "expected --consac-NAME=VALUE"
		if parts.size() == 2:
			fault = _assign(sync, parts[0], parts[1])
		if not fault.is_empty():
			return "argument '%s': %s" % [argument, fault]
	return ""


static func _assign(sync: ConsacSync, argument: String, text: String) -> String:
	if not ARGUMENTS.has(argument):
		return "there are " + ", ".join(ARGUMENTS.keys())
	var property: StringName = ARGUMENTS[argument]
	if argument in ["mode", "protocol"]:
		var names: Array = ConsacSync.Mode.keys() if argument == "mode" else ConsacSync.Protocol.keys()
		var index := names.find(text.to_upper())
		if index < 0:
			return "there are " + ", ".join(names).to_lower()
		sync.set(property, index)
		return ""
	match typeof(sync.get(property)):
		TYPE_STRING:
			sync.set(property, text)
		TYPE_DICTIONARY:
			var table := _table(text)
			if table.is_empty() and not text.is_empty():
				return "expected NAME:VALUE,NAME:VALUE"
			sync.set(property, table)
		TYPE_BOOL:
			sync.set(property, text in ["1", "true", "yes"])
		_:
			if not text.is_valid_float():
				return "'%s' is no number" % text
			sync.set(property, text.to_float() if typeof(sync.get(property)) == TYPE_FLOAT else text.to_int())
	return ""


# A comma parts two values only where a name and a colon follow it, outside of all brackets. Empty where
# the text does not begin with a name.
static func _table(text: String) -> Dictionary:
	var table := {}
	var latest := ""
	var depth := 0
	for piece in text.split(","):
		var colon := piece.find(":")
		if depth == 0 and colon > 0 and piece.left(colon).is_valid_ascii_identifier():
			latest = piece.left(colon)
			table[latest] = piece.substr(colon + 1)
		elif latest.is_empty():
			return {}
		elif not piece.is_empty() or depth > 0:
			table[latest] += "," + piece
		for bracket: String in ["[", "{", "("]:
			depth += piece.count(bracket)
		for bracket: String in ["]", "}", ")"]:
			depth -= piece.count(bracket)
	return table
