@tool
@icon("res://addons/consac/icon.svg")
class_name ConsacSync
extends Node
## Drives the agents of a scene in lock step with whoever chooses their actions. One in a scene,
## anywhere in it; it finds the agents below its parent. While nobody chooses, the world stands
## still.

## Who chooses the actions.
enum Mode {
	SERVE,  ## a trainer that connects: [code]consac train tcp://127.0.0.1:5005[/code]
	TRAIN,  ## a learner inside the engine; needs the native extension
	ACT,  ## the model at [member model_path]; needs the native extension
	BY_HAND,  ## [method ConsacAgent.heuristic]
}
## What is spoken with a trainer.
enum Protocol {
	AUTO,  ## protocol 2 where the native extension is there, else text protocol 1
	TEXT1,  ## text protocol 1 in GDScript
}

## A session has begun.
signal session_began
## A session is over; [param fault] is "" when it ended as it should.
signal session_ended(fault: String)

## Every sync is in this group.
const GROUP := &"consac_syncs"
## The native extension's classes and the script that uses them.
const NATIVE_CLASS := &"ConsacWorld"
const NATIVE_MODEL := &"ConsacModel"
const NATIVE_LIBRARY := "res://addons/consac/bin/consac.gdextension"
const NATIVE_BACKEND := "res://addons/consac/backends/native_backend.gd"
const LATEST := 100  # episodes of the mean reward on the screen
const WINDOW_BUDGET_S := 0.01  # of a frame that is spent on waiting and looping, where the window follows the clock
const FAST_BUDGET_S := 0.1  # and where it need not
const IDLE_USEC := 2000  # a sleep per tick without a trainer, where no window paces the engine

## Who chooses the actions.
@export var mode: Mode = Mode.SERVE
## Port to listen on; 0 takes a free one and prints it.
@export_range(0, 65535) var port: int = 5005
## What is spoken with a trainer.
@export var protocol: Protocol = Protocol.AUTO
## Physics ticks from one decision to the next.
@export_range(1, 1000) var decision_period: int = 1
## While something learns, physics ticks of the usual length follow one another as fast as they can
## be computed.
@export var as_fast_as_possible: bool = true
## For worlds that need no physics, whose [method ConsacAgent.act] moves them: many steps within one
## frame. Where a model or a person acts, [member decision_period] still sets the pace.
@export var loop_mode: bool = false
## Actions to train for.
@export var training_length: int = 20000
## Name of the model for the trainer; "" lets the trainer choose.
@export var model_name: String = ""
## Where the model lies that acts, and where training inside the engine saves one, as
## NAME.stopped.consac when it is stopped before the end. Where a scene has
## several behaviours, {behaviour} in it stands for the name of each.
@export_file("*.consac") var model_path: String = ""
## Of training inside the engine: an algorithm and all its hyperparameters, as properties. Without it
## [member algorithm] with its defaults.
@export var settings: ConsacHyperparameters
## Of training inside the engine: an algorithm that [code]consac list algorithms[/code] knows.
@export var algorithm: String = "ppo2"
## Of training inside the engine: values by name, as the program [code]consac[/code] takes them; they
## go before [member settings].
@export var hyperparameters: Dictionary = {}
## Of training inside the engine: while it learns, the agents go on. Algorithms that learn in rounds
## (ppo) then act by their latest model and learn nothing from these steps; those that learn at every
## step (dqn) lose none. Else the world stands still and every step is learned from.
@export var act_while_learning: bool = false
## Where what the agents saw and did is saved (spec/demonstration.md); "" for nowhere. Needs the
## native extension.
@export var record_path: String = ""
## Agents come and go while it runs, at most so many of each behaviour at once; 0: all stay as long as
## this node. Needs the native extension. Each behaviour has an agent when it begins.
@export_range(0, 65536) var room_for_agents: int = 0
## Of everything random in the episodes.
@export var world_seed: int = 1
## Sessions in which the world has stepped, after which it stops; 0 for never.
@export var sessions: int = 0
## Quits the program when it stops, as a program without a window wants; exit code 1 when a session
## failed.
@export var quit_at_end: bool = false
## Seconds of a trainer's silence after which it has left.
@export var deadline_s: float = 60.0
## Shows state, steps a second and mean reward on the screen.
@export var show_budget: bool = true

