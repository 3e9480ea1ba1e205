extends SceneTree
## Calls every method of the native classes in random orders with random arguments, right and wrong ones, and then sees
## that a world still learns. Run by test_native.py:  godot ... --script misuse.gd -- SEED SEQUENCES MODEL TWIN
## Ends with one line "misuse: N sequences, M calls, K offers, cues [...]".

const CALLS := 40  # of one sequence
const CLASSES: Array[StringName] = [&"ConsacWorld", &"ConsacModel", &"ConsacRobot"]

var _rng := RandomNumberGenerator.new()
var _methods := {}  # class: descriptions of its own methods
var _objects: Array[RefCounted] = []
var _model := ""
var _twin := ""  # a joint table
var _calls := 0
var _offers := 0  # that were wanted
var _cues := [0, 0, 0, 0, 0]


func _init() -> void:
	var arguments := OS.get_cmdline_user_args()
	_rng.seed = arguments[0].to_int()
	_model = arguments[2]
	_twin = arguments[3]
	for name in CLASSES:
		_methods[name] = ClassDB.class_get_method_list(name, true)
	Engine.print_error_messages = false
	var sequences := arguments[1].to_int()
	for i in sequences:
		_sequence()
	_objects.clear()
	Engine.print_error_messages = true
	print("misuse: %d sequences, %d calls, %d offers, cues %s" % [sequences, _calls, _offers, _cues])
	print("afterwards: ", _learns())
	_objects.append(ClassDB.instantiate(&"ConsacWorld"))  # one is alive and learning when the engine ends
	_set_up(_objects[0])
	_objects[0].call("train", {total_steps = 100000, while_learning = "go_on"})
	for i in 500:
		_objects[0].call("poll", 0.0)
		_objects[0].call("offer")
	quit()


func _sequence() -> void:
	if _objects.size() > 6 or _rng.randf() < 0.3:
		_objects.clear()
	_objects.append(ClassDB.instantiate(CLASSES[0] if _rng.randf() < 0.75 else CLASSES[1 + _rng.randi() % 2]))
	var object: RefCounted = _objects.back()
	if _rng.randf() < 0.7 and object.is_class(CLASSES[0]):
		_set_up(object)
		match _rng.randi() % 4:
			0:
				object.call("by_hand", 3)
			1:
				object.call("train", _options(["total_steps", "algorithm", "hyperparameters", "while_learning", "seed"]))
			2:
				object.call("serve", _options(["port", "seed", "protocol", "training_length"]))
			3:
				object.call("act", _options(["models", "mode", "seed"]))
	if _rng.randf() < 0.7 and object.is_class(CLASSES[2]):
		object.call("load", _twin)
	for i in CALLS:
		object = _objects[_rng.randi() % _objects.size()]
		var methods: Array = _methods[StringName(object.get_class())]
		var method: Dictionary = methods[_rng.randi() % methods.size()]
		if _rng.randf() < 0.25 and object.is_class(CLASSES[0]):
			_cues[int(object.call("poll", 0.0))] += 1
			_offers += 1 if object.call("offer") == "" else 0
		var given := []
		for argument: Dictionary in method.args:
			given.append(_value(argument.type, "to" if method.name.begins_with("save_") else argument.name))
		if _rng.randf() < 0.02:
			given.append(1)
		elif _rng.randf() < 0.02:
			given.pop_back()
		object.callv(method.name, given)
		_calls += 1


## A world that mostly fits what follows.
func _set_up(world: RefCounted) -> void:
	world.call("create", _world_table())
	for b in 2:
		for i in mini(16, int(world.call("agents", b))):
			world.call("join", b)


func _value(type: int, name: String) -> Variant:
	if _rng.randf() < 0.04:
		return _anything()
	match type:
		TYPE_BOOL:
			return _rng.randf() < 0.5
		TYPE_INT:
			return _pick([0, 0, 0, 1, 1, 2, 3, 5, -1, 70, 1 << 40, -(1 << 62), 0x7fffffffffffffff])
		TYPE_FLOAT:
			return _pick([0.0, 0.0, 0.0005, 1.0, -1.0, NAN, -INF, 1e300]) if name != "wait_s" else _pick([0.0, 0.0005, NAN, -INF])
		TYPE_STRING:
			if name == "to":  # what is written over is nobody's
				return _pick(["user://misuse_model.consac", "", "res://no/no", "user://no/no"])
			return _pick([_model, _model, _twin, "yumi_link_7_r", "user://misuse_model.consac", "res://project.godot", "", "res://no", "user://no/no",
					"ppo2", "\u00e4\u4e16", "nul\u0001", "x".repeat(5000)])
		TYPE_DICTIONARY:
			return _table(name)
		TYPE_PACKED_FLOAT32_ARRAY:
			var numbers := PackedFloat32Array()
			for i in _size():
				numbers.append(_pick([0.0, 0.0, 1.0, 0.5, -1.0, 2.0, NAN, INF, 1e30]))
			return numbers
		TYPE_PACKED_FLOAT64_ARRAY:
			var numbers := PackedFloat64Array()
			for i in _pick([0, 3, 3, 3, 7, 16, 16, 17]):
				numbers.append(_pick([0.0, 0.0, 0.3, 0.5, -1.0, 1.0]) if _rng.randf() < 0.95 else _pick([NAN, INF, 1e300, 1e-320]))
			return numbers
		TYPE_PACKED_BYTE_ARRAY:
			if _rng.randf() < 0.05:
				return FileAccess.get_file_as_bytes(_model).slice(0, _rng.randi() % 4000)
			var bytes := PackedByteArray()
			for i in _size():
				bytes.append(_pick([0, 0, 1, 2, 255]))
			return bytes
	return _anything()


