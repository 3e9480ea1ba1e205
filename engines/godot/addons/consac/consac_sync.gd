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
## Every [member report_every_s], and once more where a training ends: how it goes, as numbers by name (steps, steps_per_s,
## episodes, mean_episode_reward, mean_episode_length, updates, and what [method ConsacAgent.note] was told).
signal progressed(numbers: Dictionary)

## Every sync is in this group.
const GROUP := &"consac_syncs"
## The native extension's classes and the script that uses them.
const NATIVE_CLASS := &"ConsacWorld"
const NATIVE_MODEL := &"ConsacModel"
const NATIVE_LIBRARY := "res://addons/consac/bin/consac.gdextension"
const NATIVE_BACKEND := "res://addons/consac/backends/native_backend.gd"
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
## Of these, physics ticks before each frame. In a frame go [code]_process()[/code], tweens, animations and timers that
## are not set to physics, so with 64 they see only each 64th tick. 0: as the world needs, 1 where a node in it goes with
## frames, else 64. Where such nodes only draw, 64 is faster.
@export_range(0, 64) var ticks_a_frame: int = 0
## For worlds that need no physics, whose [method ConsacAgent.act] moves them: many steps within one
## frame. Where a model or a person acts, [member decision_period] still sets the pace.
@export var loop_mode: bool = false
## Actions to train for; by hand or by a model, where [member sessions] counts, the length of a session.
@export_range(0, 1000000000000, 1, "hide_slider") var training_length: int = 20000
## Name of the model for the trainer; "" lets the trainer choose.
@export var model_name: String = ""
## Where the model lies that acts, and where training inside the engine saves one, as
## NAME.stopped.consac when it is stopped before the end. Where a scene has
## several behaviours, {behaviour} in it stands for the name of each.
@export_file("*.consac") var model_path: String = ""
## Of ACT, instead of the path: a file [code]NAME.consac[/code] dragged here from the file system dock.
@export var model: ConsacModelFile
## Numbers of this world that who trains may set, and vary from episode to episode; [method ConsacAgent.parameter] reads
## them. Text protocol 1 carries none: there, and where a model or a person acts, all are as they are by default.
@export var parameters: Array[ConsacParameter] = []
@export_group("Training inside the engine")
## An algorithm and all its hyperparameters, as properties. Without it
## [member algorithm] with its defaults.
@export var settings: ConsacHyperparameters
## An algorithm that [code]consac list algorithms[/code] knows.
@export var algorithm: String = "ppo2"
## Values by name, as the program [code]consac[/code] takes them; they
## go before [member settings].
@export var hyperparameters: Dictionary = {}
## While it learns, the agents go on. Algorithms that learn in rounds
## (ppo) then act by their latest model and learn nothing from these steps; those that learn at every
## step (dqn) lose none. Else the world stands still and every step is learned from.
@export var act_while_learning: bool = false
## A model to begin with, instead of nothing learned: training goes on from what it knows. {behaviour} stands for the
## name of each.
@export_file("*.consac") var start_from: String = ""
## Steps after which what was learned so far is saved beside [member model_path], as NAME.STEPS.consac; 0 for never.
@export_range(0, 1000000000000, 1, "hide_slider") var checkpoint_every: int = 0
## A folder in which [code]progress.csv[/code] and TensorBoard's events are written, with the names that a run of the program
## has, and what [method ConsacAgent.note] was told as [code]game/NAME[/code]: in a folder of their own for each training, [code]PPO2_1[/code] or the
## next number that is free. [code]tensorboard --logdir FOLDER[/code] shows them. "" for none. The editor does not look into one below
## [code]res://[/code].
@export_global_dir var log_folder: String = ""
## Seconds between lines that say how it goes, and between signals [signal progressed]; 0 for none.
@export_range(0.0, 3600.0) var report_every_s: float = 5.0
## A file (CSV: steps, name, value) for curves of what the lines say; "" for none.
@export_global_file("*.csv") var curve_path: String = ""
@export_group("Agents")
## Where what the agents saw and did is saved (spec/demonstration.md); "" for nowhere. Needs the
## native extension.
@export var record_path: String = ""
## While something learns agents may come and go, at most so many of each behaviour at once; 0: all stay as long as
## this node. Needs the native extension. Each behaviour has an agent when it begins. Where models or people act agents
## come and go as they like, from none on.
@export_range(0, 65536) var room_for_agents: int = 0
@export_group("Sessions")
## Of everything random in the episodes.
@export var world_seed: int = 1
## Sessions in which the world has stepped, after which it stops; 0 for never.
@export var sessions: int = 0
## Quits the program when it stops, as a program without a window wants; exit code 1 when a session
## failed.
@export var quit_at_end: bool = false
## Seconds of a trainer's silence after which it has left.
@export_range(0.001, 1000000.0, 0.001, "hide_slider") var deadline_s: float = 60.0
## Shows state, steps a second and mean reward on the screen.
@export var show_budget: bool = true