## Decisions of this session, of all agents.
var steps: int = 0
## Rewards of the latest episodes.
var episode_rewards := PackedFloat32Array()
## The agents that are there, once it has begun.
var agents: Array[ConsacAgent] = []
## Who chooses, once it has begun.
var backend: ConsacBackend

var _refused_argument := ""
var _begun := false
var _stopped := false
var _in_session := false
var _waiting := true  # for an answer of the backend; else the world moves
var _ticks_left := 0
var _held := false
var _was_paused := false
var _paused := false  # by somebody else
var _met := {}  # instance ids of agents that need no welcome: they are there, or were turned away
var _newcomers := {}  # agents that have not been offered yet
var _over := 0  # sessions that are over, of those that have stepped
var _exit_code := 0
var _step_rewards := PackedFloat32Array()  # of the latest steps, around and around
var _began_usec := 0
var _seeds := RandomNumberGenerator.new()
var _speed := ConsacSpeed.new()
var _budget: ConsacBudget


func _ready() -> void:
	if Engine.is_editor_hint():
		set_physics_process(false)
		return
	process_mode = Node.PROCESS_MODE_ALWAYS
	process_physics_priority = -1000  # before the world's own nodes
	_step_rewards.resize(1000)
	add_to_group(GROUP)
	_refused_argument = ConsacCommandLine.apply(self)
	if show_budget:
		_budget = ConsacBudget.new()
		add_child(_budget)


func _exit_tree() -> void:
	if not Engine.is_editor_hint():
		stop()


func _get_configuration_warnings() -> PackedStringArray:
	if mode in [Mode.TRAIN, Mode.ACT] and not has_native():
		return ["This mode needs the native extension; see engines/godot/README.md."]
	return []


## Whether the native extension is loaded.
static func has_native() -> bool:
	return ClassDB.class_exists(NATIVE_CLASS) and ResourceLoader.exists(NATIVE_BACKEND)


## What it does at the moment, in a few words.
func state() -> String:
	return "stopped" if backend == null or _stopped else backend.state


## Of the latest 100 episodes.
func mean_episode_reward() -> float:
	return _mean(episode_rewards, episode_rewards.size())


## Ends the session and puts everything back that was changed.
func stop() -> void:
	_stopped = true
	if backend != null:
		backend.close()
	_speed.restore()
	_hold(false)


func _physics_process(_delta: float) -> void:
	if _stopped:
		return
	if not _begun:
		_begin()
		return
	var fault := _say_goodbye()
	if not fault.is_empty():
		_finish(fault)
		return
	if room_for_agents > 0:
		_welcome_newcomers()
	_note_pause()
	if _paused:
		return
	if not _waiting:
		_ticks_left -= 1
		if _ticks_left > 0:
			return
		_look()
	_drive()
	if _budget != null:
		_budget.show_state(self)


## The first tick: every node of the scene is ready.
func _begin() -> void:
	_begun = true
	_stopped = true  # until everything is ready
	for node in get_tree().get_nodes_in_group(ConsacAgent.GROUP):
		if get_parent().is_ancestor_of(node):
			agents.append(node)
			_met[node.get_instance_id()] = true
	var fault := _refused_argument
	if fault.is_empty() and agents.is_empty():
		fault = "no ConsacAgent below %s; put the ConsacSync beside or above the agents" % get_parent().name
	for agent in agents:
		if fault.is_empty() and is_instance_valid(agent.driven_by) and agent.driven_by != self:
			fault = "%s is driven by %s already; one ConsacSync is enough" % [agent.name, agent.driven_by.name]
		if fault.is_empty():
			agent.driven_by = self
			fault = agent.prepare()
	if fault.is_empty():
		fault = _choose_backend()
	if fault.is_empty():
		fault = backend.begin(agents)
	if fault.is_empty():
		_stopped = false
		print("consac: ", backend.state)
		_hold(true)
	else:
		_finish(fault)


