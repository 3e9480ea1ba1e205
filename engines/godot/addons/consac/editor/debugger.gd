@tool
extends EditorDebuggerPlugin
## The editor's end of ConsacRemote.

## What a running game says: "began", "progress" or "ended", and its data.
signal heard(message: String, data: Array)


func _has_capture(prefix: String) -> bool:
	return prefix == ConsacRemote.PREFIX


func _capture(message: String, data: Array, _session: int) -> bool:
	heard.emit(message.trim_prefix(ConsacRemote.PREFIX + ":"), data)
	return true


## Asks every running game to save what it has learned and to end.
func stop_games() -> void:
	for session: EditorDebuggerSession in get_sessions():
		if session.is_active():
			session.send_message(ConsacRemote.PREFIX + ":stop", [])
