class_name ConsacNativeBackend
extends ConsacBackend
## The native extension drives the agents: a trainer over protocol 2 or text protocol 1, a learner
## inside the engine, a model, or the agents' own rules, all of them with any number of agents and
## behaviours.

## In a model's path: stands for the behaviour's name, where a scene has several.
const PLACEHOLDER := "{behaviour}"
## In the name of a model whose training was stopped before its end.
const STOPPED := ".stopped"

# The agents of one behaviour, at their places in the world.
class Herd:
	extends ConsacRows
	var name := &""
	var entries: Array[ConsacEntry] = []  # that they observe
	var actions: Array[ConsacEntry] = []
	var first := 0  # the first place's number in the world
	var masked := false
	var goals := {}  # as ConsacWorld takes them; empty: none
	var groups: Array[StringName] = []  # of each place; "" for none

var _sync: ConsacSync
var _agents: Array[ConsacAgent] = []
var _ids := {}  # instance id of an agent: its number in the world
# Untyped: without the extension the script must still load.
var _world: RefCounted = ClassDB.instantiate(ConsacSync.NATIVE_CLASS)
var _herds: Array[Herd] = []
var _mode: ConsacSync.Mode
var _port := 0
var _beginning := true
var _refused := false
var _unsaved := false  # something was learned since
var _ended := false  # nobody drives any more
var _watching := false  # for Ctrl-C
var _groups: Array[Dictionary] = []  # that who trains knows of
var _untold := {}  # names that nobody can be told


func _init(sync: ConsacSync) -> void:
	_sync = sync
	_mode = sync.mode
	_port = sync.port


func begin(agents: Array[ConsacAgent]) -> String:
	_agents = agents
	_ids.clear()
	_herds.clear()
	var fault := _gather(agents)
	if fault.is_empty():
		fault = _check_paths()
	if fault.is_empty():
		fault = _create()
	if fault.is_empty():
		fault = _drive()
	return fault


func offer() -> void:
	var fault := ""
	for b in _herds.size():
		fault = _first(fault, _look(b))
		fault = _first(fault, _judge(b))
	for g in _groups.size():
		var earned := _sync.earned_by(_groups[g].name)
		if earned != 0.0:
			fault = _first(fault, _world.tell_group_reward(g, earned))
	_offer(fault)


func poll(wait_s: float) -> Cue:
	if _refused:
		_refused = false
		_restart()
		return Cue.FAILED
	if _ended:
		return Cue.WAIT
	while true:
		var cue: Cue = _world.poll(wait_s)
		match cue:
			Cue.ACT:
				var fault := _hand_over()
				if not fault.is_empty():
					refuse(fault)
					return Cue.WAIT
			Cue.RESET:
				if not _begins_session():
					_reset_some()
					if _refused:
						return Cue.WAIT
					continue
				error = ""
				state = _world.progress().state
				session_seed = maxi(0, _world.seed_of(0))
				_unsaved = _mode == ConsacSync.Mode.TRAIN
			Cue.DONE:
				completed = _world.finished()
				error = _keep()
				_unsaved = false
				state = _world.progress().state
				return Cue.DONE if error.is_empty() else Cue.FAILED
			Cue.FAILED:
				error = _world.last_error()
				state = _world.progress().state
		return cue
	return Cue.WAIT


func seed_for(index: int) -> int:
	return _world.seed_of(_ids[_agents[index].get_instance_id()])


func fill_parameters(agent: ConsacAgent, values: Dictionary) -> void:
	var id: int = _ids.get(agent.get_instance_id(), -1)
	if id >= 0:
		for parameter: StringName in values:
			values[parameter] = _world.next_parameter(id, parameter)


func tell(metric: StringName, value: float) -> void:
	if _untold.has(metric):
		return
	var fault: String = _world.note(metric, value)
	if not fault.is_empty():
		_untold[metric] = true
		printerr("consac: note(): ", fault)


func join(agent: ConsacAgent) -> String:
	for b in _herds.size():
		var herd := _herds[b]
		if herd.name != agent.behaviour:
			continue
		if not _alike(agent, herd):
			return "its entries or goals are not those of the behaviour '%s'" % herd.name
		if herd.agents.find(null) < 0:
			return "room_for_agents is %d, and so many of the behaviour '%s' are there" % [herd.agents.size(), herd.name]
		if _place_for(herd, agent) < 0:
			return "the free places of the behaviour '%s' are kept for agents of the groups that those who left were in" % herd.name
		_take_place(b, agent)
		return ""
	return "there was no agent of the behaviour '%s' when it began" % agent.behaviour