func _choose_backend() -> String:
	if mode == Mode.BY_HAND and (record_path.is_empty() or not has_native()):
		backend = ConsacHandBackend.new()
		return ""
	if has_native() and (mode != Mode.SERVE or protocol != Protocol.TEXT1):
		backend = load(NATIVE_BACKEND).new(self)
		return ""
	if mode != Mode.SERVE:
		return "mode %s needs the native extension; %s" % [
				Mode.keys()[mode].to_lower(), _how_to_get_native()]
	var text := ConsacTextBackend.new()
	text.port = port
	text.training_length = training_length
	text.model_name = model_name
	text.deadline_s = deadline_s
	text.first_seed = world_seed
	backend = text
	return ""


static func _how_to_get_native() -> String:
	if FileAccess.file_exists(NATIVE_LIBRARY) and not ClassDB.class_exists(NATIVE_CLASS):
		return "it is there but not loaded: open the project in the editor once, or run godot --headless --import"
	return "build it as engines/godot/README.md says"


## Asks the backend what is next, until the world has to move or nothing has come for a while.
func _drive() -> void:
	var fast := as_fast_as_possible and _learns()
	var until := Time.get_ticks_usec() + int(1e6 * (FAST_BUDGET_S if fast else WINDOW_BUDGET_S))
	while not _stopped:
		match backend.poll(maxf(0.0, (until - Time.get_ticks_usec()) / 1e6) if _in_session else 0.0):
			ConsacBackend.Cue.WAIT:
				_hold(true)
				if not _in_session:
					OS.delay_usec(IDLE_USEC)
				return
			ConsacBackend.Cue.RESET:
				_start_session(fast)
			ConsacBackend.Cue.ACT:
				for agent in agents:
					if not _newcomers.has(agent):
						agent.hand_over()
				if not loop_mode or not _learns():
					_waiting = false
					_ticks_left = decision_period
					_hold(false)
					return
				_look()
				if Time.get_ticks_usec() > until or get_tree().paused:
					return
			ConsacBackend.Cue.DONE:
				_end_session("")
			ConsacBackend.Cue.FAILED:
				if _in_session or mode != Mode.SERVE:
					_end_session(backend.error)
				else:  # a trainer left in the handshake, or was no trainer: that was no session
					printerr("consac: ", backend.error)


# A game in which a model or a person acts keeps its own pace.
func _learns() -> bool:
	return mode in [Mode.SERVE, Mode.TRAIN]


func _start_session(fast: bool) -> void:
	_in_session = true
	_hold(_held)
	_began_usec = Time.get_ticks_usec()
	if _learns():
		_speed.change(fast)
	steps = 0
	episode_rewards.clear()
	_seeds.seed = backend.session_seed if mode != Mode.BY_HAND else world_seed
	session_began.emit()
	var fault := ""
	for i in agents.size():
		var drawn := _seeds.randi()
		var given := backend.seed_for(i)
		agents[i].start_episode(drawn if given < 0 else given)
	for agent in agents:
		fault = _first(fault, agent.look())
	_offer(fault)


## After the world has moved: rewards and ends of all agents, then what they see, then the next
## episodes. Agents of one world may look at one another, so each part is done for all before the
## next one.
func _look() -> void:
	var fault := ""
	var ended := false
	var kept := _step_rewards.size()
	for agent in agents:
		if _newcomers.has(agent):
			agent.forget_step()  # nobody asked it for one
			continue
		var what := agent.account()
		if not what.is_empty():
			fault = what
		_step_rewards[steps % kept] = agent.reward
		steps += 1
		ended = ended or agent.terminated or agent.truncated
	for agent in agents:
		var what := agent.look()
		if not what.is_empty():
			fault = what
	if ended:
		fault = _first(fault, _next_episodes())
	_offer(fault)


func _next_episodes() -> String:
	for agent in agents:
		if agent.terminated or agent.truncated:
			if episode_rewards.size() >= LATEST:
				episode_rewards.remove_at(0)
			episode_rewards.append(agent.total_reward)
			agent.next_episode(agent.rng.randi())
	var fault := ""
	for agent in agents:
		if agent.terminated or agent.truncated:
			fault = _first(fault, agent.look())
	return fault


