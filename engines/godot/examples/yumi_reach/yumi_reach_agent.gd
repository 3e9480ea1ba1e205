extends ConsacAgent
## The right arm of ABB's YuMi brings the point between its fingers to a goal: the built-in world yumi-reach-v0 with its
## observation, action and reward (worlds/yumi_reach), on the twin. The native extension's [code]ConsacRobot[/code] moves
## the arm by the same inverse kinematics; the twin shows it. All numbers are the robot's: its base, z up, m, rad.

const STEP := 0.04  # s that a decision takes
const PARTS := 2  # of a decision: the straight way is followed this finely
const REACH := 0.05  # m a decision and axis
const NEAR := 0.05  # m
const GOAL_LOW := [0.20, -0.30, 0.10]  # m
const GOAL_HIGH := [0.50, 0.00, 0.40]
const JOINTS: Array[String] = ["yumi_joint_1_r", "yumi_joint_2_r", "yumi_joint_7_r", "yumi_joint_3_r", "yumi_joint_4_r",
		"yumi_joint_5_r", "yumi_joint_6_r"]  # in physical order
const READY := [3.7, -16.1, -40.3, 50.3, -119.4, 22.8, 0.0]  # degrees: gripper straight down
const READY_LEFT := {yumi_joint_1_l = -3.7, yumi_joint_2_l = -16.1, yumi_joint_7_l = 40.3, yumi_joint_3_l = 50.3,
		yumi_joint_4_l = 119.4, yumi_joint_5_l = 22.8}  # degrees: the other arm is out of the way

## Who reaches; its tool is what comes to the goal.
@export var twin: ConsacTwin
## Shows where the goal is; a child of the twin.
@export var mark: Node3D

var _robot: RefCounted  # ConsacRobot: in a script that is read without the extension there is no such type
var _places := PackedInt32Array()  # of the arm's joints among all of the robot's
var _joints := PackedFloat64Array()  # of the arm
var _speeds := PackedFloat64Array()
var _tool := PackedFloat64Array()
var _tool_speed := PackedFloat64Array()
var _goal := PackedFloat64Array()


func prepare() -> String:
	if not ClassDB.class_exists(&"ConsacRobot"):
		return "%s: it needs the native extension; see engines/godot/README.md" % name
	if not twin.fault().is_empty():
		return "%s: %s" % [twin.name, twin.fault()]
	_robot = ClassDB.instantiate(&"ConsacRobot")
	var fault: String = _robot.load(twin.folder.path_join("twin.json"))
	if fault.is_empty():
		var point := ConsacTwinConvention.point_to_robot(twin.tool_point)
		fault = _robot.set_tool(twin.tool_link, PackedFloat64Array([point.x, point.y, point.z]))
	var names: Array = _robot.joint_names()
	for joint in JOINTS:
		_places.append(names.find(joint))
		if fault.is_empty() and not names.has(joint):
			fault = "%s has no joint '%s'; it is another robot" % [twin.folder, joint]
	return fault if not fault.is_empty() else super()


func reset(_episode_seed: int) -> void:
	var goal := []
	for axis in 3:
		goal.append(rng.randf_range(GOAL_LOW[axis], GOAL_HIGH[axis]))
	begin(PackedFloat64Array(goal))


## Ready pose, everything at rest, and this goal.
func begin(goal: PackedFloat64Array) -> void:
	var positions := PackedFloat64Array()
	positions.resize(_robot.joint_names().size())
	for joint: String in READY_LEFT:
		positions[_robot.joint_names().find(joint)] = deg_to_rad(READY_LEFT[joint])
	for j in JOINTS.size():
		positions[_places[j]] = deg_to_rad(READY[j])
	_robot.set_positions(positions)
	_goal = goal
	mark.position = ConsacTwinConvention.point(Vector3(goal[0], goal[1], goal[2]))
	_speeds = PackedFloat64Array([0, 0, 0, 0, 0, 0, 0])
	_tool_speed = PackedFloat64Array([0, 0, 0])
	_arrive()


func act(chosen: Dictionary) -> void:
	var way := PackedFloat64Array()
	for axis in 3:
		way.append(REACH * clampf(chosen[&"way"][axis], -1.0, 1.0))
	var joints := _joints
	var tool := _tool
	_robot.move_tool(way, STEP, PARTS)
	_arrive()
	for j in JOINTS.size():
		_speeds[j] = (_joints[j] - joints[j]) / STEP
	for axis in 3:
		_tool_speed[axis] = (_tool[axis] - tool[axis]) / STEP


func observe(into: Dictionary) -> void:
	into[&"achieved_goal"] = _tool
	into[&"desired_goal"] = _goal
	into[&"observation"] = _joints + _speeds + _tool + _tool_speed


func judge() -> void:
	var reached := distance() <= NEAR
	add_reward(0.0 if reached else -1.0)
	if steps + 1 == max_steps:
		note(&"reached", 1.0 if reached else 0.0)


## From the tool to the goal, m, of the numbers as they are observed.
func distance() -> float:
	var tool := PackedFloat32Array(Array(_tool))
	var goal := PackedFloat32Array(Array(_goal))
	var squared := 0.0
	for axis in 3:
		squared += (tool[axis] - goal[axis]) ** 2
	return sqrt(squared)


## Straight to the goal.
func heuristic(into: Dictionary) -> void:
	var way := PackedFloat32Array()
	for axis in 3:
		way.append((_goal[axis] - _tool[axis]) / maxf(distance(), REACH))
	into[&"way"] = way


# Where the arm is now, and the twin with it.
func _arrive() -> void:
	var positions: PackedFloat64Array = _robot.positions()
	twin.place(positions)
	_joints = PackedFloat64Array()
	for place in _places:
		_joints.append(positions[place])
	_tool = (_robot.tool() as PackedFloat64Array).slice(0, 3)
