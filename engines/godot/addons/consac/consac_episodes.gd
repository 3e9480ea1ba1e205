class_name ConsacEpisodes
extends RefCounted
## The steps and episodes of a [ConsacSync]'s agents: they begin, are judged once the world has moved, see what came of it,
## and begin anew where an episode ended. Each part is done for all of them before the next one, since agents of one world
## may look at one another.

const STEPS_KEPT := 1000  # of whose rewards the last line tells the mean
const NEVER := 9223372036854775807

## Rewards of the latest steps, around and around.
var rewards := PackedFloat32Array()

var _sync: ConsacSync
var _roster: ConsacRoster
var _seeds := RandomNumberGenerator.new()
var _next_checkpoint := NEVER


func _init(sync: ConsacSync, roster: ConsacRoster) -> void:
	_sync = sync
	_roster = roster
	rewards.resize(STEPS_KEPT)


## A session begins, and with it an episode of every agent; [param fault] is what is wrong already, or "".
func begin(first_seed: int, fault: String) -> void:
	_next_checkpoint = _sync.checkpoint_every if _sync.checkpoint_every > 0 else NEVER
	_seeds.seed = first_seed
	for i in _roster.driven.size():
		var drawn := _seeds.randi()
		var given := _sync.backend.seed_for(i)
		_roster.driven[i].start_episode(drawn if given < 0 else given)
	for agent in _roster.players.agents:
		_roster.players.begin_episode(agent)
		agent.start_episode(_seeds.randi())
	_look_at_first(_roster.agents, fault)


## [param agent] has come in the midst of a session. What is wrong with what it sees, or "".
func begin_newcomer(agent: ConsacAgent) -> String:
	_roster.newcomers[agent] = true
	agent.start_episode(_seeds.randi())
	return agent.look()


## After the world has moved: rewards and ends of all agents, then what they see, then the next episodes.
func look() -> void:
	var fault := ""
	var ended := false
	var newcomers := _roster.newcomers
	var fresh := not newcomers.is_empty()
	for agent in _roster.agents:
		if fresh and newcomers.has(agent):
			agent.forget_step()  # nobody asked it for one
			continue
		var what := agent.account()
		if not what.is_empty():
			fault = what
		ended = ended or agent.terminated or agent.truncated
	if _roster.sees_pictures:
		_draw()
	var steps := _sync.steps
	var learning := _sync.learning
	for agent in _roster.agents:
		var what := agent.look()
		if not what.is_empty():
			fault = what
		if fresh and newcomers.has(agent):
			continue
		agent.settle()
		if not (agent.played and learning):
			rewards[steps % STEPS_KEPT] = agent.reward
			steps += 1
	_sync.steps = steps
	if steps >= _next_checkpoint:
		_checkpoint(steps)
	if ended:
		_begin_next(fault)
	else:
		_sync.offer(fault)


# Where an episode has ended the next one begins.
func _begin_next(fault: String) -> void:
	var beginning: Array[ConsacAgent] = []
	for agent in _roster.agents:
		if agent.terminated or agent.truncated:
			if _sync.counts(agent):
				_sync.report.note_episode(agent)
			if agent.played:
				_roster.players.begin_episode(agent)
			agent.next_episode(agent.rng.randi())
			if not ConsacLeaving.of(agent):
				beginning.append(agent)
				continue
			_roster.miss()
			if _sync.agents_may_leave() and not agent.played:
				var what := _sync.backend.farewell(agent)
				fault = what if fault.is_empty() else fault
	if _sync.agents_may_leave():  # they take no further step, however many there are before a frame
		var what := _roster.let_go()
		fault = what if fault.is_empty() else fault
	_look_at_first(beginning, fault)


# What agents see where their episodes begin. Where they see pictures that is a tick later: only then is everything that
# reset() has changed ready to be drawn.
func _look_at_first(beginning: Array[ConsacAgent], fault: String) -> void:
	if _roster.sees_pictures:
		_sync.go_on_later(_look_and_offer.bind(beginning.duplicate(), fault))
	else:
		_look_and_offer(beginning, fault)


func _look_and_offer(beginning: Array[ConsacAgent], fault: String) -> void:
	if _roster.sees_pictures:
		_draw()
	for agent in beginning:
		if is_instance_valid(agent):
			var what := agent.look()
			fault = what if fault.is_empty() else fault
	_sync.offer(fault)


# Pictures show the world as it is, not as it was when the latest frame was drawn.
func _draw() -> void:
	ConsacCameraSensor.draw_now(_sync.get_parent(), not _sync.learning)


func _checkpoint(steps: int) -> void:
	var every := _sync.checkpoint_every
	_next_checkpoint += every * ((steps - _next_checkpoint) / every + 1)
	var fault := _sync.backend.checkpoint(steps)
	if not fault.is_empty():
		printerr("consac: ", fault)