## Decisions of this session, of all agents but opponents of those that learn.
var steps: int = 0
## What it has counted of this session.
var report := ConsacReport.new()
## The agents that are there, once it has begun.
var agents: Array[ConsacAgent]:
	get: return _roster.agents
## Who chooses, once it has begun.
var backend: ConsacBackend
## Whether something learns; else a model or a person acts, in a game that keeps its own pace.
var learning := false

var _refused_argument := ""
var _begun := false
var _stopped := false
var _in_session := false
var _waiting := true  # for an answer of the backend; else the world moves
var _ticks_left := 0
var _due := Callable()  # what goes on in a later tick, while the world stands still
var _due_frame := 0  # and not before this frame
var _over := 0  # sessions that are over, of those that have stepped
var _exit_code := 0
var _roster := ConsacRoster.new(self)
var _episodes := ConsacEpisodes.new(self, _roster)
var _groups := ConsacGroups.new()
var _unknown := &""  # the first parameter that an agent has asked for in vain
var _standstill := ConsacStandstill.new()
var _speed := ConsacSpeed.new()
var _wanted_ticks := ConsacSpeed.TICKS_A_FRAME  # before a frame of this session
var _budget: ConsacBudget
var _errors := ConsacScriptErrors.new()


func _ready() -> void:
	if Engine.is_editor_hint():
		set_physics_process(false)
		set_process(false)
		var look := Timer.new()  # what is wrong with a scene changes elsewhere than in this node
		look.wait_time = 1.0
		look.autostart = true
		look.timeout.connect(update_configuration_warnings)
		add_child(look, false, Node.INTERNAL_MODE_BACK)
		return
	process_mode = Node.PROCESS_MODE_ALWAYS
	process_physics_priority = -1000  # before the world's own nodes
	add_to_group(GROUP)
	if ConsacCommandLine.HELP in OS.get_cmdline_user_args():
		print(ConsacCommandLine.help(self))
		_stopped = true
		get_tree().quit()
		return
	_refused_argument = ConsacCommandLine.apply(self)
	if show_budget:
		_budget = ConsacBudget.new()
		add_child(_budget)


func _notification(what: int) -> void:  # not _exit_tree(), which a script of the game's may override
	if what == NOTIFICATION_EXIT_TREE and not Engine.is_editor_hint():
		if is_running():
			var doing := state()
			stop()
			# Where the program ends the tree is gone until then, and nothing is to be said.
			ConsacLeaving.tell.call_deferred(doing, steps, learning, quit_at_end)
		else:
			stop()


func _get_configuration_warnings() -> PackedStringArray:
	var found := ConsacSceneCheck.warnings_of(self)
	if mode in [Mode.TRAIN, Mode.ACT] and not has_native():
		found.append("This mode needs the native extension; see engines/godot/README.md.")
	if mode == Mode.ACT and path_to_model().is_empty():
		found.append("Mode act: set model, or model_path.")
	return found


## Whether the native extension is loaded.
static func has_native() -> bool:
	return ClassDB.class_exists(NATIVE_CLASS) and ResourceLoader.exists(NATIVE_BACKEND)


## What it does at the moment, in a few words.
func state() -> String:
	return "stopped" if backend == null or _stopped else backend.state


## Of the latest 100 episodes.
func mean_episode_reward() -> float:
	return report.mean_episode_reward()


