@icon("res://addons/consac/icon.svg")
class_name ConsacAgent
extends Node
## One that observes, acts and learns. Extend it and override [method observe], [method act],
## [method judge] and [method reset], or connect their signals. A [ConsacSync] in the scene drives
## it.
##
## Each decision goes: [method act], then the world moves (physics ticks, or nothing in loop mode,
## where [method act] moves it itself), then [method judge], then [method observe]. Where the
## episode ended, [method reset] and [method observe] follow at once.

## Asks for observations: put one value for each entry into [param values], as [method observe]
## does.
signal observing(values: Dictionary)
## Asks which choices are legal, where [member masks_actions] is set: see [method mask].
signal masking(legal: Dictionary)
## Asks what to do by hand: see [method heuristic].
signal playing(into: Dictionary)
## Brings actions: one value for each entry, as [method act] gets them.
signal acting(values: Dictionary)
## The world has moved: the place for [method add_reward] and [method end_episode].
signal judging
## A new episode begins; everything random in it should come from [member rng].
signal resetting(episode_seed: int)
## An episode is over.
signal episode_ended(total_reward: float, steps: int)

## Who chooses for one agent.
enum ControlMode {
	AS_THE_SYNC,  ## whoever the [ConsacSync] says
	MODEL,  ## the model in [member model]; needs the native extension
	BY_HAND,  ## its own [method heuristic]
}

## Every agent is in this group.
const GROUP := &"consac_agents"

## Agents of one behaviour share one model.
@export var behaviour: StringName = &"default"
## What it observes; sensors below this node add theirs after these.
@export var observations: Array[ConsacEntry] = []
## What it does.
@export var actions: Array[ConsacEntry] = []
## Decisions after which an episode is cut off (truncated); 0 for never.
@export_range(0, 1000000000, 1, "hide_slider") var max_steps: int = 0
## Not every choice is legal at every time; [method mask] says which are. Needs the native extension.
@export var masks_actions: bool = false
## Of one that observes a desired and an achieved goal: what it is paid, so that goals which were not meant can be learned
## from, too.
@export var goals: ConsacGoals
## Agents of one name win and lose together: [method add_group_reward] pays all of them. A trainer of protocol 2 is told of
## groups where agents of several behaviours share the scene; agents of one behaviour alone are paid as well, each in a world
## of its own. "" for none. No agent with [member goals] is in a group.
@export var group: StringName = &""
@export_group("Who chooses")
## Who chooses for this agent: a person or a model may act beside agents that learn, or against them.
@export var control: ControlMode = ControlMode.AS_THE_SYNC
## Of MODEL: a file [code]NAME.consac[/code], dragged here from the file system dock.
@export var model: ConsacModelFile

## Random numbers of this episode, seeded anew before each [method reset].
var rng := RandomNumberGenerator.new()
## Decisions of this episode so far; in [method judge] those before the one that is judged.
var steps: int = 0
## Reward of this episode so far.
var total_reward: float = 0.0

## The [ConsacSync] that drives it, once one does.
var driven_by: ConsacSync
## The sync's backend does not drive it: it acts by a model or a rule of its own.
var played := false
## Of those: by its own rule.
var by_rule := false

# What a backend reads after each collect(): the numbers of all observation entries in order.
var row := PackedFloat32Array()
var final_row := PackedFloat32Array()  # the episode's last observation, where it ended
var values := {}  # the latest observations by name; images are found here as PackedByteArray
var final_values := {}  # likewise the episode's last ones, where it ended
var reward: float = 0.0
var terminated: bool = false
var truncated: bool = false
# What a backend writes before hand_over(): the numbers of all action entries in order.
var action_row := PackedFloat32Array()
var mask_row := PackedByteArray()  # a byte for each choice of all discrete actions; empty where nothing is masked
var all_observations: Array[ConsacEntry] = []  # its own, then its sensors'

var _sensors: Array[ConsacSensor] = []
var _names: Array[StringName] = []  # of all observations
var _widths := PackedInt32Array()  # their numbers; negative: to be looked at more closely
var _action_names: Array[StringName] = []
var _action_widths := PackedInt32Array()
var _given := {}  # actions by name
var _legal := {}  # masks by name
var _goals_at := PackedInt32Array()  # in row
var _told_of_pay := false
var _parameters := {}  # what this episode has, by name
var _resetting := false  # it is being put at its start: nothing that it earns counts
var _accounted := false  # this step's reward is in total_reward already
var _bodies := ConsacBodyCheck.new()
var _problem := ""