## Sizes that often fit one of the worlds here.
func _size() -> int:
	return _pick([0, 1, 2, 3, 4, 4, 5, 6, 8, 12, 12, 16, 20, 48, 64, 100])


func _table(name: String) -> Dictionary:
	if name == "description":
		return _world_table()
	if name == "behaviour":
		return _behaviour()
	return _options(_pick([["port", "seed", "protocol", "deadline_s", "training_length"], ["total_steps", "algorithm",
			"hyperparameters", "while_learning", "seed"], ["models", "mode", "seed"], ["modles"]]))


func _options(keys: Array) -> Dictionary:
	var table := {}
	for key: String in keys:
		if _rng.randf() < 0.7:
			table[key] = _setting(key)
	return table


func _setting(key: String) -> Variant:
	if _rng.randf() < 0.05:
		return _anything()
	match key:
		"port":
			return _mostly([0], [-1, 70000, 1])
		"protocol":
			return _mostly(["auto", "text1", "protocol2"], ["text3"])
		"total_steps":
			return _mostly([1, 64, 1000], [-1, 1e18, 1 << 62])
		"algorithm":
			return _mostly(["ppo2", "sac"], ["nope"])
		"hyperparameters":
			return _mostly([{}, {}, {gamma = 0.9}], [{n_steps = 16}, {n_steps = 0}, {gamma = "x"}, {net_arch = [8]}])
		"while_learning":
			return _mostly(["wait", "go_on"], ["never"])
		"models":
			return _pick([[_model], [_model, _model], ["res://project.godot"], [], [1]])
		"mode":
			return _mostly(["deterministic", "sample"], ["best"])
	return _pick([0, 1, 5.0, 10, -3])


func _world_table() -> Dictionary:
	var behaviours := []
	for i in _mostly([1, 1, 1, 2], [0]):
		var behaviour := _behaviour()
		if _rng.randf() < 0.9:
			behaviour.name = "b%d" % i
		behaviours.append(behaviour)
	return {id = _pick(["", "w-v0"]), behaviours = behaviours, max_episode_steps = _mostly([0, 0, 3, 1], [-1]),
			agents_leave = _rng.randf() < 0.5, notes = _rng.randf() < 0.5,
			parameters = _mostly([[], [{name = "ppo2", default = 1.0}]], [[{name = "p", low = 2.0}], [3], [{default = INF}]]),
			groups = _mostly([[]] if behaviours.size() < 2 else [[], [{name = "g", agents = [0, 0, 1, 0]}]],
					[[{name = "g", agents = [0]}], [{name = "g", agents = [-1, 1 << 50]}], [{agents = [0, 0, 0, 0]}], [{}]])}


func _behaviour() -> Dictionary:
	var observations := []
	var actions := []
	for i in _mostly([1, 1, 2, 3], [0]):
		observations.append(_entry("o%d" % i))
	for i in _mostly([1, 1, 1, 2], [0]):
		actions.append(_entry("a%d" % i))
	return {agents = _mostly([1, 1, 2, 4, 4, 16], [0, -2, 1 << 31, 1 << 50, 1000000]), observations = observations, actions = actions,
			masks_actions = _mostly([false], [true])}


func _entry(name: String) -> Dictionary:
	if _rng.randf() < 0.02:
		return {name = name, type = _pick(["box", "tuple", 3]), shape = _pick([[0], [-1], [1 << 40], "x", [1.5], [4096, 4096, 4096]])}
	match 1 if name.begins_with("a") and _rng.randf() < 0.7 else _rng.randi() % 5:
		0:
			return {name = name, type = "discrete", n = _mostly([1, 2, 3], [0, -1, 1 << 40]), start = _mostly([0, 0, -2, 5], [1 << 60])}
		1:
			return {name = name, type = "box", low = _mostly([-1.0, 0, -2.0], [-INF, 3.0]), high = _mostly([1.0, 1.0, 2.0], [INF, NAN]), shape = [2]}
		2:
			return {name = name, type = "box", dtype = "uint8", shape = _pick([[2, 2, 1], [4], [3, 3]]), low = 0, high = 255}
		3:
			return {name = name, type = "multi_discrete", nvec = _mostly([[2, 3], [1]], [[], [0], [2, -1]])}
		_:
			return _pick([{name = name, type = "multi_binary", n = 3}, {name = name, type = "box", low = [-1.0, 0.0], high = 1.0}])


func _anything() -> Variant:
	return _pick([null, 1, -1, 1.5, NAN, "text", &"name", Vector2.ONE, [], [1, "x"], {}, {1: 2}, PackedByteArray(),
			PackedStringArray(["a"]), Callable(), RID(), NodePath("a/b"), _objects[0] if not _objects.is_empty() else null])


## Mostly what fits, now and then what does not.
func _mostly(good: Array, bad: Array) -> Variant:
	return _pick(bad if _rng.randf() < 0.03 else good)


func _pick(from: Array) -> Variant:
	return from[_rng.randi() % from.size()]


## That the choice 1, which pays, is what a world ends up with.
func _learns() -> String:
	var world: RefCounted = ClassDB.instantiate(&"ConsacWorld")
	world.call("create", {behaviours = [{agents = 8, observations = [{name = "o", type = "box"}],
			actions = [{name = "a", type = "discrete", n = 2}]}]})
	for i in 8:
		world.call("join", 0)
	world.call("train", {total_steps = 8192, hyperparameters = {n_steps = 64, ent_coef = 0.0, learning_rate = 0.003}})
	for i in 100000:
		match world.call("poll", 1.0):
			1:
				world.call("add_rewards", 0, world.call("actions", 0))
				world.call("offer")
			2:
				world.call("offer")
			3:
				world.call("poll", 0.0)
				return str(world.call("actions", 0))
			4:
				return world.call("last_error")
	return "it never ended"