## Where the model lies that acts; "" where none is set, or one that is no file of its own.
func path_to_model() -> String:
	return model.file() if model_path.is_empty() and model != null else model_path


## Whether agents may leave while it runs.
func agents_may_leave() -> bool:
	return room_for_agents > 0 or not learning


## Whether what [param agent] earns is what this session is about: beside agents that learn an opponent's is not.
func counts(agent: ConsacAgent) -> bool:
	return not (agent.played and learning)


## Called by an agent: [method ConsacAgent.note].
func note(metric: StringName, value: float) -> void:
	if report.note_metric(metric, value) and backend != null:
		backend.tell(metric, value)


## Pays every agent of [param group], as [method ConsacAgent.add_group_reward] does: for whoever judges a team.
func add_group_reward(group: StringName, amount: float) -> void:
	if not is_finite(amount):
		printerr("consac: add_group_reward(): %s for the group '%s' is left out; give a number" % [amount, group])
		return
	_groups.pay(group, amount, _roster)


## What [param group] has earned since the agents act, for the backend.
func earned_by(group: StringName) -> float:
	return _groups.earned(group)


## Called by an agent whose episode begins: what that has of [member parameters], by name.
func parameters_of(agent: ConsacAgent) -> Dictionary:
	var values := {}
	for parameter in parameters:
		values[parameter.name] = parameter.default_value
	if not values.is_empty() and backend != null and not agent.played:
		backend.fill_parameters(agent, values)
	return values


## What a parameter is where nobody sets it. A name that there is not ends the session, and each one after it until a script
## adds it: what would be learned is another world's.
func default_of(parameter_name: StringName) -> float:
	for parameter in parameters:
		if parameter != null and parameter.name == parameter_name:
			return parameter.default_value
	if _unknown.is_empty():
		_unknown = parameter_name
	return 0.0


## Whether the backend has no agent to drive: all choose for themselves, or nobody is there yet.
func nobody_is_driven() -> bool:
	return _roster.driven.is_empty()


## Whether it drives a game.
func is_running() -> bool:
	return _begun and not _stopped


## Whether it has ended, or never drove anything and never will.
func is_stopped() -> bool:
	return _stopped


## Called by an agent that comes into the scene.
func meet(agent: ConsacAgent) -> void:
	if _begun:
		_roster.meet(agent)


## Called when an agent leaves the scene.
func miss() -> void:
	_roster.miss()


## Ends the session and puts everything back that was changed.
func stop() -> void:
	_stopped = true
	if backend != null:
		backend.close()
	_speed.restore()
	_hold(false)
	_errors.detach()


func _physics_process(_delta: float) -> void:
	if _stopped:
		return
	_errors.listening = true
	_tick()
	_errors.listening = false


func _tick() -> void:
	if not _begun:
		_begin()
		return
	if _roster.has_changed():
		var fault := _roster.let_go()
		if not fault.is_empty():
			_finish(fault)
			return
		_welcome_newcomers()
	if _standstill.notices(get_tree()):
		_on_pause()
	if _standstill.paused:
		return
	if _speed.frame_a_tick:
		_speed.note_tick()
	if _due.is_valid():
		if Engine.get_process_frames() < _due_frame:
			return
		var due := _due
		_due = Callable()
		due.call()
		if _due.is_valid():
			return
	elif not _waiting:
		_ticks_left -= 1
		if _ticks_left > 0:
			return
		_look()
		if _due.is_valid():
			return
	_drive()


func _process(_delta: float) -> void:
	_look_at_the_clock()


# What the clock decides, and no tick: once a frame, and after each wait, of which there may be many before a frame.
func _look_at_the_clock() -> void:
	if _stopped or not _begun:
		return
	if backend.interrupted():
		_interrupt()
		return
	if _in_session and not _standstill.paused and report.is_due(report_every_s):
		_report()
	if _budget != null:
		_budget.show_state(self)


