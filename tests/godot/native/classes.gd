extends SceneTree
## ConsacWorld and ConsacModel by themselves, one line a check. Run by test_native.py:
##   godot ... --script classes.gd -- MODEL_OF_THE_ROAD

const BOX := {name = "z", type = "box", low = -2.0, high = 2.0, shape = [2]}
const CHOICE := {name = "a", type = "discrete", n = 3, start = 1}
const PIXELS := {name = "m", type = "box", dtype = "uint8", shape = [2, 2, 1]}

var _failed := 0


func _init() -> void:
	Engine.print_error_messages = false
	_rows_in_the_order_of_the_script()
	_episodes()
	_agents_come_and_go()
	_masks()
	_parameters_notes_and_groups()
	_recording()
	_learning_and_the_model()
	_model(OS.get_cmdline_user_args()[0])
	_paths()
	_one_line_errors()
	quit(1 if _failed > 0 else 0)


func _check(what: String, right: bool) -> void:
	print("ok " if right else "FAIL ", what)
	_failed += 0 if right else 1


func _same(what: String, given: Variant, expected: Variant) -> void:
	_check(what if given == expected else "%s: %s, expected %s" % [what, given, expected], given == expected)


func _make(observations: Array, actions: Array, agents := 1, more := {}) -> ConsacWorld:
	var world := ConsacWorld.new()
	var behaviour := {agents = agents, observations = observations, actions = actions, masks_actions = more.has("masks")}
	_same("a world is made", world.create({behaviours = [behaviour], agents_leave = more.has("leave")}), "")
	for i in agents:
		world.join(0)
	return world


func _rows_in_the_order_of_the_script() -> void:
	var world := _make([BOX, CHOICE, PIXELS], [BOX, CHOICE], 2)
	_same("by hand", world.by_hand(3), "")
	_same("it begins", world.poll(0.0), ConsacWorld.RESET)
	_same("both begin", world.resets(0), PackedByteArray([1, 1]))
	_check("each with a seed", world.seed_of(0) >= 0 and world.seed_of(0) != world.seed_of(1))
	_same("numbers without pixels", world.set_observations(0, PackedFloat32Array([0.5, -0.5, 2, 1.5, -1.5, 3])), "")
	_same("pixels apart", world.set_observation_bytes(0, PackedByteArray([1, 2, 3, 4, 5, 6, 7, 8])), "")
	_same("offered", world.offer(), "")
	_same("it goes on", world.poll(0.0), ConsacWorld.ACT)
	_same("actions are written", world.set_actions(0, PackedFloat32Array([0.25, 0, 3, -0.25, 1, 1])), "")
	_same("and read", world.actions(0), PackedFloat32Array([0.25, 0, 3, -0.25, 1, 1]))
	_same("an agent's own", world.action_of(1), PackedFloat32Array([-0.25, 1, 1]))
	_check("a choice that is none", world.set_observation_of(1, PackedFloat32Array([0, 0, 7])).contains("'a' is 7"))
	_check("a choice that is NaN", not world.set_observation_of(1, PackedFloat32Array([0, 0, NAN])).is_empty())
	_check("too many numbers", world.set_observations(0, PackedFloat32Array([1])).contains("expected 6"))


func _episodes() -> void:
	var world := _make([BOX], [CHOICE], 2)
	world.by_hand(0)
	world.poll(0.0)
	world.offer()
	world.poll(0.0)
	world.add_rewards(0, PackedFloat32Array([1, 2]))
	world.add_reward(1, 0.5)
	world.end_episode(1, ConsacWorld.TERMINATED)
	_same("who ends", world.endings(0), PackedByteArray([0, 1]))
	_check("an end that is none", not world.end_episode(0, 7).is_empty())
	world.set_final_observations(0, PackedFloat32Array([0, 0, 1, 1]))
	world.offer()
	var told := world.progress()
	_same("an episode is counted", [told.episodes, told.mean_episode_reward, told.all_steps], [1, 2.5, 2])
	world.poll(0.0)
	_same("NaN is said, and 0 taken", world.set_observation_of(0, PackedFloat32Array([NAN, 0])), "")
	_check("by name", world.offer().contains("NaN"))
	_same("and it goes on", world.poll(0.0), ConsacWorld.ACT)


func _agents_come_and_go() -> void:
	var world := _make([BOX], [CHOICE], 2, {leave = true})
	_same("no more room", [world.join(0), world.last_error().contains("room for 2")], [-1, true])
	world.by_hand(0)
	world.poll(0.0)
	world.offer()
	world.poll(0.0)
	_same("one leaves", world.leave(0), "")
	_check("and is gone", not world.joined(0) and world.joined(1))
	_check("it cannot be asked any more", world.action_of(0).is_empty() and world.last_error().contains("no agent 0"))
	world.offer()
	world.poll(0.0)
	_same("its place is free", world.join(0), 0)