# Not _enter_tree() and _exit_tree(), which a game's own script may override.
func _notification(what: int) -> void:
	if what == NOTIFICATION_ENTER_TREE:
		_come()
	elif what == NOTIFICATION_EXIT_TREE and is_instance_valid(driven_by):
		driven_by.miss()


func _come() -> void:
	add_to_group(GROUP)
	if Engine.is_editor_hint():
		return
	for sync: ConsacSync in get_tree().get_nodes_in_group(ConsacSync.GROUP):
		sync.meet(self)
	_warn_if_alone.call_deferred()


func _warn_if_alone() -> void:
	if is_inside_tree() and get_tree().get_nodes_in_group(ConsacSync.GROUP).is_empty():
		push_warning("%s: there is no ConsacSync in the scene, so nobody drives this agent" % get_path())


## Override: put a value into [param into] for each observation entry: a number, a vector, or an
## array of numbers.
func observe(into: Dictionary) -> void:
	observing.emit(into)


## Override: do what [param chosen] says: an int for a discrete entry, a float for a box of size 1,
## else a PackedFloat32Array. In a physics world the action holds until the next one.
func act(chosen: Dictionary) -> void:
	acting.emit(chosen)


## Override: call [method add_reward] and [method end_episode] for what happened since [method act].
func judge() -> void:
	judging.emit()


## Override: put the world where an episode begins.
func reset(episode_seed: int) -> void:
	resetting.emit(episode_seed)


## Override: fill [param into] with an action for each entry, from the player's keys or a rule.
## Drives the agent in the mode "by hand". Unless overridden: the first choice, the middle of each
## range.
func heuristic(into: Dictionary) -> void:
	playing.emit(into)
	for entry in actions:
		if into.has(entry.name):
			continue
		if entry.kind == ConsacEntry.Kind.DISCRETE:
			into[entry.name] = 0
		else:
			var middle := PackedFloat32Array()
			middle.resize(entry.size)
			middle.fill(entry.middle())
			into[entry.name] = middle


## Override, where [member masks_actions] is set: [param legal] holds a PackedByteArray for each discrete action, 1 for
## each choice; write 0 where a choice is not legal now. One at least stays legal.
func mask(legal: Dictionary) -> void:
	masking.emit(legal)


## A number of your own for people to see, with the rewards: how far it came, whether it hit. Its mean over the calls
## stands in the sync's lines, in its curve and in the editor's dock, and a trainer of protocol 2 has it as game/NAME in its
## table, in progress.csv and in TensorBoard. So tell what did not happen too:
## [code]note(&"hit", 1.0 if hit else 0.0)[/code].
func note(metric: StringName, value: float) -> void:
	if is_instance_valid(driven_by) and driven_by.counts(self):
		driven_by.note(metric, value)


## What this episode has of one of the [member ConsacSync.parameters]; it stays so until the next one begins, so
## [method reset] is the place to set gravity, a weight or a number of enemies by it. Before the first, what it is by
## default. A name that is not in [member ConsacSync.parameters] ends the session.
func parameter(parameter_name: StringName) -> float:
	if _parameters.has(parameter_name):
		return _parameters[parameter_name]
	var sync: Node = null
	if is_instance_valid(driven_by):
		sync = driven_by
	elif is_inside_tree():
		sync = get_tree().get_first_node_in_group(ConsacSync.GROUP)
	return sync.default_of(parameter_name) if is_instance_valid(sync) else 0.0


## Adds to the reward of the present step.
func add_reward(amount: float) -> void:
	reward += amount
	if _accounted and (goals == null or not goals.pays):
		total_reward += amount


## Adds to the reward of the present step of every agent of this one's [member group], this one too; without a group, of this
## one alone.
func add_group_reward(amount: float) -> void:
	if group == &"" or not is_instance_valid(driven_by) or not is_finite(amount):
		add_reward(amount)
	elif not _resetting:
		driven_by.add_group_reward(group, amount)


## Ends the episode with the present step. [param cut_off]: it was only cut off, there would have
## been more to earn.
func end_episode(cut_off := false) -> void:
	if cut_off:
		truncated = true
	else:
		terminated = true