func let_go() -> String:
	for herd in _herds:
		for i in herd.agents.size():
			var there := is_instance_valid(herd.agents[i]) and not ConsacLeaving.of(herd.agents[i])
			if not there and _world.joined(herd.first + i):
				_world.leave(herd.first + i)
				herd.agents[i] = null
	for instance: int in _ids.keys():
		if not is_instance_id_valid(instance):
			_ids.erase(instance)
	return ""


func farewell(agent: ConsacAgent) -> String:
	for herd in _herds:
		var i := herd.agents.find(agent)
		if i >= 0:
			var fault := _judge_one(herd, herd.first + i, agent)
			_world.leave(herd.first + i)
			herd.agents[i] = null
			return fault
	return ""


func refuse(why: String) -> void:
	error = why
	_refused = true


func set_paused(paused: bool) -> void:
	_world.set_paused(paused)


func close() -> void:
	var fault := _keep(STOPPED) if _unsaved else ""
	_unsaved = false
	if not fault.is_empty():
		printerr("consac: ", fault)
	_keep_recording()
	_world.close()
	state = "closed"


func interrupted() -> bool:
	return _watching and _world.interrupted()


func checkpoint(step: int) -> String:
	return _keep("." + str(step))


func progress() -> Dictionary:
	return _world.progress()


## Writes the model of a behaviour as it is now. What is wrong, or "".
func save_model(behaviour: StringName, path: String) -> String:
	for b in _herds.size():
		if _herds[b].name == behaviour:
			return _world.save_model(b, path)
	return "there is no behaviour '%s' in this scene" % behaviour


func _gather(agents: Array[ConsacAgent]) -> String:
	for agent in agents:
		var herd: Herd = null
		for known in _herds:
			if known.name == agent.behaviour:
				herd = known
		if herd == null:
			herd = Herd.new()
			herd.name = agent.behaviour
			herd.entries = agent.all_observations
			herd.actions = agent.actions
			herd.masked = agent.masks_actions
			herd.goals = _goals_of(agent)
			herd.take_form(agent)
			_herds.append(herd)
		elif not _alike(agent, herd):
			return "%s and %s share the behaviour '%s', but not their entries or goals; give them one each" % [
					herd.agents[0].path_in_world(), agent.path_in_world(), agent.behaviour]
		herd.agents.append(agent)
	return ""


func _create() -> String:
	var behaviours: Array[Dictionary] = []
	for b in _herds.size():
		var herd := _herds[b]
		var known := _known(b)
		var seen := ConsacEntry.tables_for(herd.entries, known.observations)
		var behaviour := {
			name = herd.name,
			agents = maxi(herd.agents.size(), _sync.room_for_agents),
			masks_actions = herd.masked,
			observations = seen,
			actions = ConsacEntry.tables_for(herd.actions, known.actions),
		}
		if seen.size() == herd.entries.size() and not herd.goals.is_empty():  # numbers without names have no goals
			behaviour.goals = herd.goals
		behaviours.append(behaviour)
	_groups = ConsacGroups.tables(_herds)
	var scene := _sync.get_parent().scene_file_path.get_file().get_basename()
	var fault: String = _world.create({
		id = scene, behaviours = behaviours, agents_leave = _sync.agents_may_leave(), notes = true,
		parameters = ConsacParameter.tables(_sync.parameters), groups = _groups})
	if not fault.is_empty():
		return fault
	for b in _herds.size():
		_herds[b].first = _world.first_agent(b)
		var agents := _herds[b].agents.duplicate()
		_herds[b].agents.clear()
		_herds[b].agents.resize(maxi(agents.size(), _sync.room_for_agents))
		_herds[b].groups.resize(_herds[b].agents.size())
		_herds[b].groups.fill(&"")
		if not _groups.is_empty():
			for i in agents.size():
				_herds[b].groups[i] = agents[i].group
		for agent in agents:
			_take_place(b, agent)
		if not _sync.record_path.is_empty():
			_world.record(b)
	return ""


func _take_place(b: int, agent: ConsacAgent) -> void:
	var group := _herds[b].groups[_place_for(_herds[b], agent)]
	var id: int = _world.join_group(b, _groups.find_custom(func(one: Dictionary) -> bool: return one.name == group))
	_ids[agent.get_instance_id()] = id
	_herds[b].agents[id - _herds[b].first] = agent


## A free place for [param agent]: one of its group, else one of none; -1 where there is none.
static func _place_for(herd: Herd, agent: ConsacAgent) -> int:
	var place := -1
	for i in herd.agents.size():
		if herd.agents[i] != null:
			continue
		if herd.groups[i] == agent.group:
			return i
		if herd.groups[i] == &"" and place < 0:
			place = i
	return place