func _masks() -> void:
	var world := _make([BOX], [CHOICE], 2, {masks = true})
	_same("masks", world.set_masks(0, PackedByteArray([1, 0, 1, 0, 0, 1])), "")
	_check("of the right size", not world.set_mask_of(0, PackedByteArray([1])).is_empty())
	_same("training with masks", world.train({total_steps = 1000}), "")
	var right := world.poll(0.0) == ConsacWorld.RESET
	for i in 50:
		world.offer()
		right = right and world.poll(0.0) == ConsacWorld.ACT
		var chosen := world.actions(0)
		right = right and chosen[0] != 2.0 and chosen[1] == 3.0
	_check("what is masked is not done", right)


func _parameters_notes_and_groups() -> void:
	var world := ConsacWorld.new()
	var two: Array[Dictionary] = []
	for name: String in ["keeper", "striker"]:
		two.append({name = name, agents = 2, observations = [BOX], actions = [CHOICE]})
	var made := {behaviours = two, agents_leave = true, notes = true, groups = [{name = "red", agents = [0, 1, 1, 0]}],
			parameters = [{name = "wind", default = 4.0, low = 0.0, high = 9.0}]}
	_same("a world with parameters, notes and groups", world.create(made), "")
	_same("a place of the group", world.join_group(0, 0), 1)
	_same("one of none", world.join_group(0, -1), 0)
	_same("no more of the group", world.join_group(0, 0), -1)
	_check("and why", world.last_error().contains("of other groups"))
	_same("by default", world.next_parameter(1, "wind"), 4.0)
	_same("no such parameter", world.next_parameter(1, "wnd"), 0.0)
	_check("but another", world.last_error().contains("is 'wind' meant?"))
	_same("noted", world.note("metres", 2.5), "")
	_check("no number", world.note("metres", NAN).contains("NaN or infinite"))
	_same("told of the group", world.tell_group_reward(0, 1.5), "")
	_check("of none", world.tell_group_reward(1, 1.5).contains("there is no group 1"))
	_same("a training sets them", world.train({total_steps = 100, environment_parameters = "wind=7"}), "")
	_same("it begins so", world.poll(0.0), ConsacWorld.RESET)
	_same("with what is set", world.next_parameter(0, "wind"), 7.0)
	_check("beyond its bounds", world.train({total_steps = 100, environment_parameters = "wind=10"}).contains("10"))
	made.groups = [{name = "red", agents = [0]}]
	_check("half a pair", world.create(made).contains("pairs of a behaviour and a place"))
	made.groups = [{name = "red", agents = [0, 7]}]
	_check("no such place", world.create(made).contains("no place for"))
	made.groups = []
	made.parameters = [{name = "wind", default = 10.0, high = 9.0}]
	_check("a default out of bounds", world.create(made).contains("parameter 'wind' is 10"))


func _recording() -> void:
	var world := _make([BOX], [CHOICE])
	_same("recording", world.record(0), "")
	world.by_hand(0)
	world.poll(0.0)
	world.offer()
	for i in 5:
		world.poll(0.0)
		world.set_actions(0, PackedFloat32Array([2]))
		world.offer()
	_same("steps", world.recorded_steps(0), 5)
	_same("saved", world.save_recording(0, "user://demonstration.safetensors"), "")
	_check("a file", FileAccess.file_exists("user://demonstration.safetensors"))


func _learning_and_the_model() -> void:
	var world := _make([BOX], [CHOICE], 4)
	_same("training", world.train({total_steps = 1024, hyperparameters = {n_steps = 64, gamma = 0.9}}), "")
	while true:
		var cue := world.poll(1.0)
		if cue == ConsacWorld.DONE:
			break
		if cue == ConsacWorld.ACT:
			world.add_rewards(0, world.actions(0))
		world.set_observations(0, PackedFloat32Array([0, 0, 1, 1, 2, 2, -1, -1]))
		world.offer()
	_check("finished", world.finished() and world.progress().updates > 0)
	_same("its model is saved", world.save_model(0, "user://learned.consac"), "")
	var model := ConsacModel.new()
	_same("and loaded", model.load("user://learned.consac"), "")
	world.poll(1.0)
	_same("it acts as the learner does", model.predict(PackedFloat32Array([0, 0, 1, 1, 2, 2, -1, -1])), world.actions(0))
	_same("it fits", model.fits({observations = [BOX], actions = [CHOICE]}), "")
	for settings: ConsacHyperparameters in [ConsacPpo2Hyperparameters.new(), ConsacPpoHyperparameters.new()]:
		_same("an algorithm by its properties: " + settings.algorithm(), _make([BOX], [CHOICE]).train({
				algorithm = settings.algorithm(), hyperparameters = settings.collect()}), "")
	_check("what it does not fit", not model.fits({observations = [BOX], actions = [BOX]}).is_empty())
	_same("it drives the world", world.act({models = ["user://learned.consac"]}), "")