## The first tick: every node of the scene is ready.
func _begin() -> void:
	learning = mode == Mode.SERVE or mode == Mode.TRAIN
	_begun = true
	_stopped = true  # until everything is ready
	_errors.attach()
	var fault := _refused_argument
	if fault.is_empty():
		fault = _fault_of_scene()
	if fault.is_empty():
		fault = _roster.gather()
	fault = _first(_errors.take(), fault)
	if fault.is_empty():
		fault = ConsacParameter.fault_of(parameters)
	if fault.is_empty() and loop_mode and learning and _roster.sees_pictures:
		fault = "loop_mode leaves no time to draw what a camera sensor sees; turn it off"
	if fault.is_empty():
		fault = ConsacBackendChoice.fault(self)
	if fault.is_empty():
		backend = ConsacBackendChoice.make(self)
		fault = backend.begin(_roster.driven)
	if fault.is_empty():
		_stopped = false
		print("consac: ", backend.state)
		_hold(true)
		ConsacRemote.connect_to_editor(self)
	else:
		ConsacRemote.tell_of_failure(fault)
		_finish(fault)


func _fault_of_scene() -> String:
	for other: ConsacSync in get_tree().get_nodes_in_group(GROUP):
		if other != self and other.is_running():
			quit_at_end = false  # the program is the other's
			return ("%s drives this game already, and two would stop each other; one ConsacSync above all agents is enough: "
					+ "their property control says who chooses for each") % other.get_path()
	return ConsacSceneCheck.fault_of_loop(get_parent()) if loop_mode and learning else ""


## Asks the backend what is next, until the world has to move or nothing has come for a while.
func _drive() -> void:
	var fast := as_fast_as_possible and learning
	var loops := loop_mode and learning
	var now := Time.get_ticks_usec()
	var until := now + int(1e6 * (FAST_BUDGET_S if fast else WINDOW_BUDGET_S))
	while not _stopped:
		match backend.poll(maxf(0.0, (until - now) / 1e6) if _in_session else 0.0):
			ConsacBackend.Cue.WAIT:
				_hold(true)
				_errors.listening = false  # who hears of how it goes is no agent
				_look_at_the_clock()
				if not _in_session:
					OS.delay_usec(IDLE_USEC)
				return
			ConsacBackend.Cue.RESET:
				_in_session = true
				if learning:
					_wanted_ticks = ticks_a_frame
					if ticks_a_frame == 0:
						_wanted_ticks = ConsacSpeed.ticks_for(get_parent(), fast and not loop_mode)
					_speed.change(fast, _wanted_ticks)
				if fast:
					go_on_later(_start_session, 2)  # the frame of the change itself has no sensible length
				else:
					_start_session()
				if _due.is_valid():
					return
			ConsacBackend.Cue.ACT:
				if not _roster.players.agents.is_empty():
					var fault := _roster.players.choose()
					if not fault.is_empty():
						_refuse(fault)
						continue
				var newcomers := _roster.newcomers
				var fresh := not newcomers.is_empty()
				_groups.forget()
				for agent in _roster.agents:  # all before any acts: what one does may pay another
					if not (fresh and newcomers.has(agent)):
						agent.forget_step()
				for agent in _roster.agents:
					if not (fresh and newcomers.has(agent)):
						agent.hand_over()
				if not loops:
					_waiting = false
					_ticks_left = decision_period
					_hold(false)
					return
				_look()  # without pictures, so that nothing is due later
				now = Time.get_ticks_usec()
				if now > until or get_tree().paused:
					return
				continue
			ConsacBackend.Cue.DONE:
				_end_session("")
			ConsacBackend.Cue.FAILED:
				if _in_session or mode != Mode.SERVE:
					_end_session(_first(_errors.take(), backend.error))
				else:  # a trainer left in the handshake, or was no trainer: that was no session
					printerr("consac: ", backend.error)
		now = Time.get_ticks_usec()


## Called by its parts: what is [param due] in the next tick, or so many frames later, while the world stands still.
func go_on_later(due: Callable, frames := 0) -> void:
	_due = due
	_due_frame = Engine.get_process_frames() + frames
	_hold(true)


func _start_session() -> void:
	_hold(_standstill.held)
	_groups.forget()
	steps = 0
	var fault := report.begin(curve_path if learning else "")
	session_began.emit()
	_errors.take()  # what was before is no agent's of this session
	_episodes.begin(backend.session_seed if mode != Mode.BY_HAND else world_seed, fault)


# The world has moved.
func _look() -> void:
	_episodes.look()
	if not learning and sessions > 0 and steps >= training_length:
		_end_session("")