## What would only be found out after the training. What is wrong, or "".
func _check_paths() -> String:
	var trains := _mode == ConsacSync.Mode.TRAIN
	var path := _sync.model_path if trains else _sync.path_to_model()
	if _mode == ConsacSync.Mode.ACT and path.is_empty():
		return "set model_path, or model, to the .consac file that is to act"
	if trains and path.is_empty():
		push_warning("model_path is empty, so what is learned will not be saved")
	var of_each := {record_path = _sync.record_path}
	if trains or _mode == ConsacSync.Mode.ACT:
		of_each.model_path = path
	if trains:
		of_each.start_from = _sync.start_from
	for property: String in of_each:
		if _herds.size() > 1 and not of_each[property].is_empty() and not of_each[property].contains(PLACEHOLDER):
			return "the scene has %d behaviours, each with a file of its own; put %s into %s" % [
					_herds.size(), PLACEHOLDER, property]
	for written: String in [path if trains else "", _sync.record_path]:
		var folder := ProjectSettings.globalize_path(written).get_base_dir()
		if not folder.is_empty() and DirAccess.make_dir_recursive_absolute(folder) != OK:
			return "the folder %s of '%s' cannot be made" % [folder, written]
	return _hide_logs() if trains else ""


## A CSV file below res:// would become a translation: the editor passes over a folder with a .gdignore.
func _hide_logs() -> String:
	var folder := _sync.log_folder
	var place := "" if folder.is_empty() else ProjectSettings.localize_path(folder).simplify_path()
	if place == "res://":
		return "log_folder %s is the project itself; name a folder below it, or one below user://" % folder
	if not place.begins_with("res://"):
		return ""
	DirAccess.make_dir_recursive_absolute(ProjectSettings.globalize_path(folder))
	var marked := FileAccess.open(folder.path_join(".gdignore"), FileAccess.WRITE)
	return "" if marked != null else "nothing can be written into the log_folder %s; use one below user://" % folder


## Lets begin whoever the mode says.
func _drive() -> String:
	var fault := ""
	match _mode:
		ConsacSync.Mode.SERVE:
			fault = _world.serve({
				port = _port, training_length = _sync.training_length, model_name = _sync.model_name,
				seed = _sync.world_seed, deadline_s = _sync.deadline_s})
			_port = _world.port()
		ConsacSync.Mode.TRAIN:
			var settings := _sync.settings
			var values := {} if settings == null else settings.collect()
			values.merge(_sync.hyperparameters, true)
			var begins := PackedStringArray()
			for herd in _herds:
				if not _sync.start_from.is_empty():
					begins.append(path_of(_sync.start_from, herd.name))
			fault = _world.train({
				start_from = begins,
				algorithm = _sync.algorithm if settings == null else settings.algorithm(),
				hyperparameters = values,
				environment_parameters = ConsacParameter.laws(_sync.parameters),
				total_steps = _sync.training_length, seed = _sync.world_seed,
				log_folder = _sync.log_folder,
				while_learning = "go_on" if _sync.act_while_learning else "wait"})
		ConsacSync.Mode.ACT:
			var models := PackedStringArray()
			for b in _herds.size():
				models.append(path_of(_sync.path_to_model(), _herds[b].name))
			fault = _world.act({models = models, seed = _sync.world_seed})
		ConsacSync.Mode.BY_HAND:
			fault = _world.by_hand(_sync.world_seed)
	state = _world.progress().state
	if fault.is_empty() and (_mode == ConsacSync.Mode.TRAIN or not _sync.record_path.is_empty()):
		_world.watch_interrupts()
		_watching = true
	return fault


## After [method refuse]: the session is over. The next trainer may come; a learner or a model would
## only meet the same again.
func _restart() -> void:
	_keep_recording()
	if _unsaved:
		error = _first(error, _keep(STOPPED))
		_unsaved = false
	_world.refuse(error)
	_world.close()
	_ended = true
	if _mode == ConsacSync.Mode.SERVE:
		var fault := _drive()
		_ended = not fault.is_empty()
		error += "; and then: " + fault if _ended else ""
	if _ended:
		state = "ended: " + error


## A beginning of everything, or of some episodes of a session that goes on?
func _begins_session() -> bool:
	return _mode != ConsacSync.Mode.SERVE or int(_world.progress().steps) == 0


func _reset_some() -> void:
	var fault := ""
	for b in _herds.size():
		var resets: PackedByteArray = _world.resets(b)
		for i in resets.size():
			if resets[i] == 0:
				continue
			var agent := _herds[b].agents[i]
			var episode_seed: int = _world.seed_of(_herds[b].first + i)
			agent.start_episode(episode_seed if episode_seed >= 0 else agent.rng.randi())
			fault = _first(fault, agent.look())
		fault = _first(fault, _look(b))
	_offer(fault)


