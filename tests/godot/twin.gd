extends SceneTree
## ConsacTwin in the running engine, a line a check. Run by test_twin.py:
##   godot ... --script twin.gd -- CHECKS ...
## poses FOLDER POSES.json: prints poses of links, along the robot's axes
## moves FOLDER; dynamic FOLDER; massless FOLDER; refused FOLDER...; robot FOLDER
## reach FOLDER ACTIONS.json: prints what the agent of examples/yumi_reach sees

const READY := {yumi_joint_1_r = 0.0646, yumi_joint_2_r = -0.281, yumi_joint_7_r = -0.703, yumi_joint_3_r = 0.878,
		yumi_joint_4_r = -2.084, yumi_joint_5_r = 0.398, yumi_joint_6_r = 0.0}

var _failed := 0


func _initialize() -> void:
	_run.call_deferred()


func _run() -> void:
	var arguments := OS.get_cmdline_user_args()
	await call("_" + arguments[0], arguments.slice(1))
	quit(1 if _failed > 0 else 0)


func _check(what: String, right: bool) -> void:
	print("ok " if right else "FAIL ", what)
	_failed += 0 if right else 1


func _same(what: String, given: Variant, expected: Variant) -> void:
	_check(what if given == expected else "%s: %s, expected %s" % [what, given, expected], given == expected)


func _near(what: String, given: float, expected: float, within: float) -> void:
	_check("%s: %f, expected %f within %f" % [what, given, expected, within], absf(given - expected) <= within)


func _holds(what: String, text: String, part: String) -> void:
	_check("%s: %s" % [what, text], text.contains(part))


func _twin(folder: String, motion := ConsacTwin.Motion.KINEMATIC) -> ConsacTwin:
	var twin := ConsacTwin.new()
	twin.folder = folder
	twin.motion = motion
	root.add_child(twin)
	return twin


## All links' frames for each pose (a Dictionary), as [x axis, y axis, z axis, origin] along the robot's axes.
func _poses(arguments: PackedStringArray) -> void:
	var twin := _twin(arguments[0])
	_same("it is built", twin.fault(), "")
	twin.position = Vector3(7, 8, 9)  # what it stands in is no part of a pose
	for pose: Dictionary in JSON.parse_string(FileAccess.get_file_as_string(arguments[1])):
		_same("posed", twin.set_pose(pose), "")
		var frames := {}
		for link in twin.table.links:
			var frame := ConsacTwinConvention.pose_to_robot(twin.get_link_pose(link.name))
			var numbers: Array[float] = []
			for column: Vector3 in [frame.basis.x, frame.basis.y, frame.basis.z, frame.origin]:
				numbers.append_array([column.x, column.y, column.z])
			frames[link.name] = numbers
		print("frames: ", JSON.stringify(frames, "", false, true))


