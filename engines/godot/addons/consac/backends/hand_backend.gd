class_name ConsacHandBackend
extends ConsacBackend
## The mode "by hand": each agent's [method ConsacAgent.heuristic] chooses, so that a person plays,
## or a rule. Also where there is nobody yet, or nobody but those that act by models and rules of their own.

var _agents: Array[ConsacAgent] = []
var _begun := false
var _doing: String


func _init(doing := "by hand") -> void:
	_doing = doing


func begin(agents: Array[ConsacAgent]) -> String:
	_agents = agents
	_begun = false
	state = _doing
	return ""


func join(_agent: ConsacAgent) -> String:
	return ""


func let_go() -> String:
	return ""


func poll(_wait_s: float) -> Cue:
	if not error.is_empty():
		return Cue.FAILED
	if not _begun:
		_begun = true
		return Cue.RESET
	for agent in _agents:
		var fault := agent.ask_heuristic()
		if not fault.is_empty():
			error = fault
			return Cue.FAILED
	return Cue.ACT
