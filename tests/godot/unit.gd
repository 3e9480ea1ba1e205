extends SceneTree
## Checks of the add-on's scripts, run by test_wire.py inside the engine: "ok" or "FAIL" a line.

var _failed := 0


func _initialize() -> void:
	_run.call_deferred()


func _run() -> void:
	_entries()
	_agents()
	_goals()
	_images()
	_command_line()
	_framer()
	_overlong()
	_speed()
	_frame_bound()
	_transform_sensor()
	await _ray_sensors()
	await _pause()
	print("%d failed" % _failed)
	quit(1 if _failed > 0 else 0)


func _check(what: String, value: Variant, expected: Variant) -> void:
	var right: bool = value == expected
	_failed += 0 if right else 1
	print("ok %s" % what if right else "FAIL %s: %s, expected %s" % [what, value, expected])


func _holds(what: String, text: String, part: String) -> void:
	_check("%s: %s" % [what, text], text.contains(part), true)


func _entries() -> void:
	_check("a box is right", ConsacEntry.box(&"a", 3).fault(), "")
	_check("a box has its numbers", ConsacEntry.box(&"a", 3).numbers(), 3)
	_holds("low above high", ConsacEntry.box(&"a", 1, 2.0, 1.0).fault(), "low 2.0 above high 1.0")
	_holds("no name", ConsacEntry.box(&"", 1).fault(), "no name")
	_holds("no choice", ConsacEntry.discrete(&"a", 0).fault(), "0 choices")


func _goals() -> void:
	var goals := ConsacGoals.new()
	var entries: Array[ConsacEntry] = [
		ConsacEntry.box(&"speed", 1), ConsacEntry.box(&"desired_goal", 2), ConsacEntry.box(&"achieved_goal", 2)]
	_check("goals are right", goals.fault(entries), "")
	_check("where goals are", ConsacGoals.places(entries), PackedInt32Array([3, 1, 2]))
	var at := ConsacGoals.places(entries)
	_check("reached", goals.worth(PackedFloat32Array([9, 1, 1, 1, 1.05]), at), 0.0)
	_check("not reached", goals.worth(PackedFloat32Array([9, 1, 1, 1, 1.06]), at), -1.0)
	goals.pay = ConsacGoals.Pay.DENSE
	_check("how far", goals.worth(PackedFloat32Array([9, 1, 1, 4, 5]), at), -5.0)
	goals.threshold = -1.0
	_holds("bad threshold", goals.fault(entries), "threshold is -1.0")
	entries[1] = ConsacEntry.box(&"desired_goal", 3)
	_holds("unlike goals", goals.fault(entries), "differ in size, low or high")
	entries[1] = ConsacEntry.discrete(&"desired_goal", 3)
	_holds("no box", goals.fault(entries), "'desired_goal' is no box")
	var agent := _Speaker.new()
	agent.observations = [ConsacEntry.box(&"achieved_goal", 1), ConsacEntry.box(&"desired_goal", 1)]
	_holds("goals that nothing pays", ConsacSceneCheck._fault_of_goals(agent), "set goals to a ConsacGoals")
	agent.goals = ConsacGoals.new()
	_check("goals that are paid", ConsacSceneCheck._fault_of_goals(agent), "")
	agent.observations.pop_back()
	_holds("pay without goals", ConsacSceneCheck._fault_of_goals(agent), "add a box for each")
	agent.free()