func _moves(arguments: PackedStringArray) -> void:
	var twin := _twin(arguments[0])
	_same("it is built", twin.fault(), "")
	_same("joints that move by themselves", twin.joint_names().size(), 16)
	_same("in the order of the table", twin.joint_names()[2], "yumi_joint_7_r")
	_subtree(twin, "yumi_joint_3_r", 0.5)
	_subtree(twin, "gripper_l_joint", 0.01)
	_same("a joint is where it was set", twin.get_joint("yumi_joint_3_r"), 0.5)
	_same("one that follows goes along", twin.get_joint("gripper_l_joint_m"), 0.01)
	_same("a fixed one stays", twin.get_joint("world_joint"), 0.0)
	var limits := twin.limits("yumi_joint_2_r")
	_same("limits", limits, PackedFloat64Array([-2.50454747661, 0.759218224618, 3.14159265359]))
	twin.set_joint("yumi_joint_2_r", 3.0)
	_same("held at the upper limit", twin.get_joint("yumi_joint_2_r"), limits[1])
	twin.set_joint("yumi_joint_2_r", -3.0)
	_same("and at the lower one", twin.get_joint("yumi_joint_2_r"), limits[0])
	var pose := twin.get_pose()
	pose[0] = 0.25
	_same("a pose in order", twin.set_pose(pose), "")
	_same("is taken", twin.get_pose(), pose)
	_same("an array of whole numbers", twin.set_pose([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]), "")
	_same("is taken, too", twin.get_joint("yumi_joint_1_r"), 0.0)
	twin.tool_link = "yumi_link_7_r"
	twin.tool_point = Vector3(0.143, 0, 0)
	twin.set_pose(READY)
	var tool := ConsacTwinConvention.pose_to_robot(twin.get_end_effector()).origin
	_near("the ready pose holds the tool at x", tool.x, 0.35, 1e-3)
	_near("y", tool.y, -0.15, 1e-3)
	_near("z", tool.z, 0.25, 1e-3)
	var hung := Node3D.new()
	twin.link_node("yumi_link_7_r").add_child(hung)
	hung.position = twin.tool_point
	_near("what hangs on a link is there", (hung.global_position - twin.get_end_effector().origin).length(), 0.0, 1e-6)
	Engine.print_error_messages = false
	var before := twin.get_pose()
	_holds("no such joint", twin.set_joint("elbow", 0.0), "'yumi' has no joint 'elbow'; there are yumi_joint_1_r, ")
	_holds("it follows", twin.set_joint("gripper_l_joint_m", 0.0), "joint 'gripper_l_joint_m' follows 'gripper_l_joint'; move that")
	_holds("it is fixed", twin.set_joint("world_joint", 0.0), "joint 'world_joint' is fixed")
	_holds("NaN", twin.set_joint("yumi_joint_1_r", NAN), "the position of joint 'yumi_joint_1_r' is nan, expected a finite number")
	_holds("a text", twin.set_pose({yumi_joint_1_r = "far"}), "is a String, expected a number")
	_holds("two numbers", twin.set_pose([0.0, 1.0]), "the pose has 2 positions, expected 16")
	_holds("no pose", twin.set_pose(3), "the pose is a int, expected a Dictionary or an Array")
	_holds("one is wrong", twin.set_pose({yumi_joint_1_r = 1.0, elbow = 1.0}), "has no joint 'elbow'")
	_same("then none has moved", twin.get_pose(), before)
	_check("no such joint is nowhere", is_nan(twin.get_joint("elbow")))
	_same("no such link", twin.link_node("elbow"), null)
	twin.tool_link = "elbow"
	_holds("which the editor says", twin._get_configuration_warnings()[0], "'yumi' has no link 'elbow'; there are world, ")


## Moving a joint moves what it carries, and nothing else by a bit.
func _subtree(twin: ConsacTwin, joint_name: String, position: float) -> void:
	var before := twin.table.links.map(func(link: ConsacTwinTable.Link) -> Transform3D: return twin.get_link_pose(link.name))
	_same("set", twin.set_joint(joint_name, position), "")
	var moved := {}
	for joint in twin.table.joints:
		var follows := joint.leader != null and joint.leader.name == joint_name
		if joint.name == joint_name or follows or moved.has(joint.parent):
			moved[joint.number + 1] = true
	var wrong := PackedStringArray()
	for link in twin.table.links:
		if (twin.get_link_pose(link.name) != before[link.index]) != moved.has(link.index):
			wrong.append(link.name)
	_same("%s carries %d links, and these alone move" % [joint_name, moved.size()], wrong, PackedStringArray())


func _dynamic(arguments: PackedStringArray) -> void:
	var twin := _twin(arguments[0], ConsacTwin.Motion.DYNAMIC)
	_same("it is built", twin.fault(), "")
	_same("targets", twin.set_pose(READY), "")
	twin.set_joint("gripper_r_joint", 0.02)
	await physics_frame
	_check("it does not jump", absf(twin.get_joint("yumi_joint_4_r")) < 0.2)
	var fastest := 0.0
	var before := twin.get_joint("yumi_joint_4_r")
	for tick in 240:
		await physics_frame
		fastest = maxf(fastest, absf(twin.get_joint("yumi_joint_4_r") - before) * 60.0)
		before = twin.get_joint("yumi_joint_4_r")
	_check("its fastest joint went at %f of 6.98 rad/s at most" % fastest, fastest < 7.0 * 1.1 and fastest > 3.0)
	for name: String in READY:
		_near("%s stands, rad" % name, twin.get_joint(name), READY[name], 1e-3)
	_near("the finger, m", twin.get_joint("gripper_r_joint"), 0.02, 1e-4)
	_near("and the one that follows", twin.get_joint("gripper_r_joint_m"), 0.02, 1e-4)
	var same := ConsacTwin.new()
	same.folder = arguments[0]
	root.add_child(same)
	same.set_pose(twin.get_pose())
	var off := twin.get_link_pose("yumi_link_7_r").origin - same.get_link_pose("yumi_link_7_r").origin
	_near("bodies hang together as the joints say, m", off.length(), 0.0, 1e-3)
	await _push(twin)
	twin.place({yumi_joint_1_r = -1.0})
	_near("placed at once", twin.get_joint("yumi_joint_1_r"), -1.0, 1e-5)
	await physics_frame
	await physics_frame
	_near("and it stays", twin.get_joint("yumi_joint_1_r"), -1.0, 1e-2)


