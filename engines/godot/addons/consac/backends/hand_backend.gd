class_name ConsacHandBackend
extends ConsacBackend
## The mode "by hand": each agent's [method ConsacAgent.heuristic] chooses, so that a person plays,
## or a rule. Also where there is nobody yet, or nobody but those that act by models and rules of their own.

var _agents: Array[ConsacAgent] = []
var _begun := false
var _doing: String
var _told := {}  # what people were told of


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


# What a trainer would refuse, or be told of, is played on with, but not in silence.
func offer() -> void:
	for agent in _agents:
		_warn(agent, agent.row, agent.all_observations, "observe()")


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
		_warn(agent, agent.action_row, agent.actions, "heuristic()")
	return Cue.ACT


# Once for each entry of a behaviour.
func _warn(agent: ConsacAgent, row: PackedFloat32Array, entries: Array[ConsacEntry], source: String) -> void:
	var at := 0
	for entry in entries:
		var key := [agent.behaviour, source, entry.name]
		var until := at + entry.numbers()
		if entry.kind == ConsacEntry.Kind.BOX and not _told.has(key):
			for i in range(at, until):
				if row[i] >= entry.low and row[i] <= entry.high:  # and no NaN
					continue
				_told[key] = true
				push_warning("%s: %s gave %s for entry '%s', whose bounds are %s to %s; %s" % [agent.path_in_world(), source, row[i],
						entry.name, entry.low, entry.high, "widen them, or keep within them" if is_finite(row[i])
						else "mend where it comes from: who learns stops there"])
				break
		at = until