func _agents() -> void:
	var agent := _Speaker.new()
	agent.name = "Speaker"
	_holds("no entries", agent.prepare(), "no observation entries")
	agent.observations = [ConsacEntry.box(&"a", 1), ConsacEntry.box(&"a", 2)]
	_holds("one name twice", agent.prepare(), "two entries are named 'a'")
	agent.observations = [ConsacEntry.box(&"a", 1), ConsacEntry.box(&"b", 2), ConsacEntry.discrete(&"c", 3)]
	agent.actions = [ConsacEntry.box(&"turn", 1), ConsacEntry.box(&"move", 2), ConsacEntry.discrete(&"jump", 2)]
	_check("prepared", agent.prepare(), "")
	agent.says = {&"a": 1.5, &"b": Vector2(2, 3), &"c": 2}
	_check("observed", agent.look(), "")
	_check("in a row", agent.row, PackedFloat32Array([1.5, 2, 3, 2]))
	var cases := [
		[&"a", null, "nothing for entry 'a'"],
		[&"b", [1.0], "1 numbers for entry 'b', expected 2"],
		[&"b", "text", "a String for entry 'b'"],
		[&"c", 3, "3.0 for entry 'c', expected 0 to 2"],
	]
	for bad: Array in cases:
		agent.says[bad[0]] = bad[1]
		_holds("bad observation", agent.look(), bad[2])
		agent.says = {&"a": 1.5, &"b": Vector2(2, 3), &"c": 2}
	agent.says.erase(&"c")
	_holds("no longer observed", agent.look(), "nothing for entry 'c'")
	agent.says[&"c"] = 2
	agent.says[&"b"] = Vector2(2, NAN)
	_check("not finite, but of the right kind", agent.look(), "")
	_holds("not finite", agent.blame_for(agent.row), "observe() gave nan for entry 'b'")
	agent.action_row = PackedFloat32Array([0.5, 0.25, -1, 1])
	agent.hand_over()
	_check("acts", agent.heard, {&"turn": 0.5, &"move": PackedFloat32Array([0.25, -1]), &"jump": 1})
	agent.actions = [ConsacEntry.box(&"turn", 1, 2.0, 6.0), ConsacEntry.discrete(&"jump", 2)]
	agent.prepare()
	agent.ask_heuristic()
	_check("unless overridden: the middle, the first", agent.action_row, PackedFloat32Array([4, 0]))
	agent.masks_actions = true
	agent.look()
	_check("unless overridden: all is legal", agent.mask_row, PackedByteArray([1, 1]))
	agent.legal = PackedByteArray([0, 1])
	agent.look()
	_check("what is legal", agent.mask_row, PackedByteArray([0, 1]))
	agent.legal = PackedByteArray([0, 0])
	_holds("nothing legal", agent.look(), "mask() leaves no legal choice for action 'jump'")
	_check("and the game's own mask is not written to", agent.legal, PackedByteArray([0, 0]))
	agent.legal = PackedByteArray([1])
	_holds("a mask too small", agent.look(), "mask() gave 1 bytes for action 'jump', expected a PackedByteArray of 2")
	agent.masks_actions = false
	agent.add_reward(INF)
	_holds("bad reward", agent.account(), "the reward of step 1 of its episode is inf")
	agent.start_episode(3)
	agent.max_steps = 2
	agent.account()
	_check("not yet over", agent.truncated, false)
	agent.account()
	_check("cut off", agent.truncated and not agent.terminated, true)
	agent.free()


func _images() -> void:
	var agent := _Speaker.new()
	var eye := ConsacEntry.image(&"eye", Vector2i(3, 2), 1)
	agent.observations = [eye]
	agent.actions = [eye]
	_holds("an image to do", agent.prepare(), "entry 'eye' is an image; an agent acts by numbers and choices")
	agent.actions = [ConsacEntry.discrete(&"jump", 2)]
	_check("an image to see", agent.prepare(), "")
	_holds("no image", agent.look(), "observe() gave nothing for entry 'eye', expected a PackedByteArray of 6 (2 x 3 x 1)")
	agent.says = {&"eye": "text"}
	_holds("no bytes", agent.look(), "a String for entry 'eye'")
	agent.says = {&"eye": PackedByteArray([1, 2, 3, 4, 5])}
	_holds("too few bytes", agent.look(), "5 bytes for entry 'eye', expected a PackedByteArray of 6")
	agent.says = {&"eye": PackedByteArray([1, 2, 3, 4, 5, 6])}
	_check("an image", agent.look(), "")
	agent.free()