## Against what is stronger than its motor, whose effort the test has set to 60 N m: the engine's limit holds, the motor
## gives way, and it brings the joint back.
func _push(twin: ConsacTwin) -> void:
	twin.place({})
	twin.set_joint("yumi_joint_2_r", 99.0)
	var upper := twin.limits("yumi_joint_2_r")[1]
	for tick in 240:
		await physics_frame
	_near("at its limit", twin.get_joint("yumi_joint_2_r"), upper, 1e-3)
	var link := twin.find_child("yumi_link_2_r", true, false) as RigidBody3D
	var most := -INF
	for tick in 60:
		link.apply_torque(link.global_transform.basis.x * 250.0)
		await physics_frame
		most = maxf(most, twin.get_joint("yumi_joint_2_r"))
	_near("pushed against it", most, upper, 0.05)
	var least := INF
	for tick in 30:
		link.apply_torque(link.global_transform.basis.x * -250.0)
		await physics_frame
		least = minf(least, twin.get_joint("yumi_joint_2_r"))
	_check("pushed off it, to %f: the motor is no stronger than it may be" % least, least < upper - 0.2)
	for tick in 240:
		await physics_frame
	_near("and back", twin.get_joint("yumi_joint_2_r"), upper, 1e-3)


func _massless(arguments: PackedStringArray) -> void:
	Engine.print_error_messages = false
	var twin := _twin(arguments[0], ConsacTwin.Motion.DYNAMIC)
	_holds("no mass is made up", twin.fault(), "twin.json says no mass of link 'yumi_link_1_r'; import with --density, or set missing_mass")
	twin.missing_mass = 0.5
	_same("but where the user gives one", twin.rebuild(), "")
	_same("which it weighs", (twin.find_child("yumi_link_3_r", true, false) as RigidBody3D).mass, 0.5)
	twin.set_joint("yumi_joint_1_r", 0.5)
	for tick in 180:
		await physics_frame
	_near("it moves", twin.get_joint("yumi_joint_1_r"), 0.5, 1e-2)


## What is wrong with each folder, a line each; nothing of it is built.
func _refused(arguments: PackedStringArray) -> void:
	Engine.print_error_messages = false
	for folder in arguments:
		var twin := _twin(folder)
		print("%s: %s" % [folder.get_file(), twin.fault()])
		_same("nothing of it is built", twin.get_child_count(true), 0)
		_same("and the editor says it", twin._get_configuration_warnings(), PackedStringArray([twin.fault()]))
		_holds("a call says why", twin.set_joint("yumi_joint_1_r", 0.0), "it is not built: " + twin.fault())
		twin.free()


