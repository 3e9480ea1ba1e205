class_name ConsacRemote
extends RefCounted
## The game's end of the editor's dock: a game that the editor has started tells how it goes, and hears when to stop.

## What messages begin with, in both directions.
const PREFIX := "consac"


## Tells the dock why a game did not begin, where an editor listens.
static func tell_of_failure(fault: String) -> void:
	if EngineDebugger.is_active():
		EngineDebugger.send_message(PREFIX + ":failed", [fault])


## Connects [param sync] where an editor listens.
static func connect_to_editor(sync: ConsacSync) -> void:
	if not EngineDebugger.is_active():
		return
	if EngineDebugger.has_capture(PREFIX):
		EngineDebugger.unregister_message_capture(PREFIX)  # of a sync that is gone
	EngineDebugger.register_message_capture(PREFIX, func(message: String, _data: Array) -> bool:
		if message == "stop" and is_instance_valid(sync):
			sync._interrupt.call_deferred(0)
		return message == "stop")
	sync.progressed.connect(func(numbers: Dictionary) -> void:
		EngineDebugger.send_message(PREFIX + ":progress", [numbers, sync.training_length]))
	sync.session_ended.connect(func(fault: String) -> void:
		EngineDebugger.send_message(PREFIX + ":ended", [fault]))
	EngineDebugger.send_message(PREFIX + ":began", [sync.state()])
