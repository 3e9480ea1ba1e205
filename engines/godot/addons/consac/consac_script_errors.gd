class_name ConsacScriptErrors
extends Logger
## Hears of errors in scripts while agents are asked. GDScript leaves the function that has one and goes on, so that an
## agent has seen, done or earned something else than it was meant to, and nobody is told but the log.

## Whether agents are being asked, on the main thread.
var listening := false
## Whether there was an error since [method take].
var has_heard := false

var _earliest := ""
var _attached := false


## From now on it hears.
func attach() -> void:
	if not _attached:
		OS.add_logger(self)
	_attached = true


## It hears no more.
func detach() -> void:
	if _attached:
		OS.remove_logger(self)
	_attached = false


## The first error since the last call: which script, line and function, and what it was; "" where there was none.
func take() -> String:
	var taken := _earliest
	_earliest = ""
	has_heard = false
	return taken


func _log_error(function: String, file: String, line: int, code: String, rationale: String, _editor_notify: bool,
		error_type: int, _script_backtraces: Array[ScriptBacktrace]) -> void:
	if OS.get_thread_caller_id() != OS.get_main_thread_id() or not listening or error_type != ERROR_TYPE_SCRIPT:
		return
	if not has_heard:
		has_heard = true
		_earliest = "an error in %s, line %d, %s(): %s" % [file, line, function, code if rationale.is_empty() else rationale]
