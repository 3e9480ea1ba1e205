class_name ConsacPlayers
extends RefCounted
## The agents of a [ConsacSync] that its backend does not drive: each acts by a model or by its own rule. Beside agents
## that learn they are the opponents; in a game in which models act they are whoever came after the beginning.

# One model and those who act by it.
class Team:
	extends ConsacRows
	var model: RefCounted

## All of them.
var agents: Array[ConsacAgent] = []

var _teams := {}  # what a model is known by: Team


## [param agent], which is prepared, acts by its own rule from now on.
func take_by_hand(agent: ConsacAgent) -> void:
	_add(agent)


## [param agent], which is prepared, acts by the model in the file at [param path] from now on, or by the one in [param
## bytes] where that is no file of its own. Why it cannot, or "".
func take_by_model(agent: ConsacAgent, path: String, bytes := PackedByteArray()) -> String:
	if not ClassDB.class_exists(ConsacSync.NATIVE_MODEL):
		return "%s is to act by a model, which needs the native extension; see engines/godot/README.md" % agent.path_in_world()
	var key := [path if not path.is_empty() else str(hash(bytes)), ConsacEntry.tables(agent.all_observations),
			ConsacEntry.tables(agent.actions), agent.masks_actions]
	var team: Team = _teams.get(key)
	if team == null:
		team = Team.new()
		team.model = ClassDB.instantiate(ConsacSync.NATIVE_MODEL)
		var fault: String = team.model.load_bytes(bytes) if path.is_empty() else team.model.load(path)
		if fault.is_empty():
			fault = team.model.arrange({
				name = agent.behaviour, masks_actions = agent.masks_actions,
				observations = ConsacEntry.tables_for(agent.all_observations, team.model.describe().observations),
				actions = ConsacEntry.tables_for(agent.actions, team.model.describe().actions)})
		if not fault.is_empty():
			return "%s cannot act by this model: %s" % [agent.path_in_world(), fault]
		team.take_form(agent)
		_teams[key] = team
	var place := team.agents.find(null)
	if place < 0:
		team.agents.append(agent)
	else:
		team.agents[place] = agent
		team.model.begin_episode(place)
	_add(agent)
	return ""


## Those that are no longer in the scene are forgotten.
func let_go() -> void:
	for i in range(agents.size() - 1, -1, -1):
		if not is_instance_valid(agents[i]) or ConsacLeaving.of(agents[i]):
			agents.remove_at(i)
	for team: Team in _teams.values():
		for i in team.agents.size():
			if not is_instance_valid(team.agents[i]) or ConsacLeaving.of(team.agents[i]):
				team.agents[i] = null


## [param agent] begins an episode: a model that remembers forgets what was before.
func begin_episode(agent: ConsacAgent) -> void:
	for team: Team in _teams.values():
		var place := team.agents.find(agent)
		if place >= 0:
			team.model.begin_episode(place)


## Fills the [member ConsacAgent.action_row] of all of them. What is wrong, or "".
func choose() -> String:
	var fault := ""
	for team: Team in _teams.values():
		var what := _ask(team)
		fault = what if fault.is_empty() else fault
	for agent in agents:
		if agent.by_rule:
			var what := agent.ask_heuristic()
			fault = what if fault.is_empty() else fault
	return fault


func _add(agent: ConsacAgent) -> void:
	agent.played = true
	agents.append(agent)


func _ask(team: Team) -> String:
	var chosen: PackedFloat32Array = team.model.predict_with(team.observations(), team.pictures(), team.masks(), false)
	if chosen.size() != team.agents.size() * team.numbers:
		return team.model.last_error()
	team.hand_out(chosen)
	return ""
