class_name ConsacGroups
extends RefCounted
## Agents of a [ConsacSync] that win and lose together: who is paid, and what a group has earned since the latest decision.

var _earned := {}  # name: reward


## Pays every agent of [param group] that takes part.
func pay(group: StringName, amount: float, roster: ConsacRoster) -> void:
	for agent in roster.agents:
		if agent.group == group and not roster.newcomers.has(agent):
			agent.add_reward(amount)
	_earned[group] = _earned.get(group, 0.0) + amount


## A decision is about to be carried out, or an episode to begin: what was earned before belongs to none.
func forget() -> void:
	_earned.clear()


## What [param group] has earned since.
func earned(group: StringName) -> float:
	return _earned.get(group, 0.0)


## The groups of agents that stand at these places as the native class takes them, [param herds] by behaviour. None of
## agents of one behaviour alone, each of which is a world of its own for who trains.
static func tables(herds: Array) -> Array[Dictionary]:
	var all: Array[Dictionary] = []
	if herds.size() < 2:
		return all
	var at := {}
	for b in herds.size():
		for place: int in herds[b].agents.size():
			var agent: ConsacAgent = herds[b].agents[place]
			if agent == null or agent.group == &"":
				continue
			if not at.has(agent.group):
				at[agent.group] = all.size()
				all.append({name = agent.group, agents = []})
			all[at[agent.group]].agents.append_array([b, place])
	return all