func _command_line() -> void:
	var sync := ConsacSync.new()
	var cases := {
		"gamma:0.9,learning_rate:lin_1e-3": {"gamma": "0.9", "learning_rate": "lin_1e-3"},
		"net_arch:64,64,gamma:0.9": {"net_arch": "64,64", "gamma": "0.9"},
		"net_arch:[64,{pi:[64],vf:[32,32]}],gamma:0.9": {"net_arch": "[64,{pi:[64],vf:[32,32]}]", "gamma": "0.9"},
		"gamma:0.9,": {"gamma": "0.9"},
		"": {},
	}
	for text: String in cases:
		_check("--consac-set=%s is read" % text, ConsacCommandLine._assign(sync, "set", text), "")
		_check("--consac-set=%s" % text, sync.hyperparameters, cases[text])
	var lines := {
		"steps=1e5": "", "steps=12": "", "fast=yes": "", "deadline=0.5": "",
		"steps=1.5": "'1.5' is no whole number", "steps=nan": "'nan' is no number", "fast=maybe": "expected 1 or 0",
		"port=70000": "expected 0 to 65535", "mode=ply": "there are serve, train, act, by_hand",
	}
	for line: String in lines:
		var parts := line.split("=")
		_check("--consac-" + line, ConsacCommandLine._assign(sync, parts[0], parts[1]), lines[line])
		if line == "steps=1e5":
			_check("which is", sync.training_length, 100000)
	_check("--consac-set=0.9", ConsacCommandLine._assign(sync, "set", "0.9"), "expected NAME:VALUE,NAME:VALUE")
	sync.free()


## A game that a player pauses: its world stands still, so there is nothing to learn or to record.
func _pause() -> void:
	var world := Node.new()
	var sync := ConsacSync.new()
	sync.mode = ConsacSync.Mode.BY_HAND
	sync.show_budget = false
	var agent := _Speaker.new()
	agent.observations = [ConsacEntry.box(&"a", 1)]
	agent.actions = [ConsacEntry.box(&"turn", 1)]
	agent.says = {&"a": 1.5}
	world.add_child(sync)
	world.add_child(agent)
	root.add_child(world)
	while sync.backend == null:
		await physics_frame
	var backend := _Noting.new()
	backend.begin(sync.agents)
	sync.backend = backend
	for tick in 5:
		await physics_frame
	_check("the world goes", sync.steps > 0, true)
	paused = true
	await physics_frame
	var before := sync.steps
	for tick in 10:
		await physics_frame
	_check("no step while the game is paused", sync.steps, before)
	_check("the backend knows", backend.told, [true])
	paused = false
	for tick in 5:
		await physics_frame
	_check("then it goes on", sync.steps > before, true)
	_check("which the backend knows, too", backend.told, [true, false])
	world.free()


## The cases that every receiver of text protocol 1 must get right, in pieces of every size.
func _framer() -> void:
	var path := ""
	for argument in OS.get_cmdline_user_args():
		if argument.begins_with("--transcripts="):
			path = argument.trim_prefix("--transcripts=")
	var cases: Array = JSON.parse_string(FileAccess.get_file_as_string(path))
	for case: Dictionary in cases:
		if case["expect"] != "action":
			continue
		for piece: int in [1, 2, 3, 1000]:
			var messages := _frame(case["chunks"], piece, case.get("single_character", false))
			_check("%s, %d bytes at a time" % [case["name"], piece], messages, case["messages"])


func _frame(chunks: Array, piece: int, single_character: bool) -> Array:
	var framer := ConsacTextFramer.new()
	framer.single_character = single_character
	var messages := []
	var now := 0
	for chunk: String in chunks:
		if chunk == "quiet":
			now += 1000000
			_drain(framer, now, messages)
			continue
		var bytes := chunk.to_utf8_buffer()
		for at in range(0, bytes.size(), piece):
			framer.feed(bytes.slice(at, at + piece), now)
			_drain(framer, now, messages)
	return messages


func _overlong() -> void:
	var framer := ConsacTextFramer.new()
	var bytes := PackedByteArray()
	bytes.resize(ConsacTextFramer.LONGEST)
	bytes.fill(49)
	_check("as long as a message may be", framer.feed(bytes, 0), true)
	_check("and longer", framer.feed(PackedByteArray([49]), 0), false)


func _drain(framer: ConsacTextFramer, now: int, messages: Array) -> void:
	while true:
		var message := framer.next(now)
		if message.is_empty():
			return
		messages.append(message.get_string_from_ascii())


func _speed() -> void:
	var before := _settings()
	var speed := ConsacSpeed.new()
	speed.change(true)
	_check("a tick is as long as before", Engine.time_scale / Engine.physics_ticks_per_second, before[2] / before[1])
	_check("it goes faster", _settings() != before, true)
	speed.change(true)
	speed.restore()
	_check("all settings are back", _settings(), before)
	speed.restore()
	_check("and stay", _settings(), before)