## A world that observes what is no number, or not all that it should, is not learned from.
func _offer(fault: String) -> void:
	var why: String = _world.offer() if fault.is_empty() else fault
	if not why.is_empty():
		refuse(why)


## What the world does not take of what the agents saw, in one sentence, or "".
func _look(b: int) -> String:
	var herd := _herds[b]
	var fault := ""
	if herd.width > 0:
		fault = _world.set_observations(b, herd.observations())
	if not herd.images.is_empty():
		fault = _first(fault, _world.set_observation_bytes(b, herd.pictures()))
	if herd.masked:
		fault = _first(fault, _world.set_masks(b, herd.masks()))
	return fault


## Likewise of rewards and ends.
func _judge(b: int) -> String:
	var herd := _herds[b]
	var fault := ""
	for i in herd.agents.size():
		var agent := herd.agents[i]
		if agent != null:
			fault = _first(fault, _judge_one(herd, herd.first + i, agent))
	return fault


func _judge_one(herd: Herd, id: int, agent: ConsacAgent) -> String:
	var fault := ""
	if agent.reward != 0.0:
		fault = _world.add_reward(id, agent.reward)
	if not agent.terminated and not agent.truncated:
		return fault
	fault = _first(fault, _world.end_episode(id, 1 if agent.terminated else 2))
	if herd.width > 0:
		fault = _first(fault, _world.set_final_observation_of(id, agent.final_row))
	if not herd.images.is_empty():
		var pictures := agent.image_bytes(agent.final_values, herd.images)
		fault = _first(fault, _world.set_final_observation_bytes_of(id, pictures))
	return fault


func _hand_over() -> String:
	for b in _herds.size():
		var herd := _herds[b]
		if _mode == ConsacSync.Mode.BY_HAND:
			for i in herd.agents.size():
				if herd.agents[i] == null:
					continue
				var fault := herd.agents[i].ask_heuristic()
				if fault.is_empty():
					fault = _world.set_action_of(herd.first + i, herd.agents[i].action_row)
				if not fault.is_empty():
					return fault
			continue
		herd.hand_out(_world.actions(b))
	return ""


## At the end of a training inside the engine, or where it stands: saves what was learned. What was not finished has a
## name of its own, by [param mark], and takes no finished one's place. A model that has learned nothing yet is worth no
## file.
func _keep(mark := "") -> String:
	var path := _sync.model_path
	if _mode != ConsacSync.Mode.TRAIN or path.is_empty():
		return ""
	var learned := range(_herds.size()).filter(func(b: int) -> bool: return _world.learned(b))
	if mark == STOPPED and learned.is_empty():
		print("consac: stopped before the first update; nothing was learned yet, so no model is saved")
	var how := {"": "what was learned is in ", STOPPED: "stopped early; what was learned is in "}
	for b: int in learned:
		var whole := path_of(path, _herds[b].name)
		var target := whole if mark.is_empty() else "%s%s.%s" % [whole.get_basename(), mark, whole.get_extension()]
		var fault: String = _world.save_model(b, target)
		if not fault.is_empty():
			return fault
		print("consac: ", how.get(mark, "what was learned so far is in "), target)
	return ""


func _keep_recording() -> void:
	if _sync.record_path.is_empty():
		return
	for b in _herds.size():
		if _world.recorded_steps(b) > 0:
			_world.save_recording(b, path_of(_sync.record_path, _herds[b].name))


## A path with the file name of [param behaviour] in the place for it.
static func path_of(path: String, behaviour: StringName) -> String:
	if not path.contains(PLACEHOLDER):
		return path
	var world: RefCounted = ClassDB.instantiate(ConsacSync.NATIVE_CLASS)
	return path.replace(PLACEHOLDER, world.file_of(behaviour))


# The entries that the model of a behaviour knows, where one acts; none where it cannot be read, which the world says.
func _known(b: int) -> Dictionary:
	var model: RefCounted = ClassDB.instantiate(ConsacSync.NATIVE_MODEL)
	if _mode == ConsacSync.Mode.ACT and model.load(path_of(_sync.path_to_model(), _herds[b].name)).is_empty():
		return model.describe()
	return {observations = [], actions = []}


static func _alike(agent: ConsacAgent, herd: Herd) -> bool:
	return (ConsacEntry.tables(agent.all_observations) == ConsacEntry.tables(herd.entries)
			and ConsacEntry.tables(agent.actions) == ConsacEntry.tables(herd.actions)
			and agent.masks_actions == herd.masked
			and _goals_of(agent) == herd.goals)


static func _goals_of(agent: ConsacAgent) -> Dictionary:
	return {} if agent.goals == null else agent.goals.table()


static func _first(fault: String, other: String) -> String:
	return other if fault.is_empty() else fault