## Its path below the sync's parent, for messages, since agents in copies of one scene share a name; its name alone where no
## sync drives it.
func path_in_world() -> String:
	if is_inside_tree() and is_instance_valid(driven_by) and driven_by.is_inside_tree():
		return String(driven_by.get_parent().get_path_to(self))
	return name


## Called by [ConsacSync] before the first episode. What is wrong with the agent, in one sentence,
## or "".
func prepare() -> String:
	_sensors.clear()
	all_observations = observations.duplicate()
	for child in find_children("*", "ConsacSensor", true, false):
		var sensor: ConsacSensor = child
		var missing := sensor.fault()
		if not missing.is_empty():
			return "%s/%s: %s" % [path_in_world(), sensor.name, missing]
		_sensors.append(sensor)
		if sensor.place() != null and not sensor.has_meta(&"drawing"):
			sensor.set_meta(&"drawing", true)
			sensor.begin_drawing(sensor.place())
		all_observations.append_array(sensor.entries())
	var fault := ConsacValues.fault_of(all_observations, "observation")
	if fault.is_empty():
		fault = ConsacValues.fault_of(actions, "action")
	if not fault.is_empty():
		fault = "%s%s" % [path_in_world(), fault]
	if fault.is_empty() and goals != null:
		fault = goals.fault(all_observations)
		fault = "" if fault.is_empty() else "%s, %s" % [path_in_world(), fault]
		_goals_at = ConsacGoals.places(all_observations)
	if fault.is_empty() and goals != null and group != &"":
		fault = "%s is in the group '%s', and its goals say what it is paid; empty group, or goals" % [
				path_in_world(), group]
	row.resize(ConsacValues.plan(all_observations, _names, _widths))
	action_row.resize(ConsacValues.plan(actions, _action_names, _action_widths))
	action_row.fill(0.0)
	mask_row.clear()
	by_rule = false
	if fault.is_empty() and control == ControlMode.MODEL and model == null:
		fault = "%s acts by a model and has none; set model to a .consac file" % path_in_world()
	return fault


## Whether one of its sensors wants the world drawn before it looks.
func sees_pictures() -> bool:
	return _sensors.any(func(sensor: ConsacSensor) -> bool: return sensor is ConsacCameraSensor)


## Called by [ConsacSync]: begins an episode.
func start_episode(episode_seed: int) -> void:
	rng.seed = episode_seed
	if is_instance_valid(driven_by):
		_parameters = driven_by.parameters_of(self)
	steps = 0
	total_reward = 0.0
	_bodies.before(self)
	_resetting = true
	reset(episode_seed)
	_resetting = false
	_bodies.after()
	forget_step()  # what reset() itself brought about belongs to none


## Called by [ConsacSync]: no reward and no end so far.
func forget_step() -> void:
	reward = 0.0
	terminated = false
	truncated = false
	_accounted = false


## Called by [ConsacSync] once the step is told: what is earned from now on, and before the next one begins, is nobody's.
func close_account() -> void:
	_accounted = false


## Called by [ConsacSync] where an episode ended: the next one. The step's reward and end stay
## readable for the backend.
func next_episode(episode_seed: int) -> void:
	episode_ended.emit(total_reward, steps)
	final_row = row.duplicate()
	final_values = values
	values = {}
	if ConsacLeaving.of(self):  # it has no next one
		return
	var kept := [reward, terminated, truncated]
	start_episode(episode_seed)
	reward = kept[0]
	terminated = kept[1]
	truncated = kept[2]


## Called by [ConsacSync]: fills [member row]. What is wrong with what the agent said, in one
## sentence, or "". Whether the numbers are finite is for the backend to see: it reads them anyway.
func look() -> String:
	_problem = ""
	values.clear()  # what observe() no longer writes is missing, not as it was
	observe(values)
	for sensor in _sensors:
		if is_instance_valid(sensor):
			sensor.sense(values)
		else:
			_blame("a sensor was removed while it runs; keep it until the session ends")
	var at := 0
	for i in _names.size():
		var value: Variant = values.get(_names[i])
		var type := typeof(value)
		var width := _widths[i]
		if width == 1 and type == TYPE_FLOAT:
			row[at] = value
		elif width == 2 and type == TYPE_VECTOR2:
			row[at] = value.x
			row[at + 1] = value.y
		elif width == 3 and type == TYPE_VECTOR3:
			row[at] = value.x
			row[at + 1] = value.y
			row[at + 2] = value.z
		else:
			var wrong := ConsacValues.store(row, at, all_observations[i], value, "observe()")
			if not wrong.is_empty():
				_blame(wrong + (_stray_names() if value == null else ""))
		at += absi(width)
	if masks_actions:
		_look_at_masks()
	return _problem


