@tool
@icon("res://addons/consac/icon.svg")
class_name ConsacModelFile
extends Resource
## A trained model: a file [code]NAME.consac[/code] in the project, as the file system dock shows it. The file itself is
## the resource: [method ResourceLoader.load] reads it, an exported game takes it along.

## The file's bytes. A copy that was made unique, or lies in another resource, has them too.
@export_storage var bytes := PackedByteArray()
## Whose model it is.
@export_custom(PROPERTY_HINT_NONE, "", PROPERTY_USAGE_EDITOR | PROPERTY_USAGE_READ_ONLY) var behaviour := ""
## What it observes and does, in the words of [method ConsacModel.describe].
@export_custom(PROPERTY_HINT_MULTILINE_TEXT, "", PROPERTY_USAGE_EDITOR | PROPERTY_USAGE_READ_ONLY) var observes := ""
@export_custom(PROPERTY_HINT_MULTILINE_TEXT, "", PROPERTY_USAGE_EDITOR | PROPERTY_USAGE_READ_ONLY) var does := ""
## How it was trained, as the file tells it.
@export_custom(PROPERTY_HINT_MULTILINE_TEXT, "", PROPERTY_USAGE_EDITOR | PROPERTY_USAGE_READ_ONLY) var training := ""


## The .consac file that it is; "" for a copy, which is none.
func file() -> String:
	return "" if resource_path.contains("::") or resource_path.get_extension() != "consac" else resource_path


## Reads a file's bytes. What is wrong with them, or "".
func take(content: PackedByteArray) -> String:
	bytes = content
	if not ClassDB.class_exists(&"ConsacModel"):
		return ""  # without the native extension it can be carried, and not looked into
	var model: RefCounted = ClassDB.instantiate(&"ConsacModel")
	var fault: String = model.load_bytes(content)
	if not fault.is_empty():
		return fault
	var described: Dictionary = model.describe()
	behaviour = described.behaviour
	observes = _lines(described.observations)
	does = _lines(described.actions)
	training = described.training
	return ""


static func _lines(entries: Array) -> String:
	var lines := PackedStringArray()
	for entry: Dictionary in entries:
		var shape: String = "%d choices" % entry.n if entry.has("n") else str(entry.get("shape", entry.get("nvec", "")))
		lines.append("%s: %s %s" % [entry.name if entry.name != "" else "(one without a name)", entry.type, shape])
	return "\n".join(lines)