func _model(path: String) -> void:
	var model := ConsacModel.new()
	_check("nothing loaded", model.predict(PackedFloat32Array()).is_empty() and model.last_error().contains("load()"))
	_same("a model of consac train", model.load(path), "")
	_same("its entries", model.describe().observations.map(func(entry: Dictionary) -> String: return entry.name), ["actor", "coin"])
	var rows := PackedFloat32Array()
	for i in 1000:
		rows.append_array([i % 41, (i * 7) % 41])
	var all := model.predict(rows)
	_same("as many rows as are wanted", all.size(), 1000)
	var alike := true
	for i in 1000:
		alike = alike and model.predict(rows.slice(2 * i, 2 * i + 2))[0] == all[i]
	_check("one by one the same", alike)
	_same("what failed before is over", model.last_error(), "")
	var named: Dictionary = model.predict_named({coin = PackedFloat32Array([40, 0]), actor = [10.0, 20]})
	_same("by names", named, {"action": model.predict(PackedFloat32Array([10, 40, 20, 0]))})
	_check("a name is missing", model.predict_named({actor = 10}).is_empty() and model.last_error().contains("'coin'"))
	_check("a name too many", model.predict_named({actor = 10, coin = 40, x = 1}).is_empty() and model.last_error().contains("'x'"))
	_check("of two lengths", model.predict_named({actor = 10, coin = [40, 3]}).is_empty() and model.last_error().contains("2 numbers"))
	var box := {type = "box", low = 0.0, high = 40.0}
	var reversed := {observations = [box.merged({name = "coin"}), box.merged({name = "actor"})],
			actions = [{name = "move", type = "discrete", n = 3}]}
	_same("in the order of the script", model.arrange(reversed), "")
	_same("as it says", model.describe().observations.map(func(entry: Dictionary) -> String: return entry.name), ["coin", "actor"])
	_same("and acts so", model.predict(PackedFloat32Array([40, 10, 0, 20])), named["action"])
	_same("under its name", model.predict_named({coin = [40, 0], actor = [10, 20]}), {"move": named["action"]})
	model.load(path)
	model.set_seed(1)
	var drawn := model.predict_with(rows, PackedByteArray(), PackedByteArray(), true)
	model.set_seed(1)
	_same("draws repeat", model.predict_with(rows, PackedByteArray(), PackedByteArray(), true), drawn)
	model.begin_episode(0)
	model.begin_episode(-1)
	_same("a model that remembers nothing acts as before", model.predict(rows), all)
	_check("a masked action is not taken", model.predict_with(PackedFloat32Array([0, 40]), PackedByteArray(),
			PackedByteArray([1, 1, 0]), false)[0] != 2.0)


func _paths() -> void:
	var model := ConsacModel.new()
	_check("no file", model.load("res://nothing.consac").contains("there is no file"))
	_check("no model", model.load("res://project.godot").contains("project.godot"))
	var world := _make([BOX], [CHOICE])
	world.train({total_steps = 10})
	_check("a folder that is not there", not world.save_model(0, "user://no/such/folder/m.consac").is_empty())
	_same("letters of every kind", world.save_model(0, "user://m\u00e4\u4e16.consac"), "")
	_same("which is found again", model.load("user://m\u00e4\u4e16.consac"), "")
	_same("a behaviour's file is no path", world.file_of("../a b"), "%2E.%2Fa b")


func _one_line_errors() -> void:
	var world := ConsacWorld.new()
	_same("nobody drives", [world.poll(0.0), world.last_error().contains("serve()")], [ConsacWorld.FAILED, true])
	_check("the nearest key", world.create({behaviors = []}).contains("did you mean 'behaviours'"))
	_check("a type", world.create({behaviours = 3}).contains("expected an Array"))
	_check("too large", world.create({behaviours = [{agents = 1 << 40}]}).contains("1099511627776"))
	_check("an algorithm", _make([BOX], [CHOICE]).train({algorithm = "ppo3"}).contains("ppo2"))
	_check("a hyperparameter", _make([BOX], [CHOICE]).train({hyperparameters = {gama = 1}}).contains("gamma"))
	_check("a table for the inspector", world.hyperparameters("ppo2").size() > 10 and world.algorithms().size() > 1)
	var first := _make([BOX], [CHOICE])
	var second := _make([BOX], [CHOICE])
	first.serve({port = 0, training_length = 9})
	var port := first.port()
	_check("a taken port", second.serve({port = port, training_length = 9}).contains(str(port)))
	first.close()
	_same("which is free again", second.serve({port = port, training_length = 9}), "")