## ConsacRobot, the native extension's: the same robot in double precision, and the way to where a tool should be.
func _robot(arguments: PackedStringArray) -> void:
	var table := arguments[0].path_join("twin.json")
	var robot: RefCounted = ClassDB.instantiate(&"ConsacRobot")
	_same("loaded", robot.load(table), "")
	var twin := _twin(arguments[0])
	_same("joints", PackedStringArray(robot.joint_names()), twin.joint_names())
	twin.set_pose(READY)
	_same("posed", robot.set_positions(twin.get_pose()), "")
	for link in ["yumi_link_7_r", "gripper_l_finger_r"]:
		var pose := ConsacTwinConvention.pose_to_robot(twin.get_link_pose(link))
		var exact: PackedFloat64Array = robot.link_pose(link)
		_near("the scene's %s is where the robot's is, m" % link, pose.origin.distance_to(_point(exact)), 0.0, 1e-6)
		var turn := Quaternion(exact[3], exact[4], exact[5], exact[6])
		_near("and turned so, rad", pose.basis.get_rotation_quaternion().angle_to(turn), 0.0, 1e-3)
	_same("a tool", robot.set_tool("yumi_link_7_r", PackedFloat64Array([0.143, 0, 0])), "")
	var start: PackedFloat64Array = robot.tool()
	_near("is where the ready pose has it, m", _point(start).distance_to(Vector3(0.35, -0.15, 0.25)), 0.0, 1e-3)
	_same("moved", robot.move_tool(PackedFloat64Array([0.02, -0.01, 0.03]), 0.5, 10), "")
	_near("it went there, m", (_point(robot.tool()) - _point(start)).distance_to(Vector3(0.02, -0.01, 0.03)), 0.0, 1e-3)
	_same("the other arm stands still", robot.positions()[9], 0.0)
	_same("back to a pose", robot.reach(start).reached, true)
	_near("it is there, m", _point(robot.tool()).distance_to(_point(start)), 0.0, 2e-5)
	_same("to a point", robot.reach(PackedFloat64Array([0.4, -0.2, 0.3])).reached, true)
	var far: Dictionary = robot.reach(PackedFloat64Array([3, 0, 0]))
	_check("out of reach: %s" % far, not far.reached and far.position_error > 1.0)
	robot.set_positions(PackedFloat64Array([9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9]))
	_same("limits are kept", robot.positions()[1], twin.limits("yumi_joint_2_r")[1])
	Engine.print_error_messages = false
	_holds("no such link", robot.set_tool("yumi_link_7", PackedFloat64Array([0, 0, 0])), "there is no link 'yumi_link_7' (did you mean 'yumi_link_7_")
	_holds("two numbers", robot.set_tool("yumi_link_7_r", PackedFloat64Array([0, 0])), "the point is [0, 0], 2 numbers; expected 3")
	_holds("NaN", robot.move_tool(PackedFloat64Array([0, NAN, 0]), 1.0, 1), "the way is [0, nan, 0]")
	_holds("no time", robot.move_tool(PackedFloat64Array([0, 0, 0]), 0.0, 1), "the way takes 0 s; expected more than 0")
	_holds("no part", robot.move_tool(PackedFloat64Array([0, 0, 0]), 1.0, 0), "the way has 0 parts; expected 1 to 1000")
	_holds("positions", robot.set_positions(PackedFloat64Array([1])), "what was given for positions is [1], 1 numbers; expected 16")
	_same("no pose", robot.reach(PackedFloat64Array([0, 0, 0, 0, 0, 0, 2])), {})
	_holds("said", robot.last_error(), "expected a quaternion of length 1 behind the point")
	_holds("no file", robot.load("res://none.json"), "there is no file 'res://none.json'")
	_holds("no table", robot.load("res://project.godot"), "res://project.godot: ")
	_same("a robot that could not be read leaves the one before", robot.joint_names().size(), 16)
	_holds("nothing loaded", ClassDB.instantiate(&"ConsacRobot").set_tool("a", PackedFloat64Array([0, 0, 0])), "no robot is loaded; call load() first")


static func _point(numbers: PackedFloat64Array) -> Vector3:
	return Vector3(numbers[0], numbers[1], numbers[2])


## The agent of the sample, given a goal and actions; what it sees after each, and earns.
func _reach(arguments: PackedStringArray) -> void:
	var scene: Node = (load("res://examples/yumi_reach/yumi_reach.tscn") as PackedScene).instantiate()
	scene.get_node("ConsacSync").free()
	scene.get_node("Twin").folder = arguments[0]
	root.add_child(scene)
	var agent := scene.get_node("Agent")
	_same("prepared", agent.prepare(), "")
	var given: Dictionary = JSON.parse_string(FileAccess.get_file_as_string(arguments[1]))
	agent.begin(PackedFloat64Array(given["goal"]))
	for action: Variant in [null] + given["actions"]:
		agent.forget_step()
		if action != null:
			agent.act({&"way": PackedFloat32Array(action)})
			agent.judge()
		agent.look()
		print("row: ", agent.row.to_byte_array().hex_encode(), " ", agent.reward)
	var shown := ConsacTwinConvention.point_to_robot(scene.get_node("Twin").get_end_effector().origin)
	_near("the twin's tool is where the agent says, m", shown.distance_to(Vector3(agent.row[0], agent.row[1], agent.row[2])), 0.0, 1e-6)
	var mark: Vector3 = scene.get_node("Twin/Goal").global_position - scene.get_node("Twin").get_end_effector().origin
	_near("and the ball as far as the goal", mark.length(), agent.distance(), 1e-6)
