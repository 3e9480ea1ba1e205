class_name ConsacCommandLine
extends RefCounted
## Settings of a [ConsacSync] from the command line, behind "--", so that scripts need not edit a
## scene:
## [codeblock]
## godot --headless --path PROJECT res://examples/road/road.tscn -- --consac-port=0 --consac-loop=1
## [/codeblock]

const PREFIX := "--consac-"
## Answered by [method help].
const HELP := "--consac-help"
## Name of an argument: the property that it sets.
const ARGUMENTS := {
	"mode": &"mode",  # serve, train, act, by_hand
	"protocol": &"protocol",  # auto, text1
	"port": &"port",
	"period": &"decision_period",
	"fast": &"as_fast_as_possible",  # 0 or 1
	"ticks-a-frame": &"ticks_a_frame",
	"loop": &"loop_mode",
	"steps": &"training_length",
	"name": &"model_name",
	"model": &"model_path",
	"start-from": &"start_from",
	"checkpoints": &"checkpoint_every",
	"report": &"report_every_s",
	"curve": &"curve_path",
	"log": &"log_folder",
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


## Sets what the command line says. The first argument that it does not know or cannot read, and why, or ""; the others
## count all the same, so that a program that is to quit does.
static func apply(sync: ConsacSync) -> String:
	var first := ""
	for argument in OS.get_cmdline_user_args():
		if not argument.begins_with(PREFIX):
			continue
		var parts := argument.trim_prefix(PREFIX).split("=", true, 1)
		var fault := "expected --consac-NAME=VALUE"
		if parts.size() == 2:
			fault = _assign(sync, parts[0], parts[1])
		if not fault.is_empty() and first.is_empty():
			first = "argument '%s': %s" % [argument, fault]
	return first


## All arguments with what a scene's [param sync] has of each and what it takes, a line each.
static func help(sync: ConsacSync) -> String:
	var lines := PackedStringArray(["Arguments behind --, as this scene sets them, and what they take:"])
	for argument: String in ARGUMENTS:
		var value: Variant = sync.get(ARGUMENTS[argument])
		var takes := ""
		if argument in ["mode", "protocol"]:
			var names := _names(argument)
			takes = ", ".join(names)
			value = names[value]
		else:
			match typeof(value):
				TYPE_STRING:
					takes = "text"
				TYPE_DICTIONARY:
					takes = "NAME:VALUE,NAME:VALUE"
					value = ",".join((value as Dictionary).keys().map(
							func(key: Variant) -> String: return "%s:%s" % [key, sync.get(ARGUMENTS[argument])[key]]))
				TYPE_BOOL:
					takes = "0, 1"
					value = int(value)
				_:
					var bounds := _bounds(sync, ARGUMENTS[argument])
					takes = "a whole number" if value is int else "a number"
					if bounds.size() >= 2:
						takes += ", %s to %s" % [_plain(bounds[0]), _plain(bounds[1])]
		lines.append("  %s  %s" % [("%s%s=%s" % [PREFIX, argument, value]).rpad(34), takes])
	return "\n".join(lines)


static func _names(argument: String) -> PackedStringArray:
	var names: Array = ConsacSync.Mode.keys() if argument == "mode" else ConsacSync.Protocol.keys()
	return ", ".join(names).to_lower().split(", ")


static func _assign(sync: ConsacSync, argument: String, text: String) -> String:
	if not ARGUMENTS.has(argument):
		return "there are " + ", ".join(ARGUMENTS.keys())
	var property: StringName = ARGUMENTS[argument]
	if argument in ["mode", "protocol"]:
		var index := _names(argument).find(text.to_lower())
		if index < 0:
			return "there are " + ", ".join(_names(argument))
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
			if not text in ["0", "1", "false", "true", "no", "yes"]:
				return "expected 1 or 0"
			sync.set(property, text in ["1", "true", "yes"])
		_:
			return _assign_number(sync, property, text)
	return ""


# Whole numbers may be written as 1e6; what the inspector would not take is refused.
static func _assign_number(sync: ConsacSync, property: StringName, text: String) -> String:
	if not text.is_valid_float() or not is_finite(text.to_float()):
		return "'%s' is no number" % text
	var number := text.to_float()
	var whole := typeof(sync.get(property)) == TYPE_INT
	if whole and (number != floorf(number) or absf(number) > 9e15):
		return "'%s' is no whole number" % text
	var bounds := _bounds(sync, property)
	if bounds.size() >= 2 and (number < bounds[0] or number > bounds[1]):
		return "expected %s to %s" % [_plain(bounds[0]), _plain(bounds[1])]
	sync.set(property, int(number) if whole else number)
	return ""


# What the inspector takes: least and most; empty where it takes everything.
static func _bounds(sync: ConsacSync, property: StringName) -> PackedFloat64Array:
	for known: Dictionary in sync.get_property_list():
		if known.name == property and known.hint == PROPERTY_HINT_RANGE:
			return (known.hint_string as String).split_floats(",")
	return PackedFloat64Array()


static func _plain(number: float) -> String:
	return str(int(number)) if number == floorf(number) else str(number)


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