## Called by its parts: what all agents have seen and earned is complete; [param fault] says what is wrong with it, or "".
func offer(fault: String) -> void:
	_waiting = true
	_roster.newcomers.clear()
	fault = _first(fault, _fault_of_unknown())
	if fault.is_empty() and not _errors.has_heard:
		backend.offer()
		for agent in _roster.agents:
			agent.close_account()
	else:
		_refuse(fault)


# Judged when a step is offered: until then a script may still add it.
func _fault_of_unknown() -> String:
	if _unknown.is_empty():
		return ""
	var names := parameters.map(func(one: ConsacParameter) -> String: return one.name)
	if String(_unknown) in names:
		_unknown = &""
		return ""
	return "there is no parameter '%s'; %s has %s" % [_unknown, name,
			"none: add it to parameters" if names.is_empty() else "%s: use one of these, or add it" % ", ".join(names)]


# What is wrong with agents; what is wrong with their scripts is why.
func _refuse(fault: String) -> void:
	backend.refuse(_first(_errors.take(), fault))


func _report() -> void:
	var numbers := _tell()
	if mode == Mode.TRAIN:
		print("consac: ", ConsacReport.line_of(numbers, training_length))
	progressed.emit(numbers)


# Also the next row of the curve.
func _tell() -> Dictionary:
	var updates: int = backend.progress().get("updates", 0)
	return report.tell(steps, {updates = updates} if updates > 0 else {})


func _end_session(fault: String) -> void:
	_in_session = false
	_waiting = true
	var counts := steps > 0 or mode != Mode.SERVE  # a trainer that looks in and leaves does not
	if counts:
		_over += 1
	_speed.restore()
	var how := "the session failed"
	if fault.is_empty():
		how = "training completed" if backend.completed and learning else "the session ended"
	print("consac: %s: %s%s" % [how, report.summary(steps, _episodes.rewards), "" if backend.note.is_empty() else "; " + backend.note])
	if not fault.is_empty():
		printerr("consac: ", fault)
		if counts:
			_exit_code = 1
	if learning and counts:
		progressed.emit(_tell())
	session_ended.emit(fault)
	# Only another trainer may do better: a learner, a model and a rule would meet the same again.
	if (mode != Mode.SERVE and not fault.is_empty()) or (sessions > 0 and _over >= sessions):
		_finish("")
	elif not learning and fault.is_empty():
		_go_on()


# Where nobody learns a session is only a number of steps: the next one follows at once.
func _go_on() -> void:
	_in_session = true
	steps = 0
	report.begin()
	session_began.emit()


func _finish(fault: String) -> void:
	if not fault.is_empty():
		printerr("consac: ", fault)
		_exit_code = 1
	var heard := backend != null and backend.interrupted()  # while it ended anyway
	stop()
	if quit_at_end or heard:
		get_tree().quit(130 if heard else _exit_code)


# Ctrl-C, SIGTERM, or the dock's button: what was learned or recorded is saved, and the program ends.
func _interrupt(exit_code := 130) -> void:
	print("consac: interrupted after %d steps" % steps)
	stop()
	get_tree().quit(exit_code)


func _welcome_newcomers() -> void:
	for agent in _roster.welcome():
		var fault := _episodes.begin_newcomer(agent) if _in_session else ""
		if not fault.is_empty():
			_refuse(fault)


# A world that the game has paused is frozen: nothing that can be learned from or recorded happens in
# it, and whoever paused it goes on at the usual pace. What the sync holds itself is no such pause.
func _on_pause() -> void:
	backend.set_paused(_standstill.paused)
	if not (_in_session and learning):
		return
	if _standstill.paused:
		_speed.restore()
	else:
		_speed.change(as_fast_as_possible, _wanted_ticks)


# Stops the world without stopping the window. A world that is moved in a loop stands still by itself, and held it would
# hide that the game pauses.
func _hold(held: bool) -> void:
	held = held and not (_in_session and loop_mode and learning)
	if held != _standstill.held and is_inside_tree():
		_standstill.hold(get_tree(), held)


static func _first(fault: String, other: String) -> String:
	return other if fault.is_empty() else fault