func _frame_bound() -> void:
	var root := Node.new()
	root.add_child(Node2D.new())
	_check("nothing goes with frames", ConsacSceneCheck.frame_bound(root), null)
	for node: Node in [Timer.new(), AnimationPlayer.new(), AnimatedSprite2D.new(), AnimatedSprite3D.new()]:
		root.add_child(node)
		_check("%s goes with frames" % node.get_class(), ConsacSceneCheck.frame_bound(root), node)
		root.remove_child(node)
		node.free()
	root.free()


func _settings() -> Array:
	return [Engine.max_fps, Engine.physics_ticks_per_second, Engine.time_scale, Engine.max_physics_steps_per_frame,
			Engine.physics_jitter_fix, OS.low_processor_usage_mode, OS.low_processor_usage_mode_sleep_usec]


func _transform_sensor() -> void:
	var from := Node3D.new()
	var to := RigidBody3D.new()
	root.add_child(from)
	root.add_child(to)
	from.position = Vector3(1, 0, 0)
	from.rotation.y = PI / 2.0  # looks along -x
	to.position = Vector3(-4, 0, 0)
	to.linear_velocity = Vector3(-2, 0, 0)
	var sensor := ConsacTransformSensor.new()
	sensor.observer = from
	sensor.subject = to
	_check("six numbers", sensor.entries()[0].size, 6)
	var seen := _rounded(sensor)
	_check("straight ahead, half as far as can be seen, going away", seen, [0.0, 0.0, -0.5, 0.0, 0.0, -0.2])
	sensor.turned = false
	_check("in the world's axes", _rounded(sensor), [-0.5, 0.0, 0.0, -0.2, 0.0, 0.0])
	for node: Node in [sensor, from, to]:
		node.free()


func _ray_sensors() -> void:
	var wall := StaticBody3D.new()
	var shape := CollisionShape3D.new()
	shape.shape = BoxShape3D.new()
	wall.add_child(shape)
	wall.position = Vector3(0, 0, -5.5)  # its near side at 5
	wall.add_to_group(&"wall")
	var eye := Node3D.new()
	var sensor_3d := ConsacRaySensor3D.new()
	sensor_3d.body = eye
	var wall_2d := StaticBody2D.new()
	var shape_2d := CollisionShape2D.new()
	shape_2d.shape = RectangleShape2D.new()
	shape_2d.shape.size = Vector2(1, 1)
	wall_2d.add_child(shape_2d)
	wall_2d.position = Vector2(5.5, 0)
	wall_2d.add_to_group(&"coin")
	var eye_2d := Node2D.new()
	var sensor_2d := ConsacRaySensor2D.new()
	sensor_2d.body = eye_2d
	for node: Node in [wall, eye, wall_2d, eye_2d]:
		root.add_child(node)
	await physics_frame
	await physics_frame
	for sensor: ConsacRaySensor in [sensor_3d, sensor_2d]:
		sensor.count = 3
		sensor.classes = [&"coin", &"wall"]
		_check("three numbers a ray", sensor.entries()[0].size, 9)
	_check("a wall ahead in 3D", _rounded(sensor_3d), [1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 1.0, 0.0, 0.0])
	_check("a coin ahead in 2D", _rounded(sensor_2d), [1.0, 0.0, 0.0, 0.5, 1.0, 0.0, 1.0, 0.0, 0.0])
	for node: Node in [sensor_3d, sensor_2d, wall, eye, wall_2d, eye_2d]:
		node.free()


func _rounded(sensor: ConsacSensor) -> Array:
	var into := {}
	sensor.sense(into)
	var numbers := []
	for number: float in into[sensor.entry_name]:
		numbers.append(snappedf(number, 0.001) + 0.0)
	return numbers


class _Speaker:
	extends ConsacAgent
	var says := {}
	var heard := {}
	var legal := PackedByteArray()

	func observe(into: Dictionary) -> void:
		into.merge(says, true)

	func mask(into: Dictionary) -> void:
		if not legal.is_empty():
			into[&"jump"] = legal

	func act(chosen: Dictionary) -> void:
		heard = chosen.duplicate()


class _Noting:
	extends ConsacHandBackend
	var told := []

	func set_paused(paused: bool) -> void:
		told.append(paused)
