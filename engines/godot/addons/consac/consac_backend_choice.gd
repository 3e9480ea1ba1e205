class_name ConsacBackendChoice
extends RefCounted
## Which backend carries out what a [ConsacSync] says, and why none can.


## What stands in the way of every backend, or "".
static func fault(sync: ConsacSync) -> String:
	if not sync.record_path.is_empty():
		if sync.nobody_is_driven():
			return ("record_path is set, and there is no agent to record: of those that are there when it begins, none does "
					+ "as this node says")
		if not ConsacSync.has_native():
			return "record_path is set, and only the native extension records; " + _how_to_get_native()
		if _is_text(sync):
			return ("record_path is set, and only the native extension records; leave protocol as it is, which speaks text "
					+ "protocol 1 too")
	if sync.mode != ConsacSync.Mode.SERVE and not _is_by_hand(sync) and not ConsacSync.has_native():
		return "mode %s needs the native extension; %s" % [ConsacSync.Mode.keys()[sync.mode].to_lower(), _how_to_get_native()]
	return ""


## The backend, where [method fault] is "".
static func make(sync: ConsacSync) -> ConsacBackend:
	if _is_by_hand(sync):
		return ConsacHandBackend.new("acting" if sync.mode == ConsacSync.Mode.ACT else "by hand")
	if ConsacSync.has_native() and not _is_text(sync):
		return load(ConsacSync.NATIVE_BACKEND).new(sync)
	var text := ConsacTextBackend.new()
	text.port = sync.port
	text.training_length = sync.training_length
	text.model_name = sync.model_name
	text.deadline_s = sync.deadline_s
	text.first_seed = sync.world_seed
	text.parameters = sync.parameters
	return text


static func _is_by_hand(sync: ConsacSync) -> bool:
	return sync.mode == ConsacSync.Mode.BY_HAND and sync.record_path.is_empty() or sync.nobody_is_driven()


static func _is_text(sync: ConsacSync) -> bool:
	return sync.mode == ConsacSync.Mode.SERVE and sync.protocol == ConsacSync.Protocol.TEXT1


static func _how_to_get_native() -> String:
	if FileAccess.file_exists(ConsacSync.NATIVE_LIBRARY) and not ClassDB.class_exists(ConsacSync.NATIVE_CLASS):
		return "it is there but not loaded: open the project in the editor once, or run godot --headless --import"
	return "build it as engines/godot/README.md says"
