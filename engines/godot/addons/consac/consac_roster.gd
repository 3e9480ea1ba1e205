class_name ConsacRoster
extends RefCounted
## The agents of a [ConsacSync]: who is there, who chooses for each, who comes and who goes.

## All that are there.
var agents: Array[ConsacAgent] = []
## Of these, those that the sync's backend drives.
var driven: Array[ConsacAgent] = []
## And the others, who choose for themselves.
var players := ConsacPlayers.new()
## Agents that have not been offered yet, as keys.
var newcomers := {}
## Whether some agent has seen by a camera.
var sees_pictures := false

var _sync: ConsacSync
var _arrived: Array[ConsacAgent] = []  # since the latest tick
var _one_left := false
var _turned_away := {}  # agents for which there was no room
var _said := {}  # why


func _init(sync: ConsacSync) -> void:
	_sync = sync


## Takes in all agents below the sync's parent, when it begins. What is wrong, or "".
func gather() -> String:
	for node in _sync.get_tree().get_nodes_in_group(ConsacAgent.GROUP):
		if _sync.get_parent().is_ancestor_of(node):
			var fault := _take_in(node)
			if not fault.is_empty():
				return fault
	if driven.is_empty() and _sync.learning:
		var root := _sync.get_parent().name
		if agents.is_empty():
			return "no ConsacAgent below %s; put the ConsacSync beside or above the agents" % root
		return "all agents below %s act by models or rules of their own, so none can learn" % root
	return ""


## An agent has come into the scene.
func meet(agent: ConsacAgent) -> void:
	_arrived.append(agent)


## An agent has left it.
func miss() -> void:
	_one_left = true


## Whether somebody has come or gone since [method let_go] and [method welcome].
func has_changed() -> bool:
	return _one_left or not _arrived.is_empty()


## Forgets agents that are no longer in the scene. What is wrong with that, or "".
func let_go() -> String:
	if not _one_left:
		return ""
	_one_left = false
	var before := driven.size()
	for list: Array[ConsacAgent] in [agents, driven]:
		for i in range(list.size() - 1, -1, -1):
			if not is_instance_valid(list[i]) or ConsacLeaving.of(list[i]):
				list.remove_at(i)
	players.let_go()
	if driven.size() == before:
		return ""
	if not _sync.agents_may_leave():
		return "an agent has left the scene; where agents come and go, set room_for_agents"
	for agent: Variant in _turned_away:
		if is_instance_valid(agent):
			_arrived.append(agent)  # may find room now
	_turned_away.clear()
	return _sync.backend.let_go()


## Takes in agents that have come into the scene, and returns them. One that finds no place is told so and left alone.
func welcome() -> Array[ConsacAgent]:
	var taken: Array[ConsacAgent] = []
	var some := _arrived
	_arrived = []
	for agent: Variant in some:
		if not is_instance_valid(agent) or not agent.is_inside_tree() or agent in agents:
			continue
		if not _sync.get_parent().is_ancestor_of(agent):
			continue
		var fault := _welcome(agent)
		if fault.begins_with(agent.path_in_world()):
			fault = "it" + fault.trim_prefix(agent.path_in_world())
		if not fault.is_empty():
			if not _said.has(fault):  # a wave of them would be a flood of lines
				printerr("consac: %s takes no part: %s; said of the first" % [agent.path_in_world(), fault])
			_said[fault] = true
			_turned_away[agent] = true
			continue
		agents.append(agent)
		sees_pictures = sees_pictures or agent.sees_pictures()
		taken.append(agent)
	return taken


# An agent that was there from the beginning. What is wrong, or "".
func _take_in(agent: ConsacAgent) -> String:
	if is_instance_valid(agent.driven_by) and agent.driven_by != _sync and agent.driven_by.is_running():
		return "%s is driven by %s already; one ConsacSync is enough" % [agent.path_in_world(), agent.driven_by.name]
	var fault := _prepare(agent)
	if not fault.is_empty():
		return fault
	agents.append(agent)
	sees_pictures = sees_pictures or agent.sees_pictures()
	if agent.control == ConsacAgent.ControlMode.AS_THE_SYNC:
		driven.append(agent)
		return ""
	return _let_play(agent)


func _welcome(agent: ConsacAgent) -> String:
	var fault := _prepare(agent)
	if not fault.is_empty():
		return fault
	if agent.control != ConsacAgent.ControlMode.AS_THE_SYNC:
		return _let_play(agent)
	if not _sync.agents_may_leave():
		return "it has come while others learn; where agents come and go, set room_for_agents"
	if not _sync.learning and (driven.is_empty() or _sync.room_for_agents == 0):
		return _let_play(agent)
	fault = _sync.backend.join(agent)
	if fault.is_empty():
		driven.append(agent)
	return fault


func _prepare(agent: ConsacAgent) -> String:
	agent.driven_by = _sync
	agent.played = false
	return agent.prepare()


# An agent that the backend does not drive. What is wrong, or "".
func _let_play(agent: ConsacAgent) -> String:
	if agent.control == ConsacAgent.ControlMode.MODEL:
		return players.take_by_model(agent, agent.model.file(), agent.model.bytes)
	if agent.control == ConsacAgent.ControlMode.AS_THE_SYNC and _sync.mode == ConsacSync.Mode.ACT:
		return players.take_by_model(agent, ConsacNativeBackend.path_of(_sync.path_to_model(), agent.behaviour),
				PackedByteArray() if _sync.model == null else _sync.model.bytes)
	agent.by_rule = true
	players.take_by_hand(agent)
	return ""