func _offer(fault: String) -> void:
	_waiting = true
	_newcomers.clear()
	if fault.is_empty():
		backend.offer()
	else:
		backend.refuse(fault)


func _end_session(fault: String) -> void:
	_in_session = false
	_waiting = true
	var counts := steps > 0 or mode != Mode.SERVE  # a trainer that looks in and leaves does not
	if counts:
		_over += 1
	_speed.restore()
	var seconds := maxf(1e-6, (Time.get_ticks_usec() - _began_usec) / 1e6)
	var kept := mini(steps, _step_rewards.size())
	var how := "the session failed"
	if fault.is_empty():
		how = "training completed" if backend.completed else "the session ended"
	print("consac: %s: %d steps in %.2f s (%.0f steps/s)" % [how, steps, seconds, steps / seconds],
			", mean reward of the last %d steps %.3f" % [kept, _mean(_step_rewards, kept)],
			", of the last %d episodes %.2f" % [episode_rewards.size(), mean_episode_reward()])
	if not fault.is_empty():
		printerr("consac: ", fault)
		if counts:
			_exit_code = 1
	session_ended.emit(fault)
	if mode == Mode.BY_HAND or (sessions > 0 and _over >= sessions):
		_finish("")


func _finish(fault: String) -> void:
	if not fault.is_empty():
		printerr("consac: ", fault)
		_exit_code = 1
	stop()
	if quit_at_end:
		get_tree().quit(_exit_code)


## Agents that are no longer in the scene. What is wrong with that, or "".
func _say_goodbye() -> String:
	var before := agents.size()
	for i in range(before - 1, -1, -1):
		if not is_instance_valid(agents[i]) or not agents[i].is_inside_tree():
			agents.remove_at(i)
	if agents.size() == before:
		return ""
	if room_for_agents == 0:
		return "an agent has left the scene; where agents come and go, set room_for_agents"
	_met.clear()  # who was turned away may find room now
	for agent in agents:
		_met[agent.get_instance_id()] = true
	return backend.let_go()


## Agents that have come into the scene. One that finds no place is told so and left alone.
func _welcome_newcomers() -> void:
	for node in get_tree().get_nodes_in_group(ConsacAgent.GROUP):
		if _met.has(node.get_instance_id()) or not get_parent().is_ancestor_of(node):
			continue
		_met[node.get_instance_id()] = true
		var agent: ConsacAgent = node
		var fault := agent.prepare()
		if fault.is_empty():
			fault = backend.join(agent)
		if not fault.is_empty():
			printerr("consac: %s takes no part: %s" % [agent.name, fault])
			continue
		agents.append(agent)
		if _in_session:
			_newcomers[agent] = true
			agent.start_episode(_seeds.randi())
			fault = agent.look()
			if not fault.is_empty():
				backend.refuse(fault)


# A world that the game has paused is frozen: nothing that can be learned from or recorded happens in
# it, and whoever paused it goes on at the usual pace. What the sync holds itself is no such pause.
func _note_pause() -> void:
	var paused := get_tree().paused and not _held
	if paused == _paused:
		return
	_paused = paused
	backend.set_paused(paused)
	if not (_in_session and _learns()):
		return
	if paused:
		_speed.restore()
	else:
		_speed.change(as_fast_as_possible)


## Stops the world without stopping the window. A world that is moved in a loop stands still by itself, and held it
## would hide that the game pauses.
func _hold(held: bool) -> void:
	held = held and not (_in_session and loop_mode and _learns())
	if held == _held or not is_inside_tree():
		return
	_held = held
	if held:
		_was_paused = get_tree().paused
		get_tree().paused = true
	else:
		get_tree().paused = _was_paused


static func _first(fault: String, other: String) -> String:
	return other if fault.is_empty() else fault


static func _mean(values: PackedFloat32Array, count: int) -> float:
	var sum := 0.0
	for i in count:
		sum += values[i]
	return sum / count if count > 0 else 0.0