## The pictures of [param images] in [param of], one after the other. One that is missing is left out; [method look] says
## so.
func image_bytes(of: Dictionary, images: Array[StringName]) -> PackedByteArray:
	var bytes := PackedByteArray()
	for image in images:
		var picture: Variant = of.get(image)
		if not picture is PackedByteArray:
			continue
		if images.size() == 1:
			return picture
		bytes.append_array(picture)
	return bytes


## Called by a backend that found a number in [param numbers] which is not finite: which entry it
## belongs to, in one sentence.
func blame_for(numbers: PackedFloat32Array) -> String:
	var at := 0
	for entry in all_observations:
		for i in entry.numbers():
			if not is_finite(numbers[at + i]):
				return "%s: observe() gave %s for entry '%s'; mend where it comes from" % [
						path_in_world(), numbers[at + i], entry.name]
		at += entry.numbers()
	return ""


## Called by [ConsacSync] after the world has moved: reward and whether the episode ended.
func account() -> String:
	judge()
	steps += 1
	if goals == null or not goals.pays:
		total_reward += reward
	_accounted = true
	if max_steps > 0 and steps >= max_steps and not terminated:
		truncated = true
	if not is_finite(reward):
		return "%s: the reward of step %d of its episode is %s; mend where it comes from" % [path_in_world(), steps, reward]
	return ""


## Called by [ConsacSync] once it has looked at what the step led to: what its goals pay, where those do.
func settle() -> void:
	if goals == null or not goals.pays:
		return
	var worth := goals.worth(row, _goals_at)
	if reward != 0.0 and not is_equal_approx(reward, worth) and not _told_of_pay:
		_told_of_pay = true
		push_warning("%s was given a reward of %s, but its goals are worth %s; they alone pay: give none, or turn off goals.pays"
				% [path_in_world(), reward, worth])
	reward = worth
	total_reward += reward


## Called by [ConsacSync], once all agents have forgotten the step before: gives the action in [member action_row] to
## [method act].
func hand_over() -> void:
	var at := 0
	for i in _action_names.size():
		var width := _action_widths[i]
		if width == 1:
			_given[_action_names[i]] = action_row[at]
		elif width < 0:
			_given[_action_names[i]] = int(action_row[at])
		else:
			_given[_action_names[i]] = action_row.slice(at, at + width)
		at += absi(width)
	act(_given)


## Called by the mode "by hand": fills [member action_row] from [method heuristic].
func ask_heuristic() -> String:
	_problem = ""
	_given.clear()
	heuristic(_given)
	var at := 0
	for entry in actions:
		var wrong := ConsacValues.store(action_row, at, entry, _given.get(entry.name), "heuristic()")
		if not wrong.is_empty():
			_blame(wrong)
		at += entry.numbers()
	return _problem


# The names that observe() gave and no entry has: of a missing one, likely the misspelling.
func _stray_names() -> String:
	var stray := values.keys().filter(func(key: Variant) -> bool: return not key in _names)
	return "" if stray.is_empty() else "; no entry is named '%s'" % "', '".join(stray)


func _look_at_masks() -> void:
	for entry in actions:
		if entry.kind == ConsacEntry.Kind.DISCRETE:
			_legal[entry.name] = ConsacValues.everything(entry)
	mask(_legal)
	mask_row.clear()
	for entry in actions:
		if entry.kind != ConsacEntry.Kind.DISCRETE:
			continue
		var wrong := ConsacValues.fault_of_mask(_legal.get(entry.name), entry)
		if wrong.is_empty():
			mask_row.append_array(_legal[entry.name])
		else:
			_blame(wrong)
			mask_row.append_array(ConsacValues.everything(entry))  # what mask() gave is the game's own


# Keeps the first of what is wrong.
func _blame(what: String) -> void:
	if _problem.is_empty():
		_problem = "%s: %s" % [path_in_world(), what]
