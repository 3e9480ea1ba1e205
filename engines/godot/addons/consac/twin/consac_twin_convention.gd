@tool
class_name ConsacTwinConvention
extends RefCounted
## Units and handedness of twins: the one place where a robot's poses (z up, right-handed, m) become the engine's (y up,
## right-handed, m), and back. The X axis stays the X axis, so a joint turns about its own X by +q in both.
## Source: core/include/consac/robot/conventions.h, kGltf, and docs/twin.md.

# The robot's axes as the engine sees them, one after the other: x, z, -y of the robot are the engine's x, y, z.
const TURN := Basis(Vector3(1, 0, 0), Vector3(0, 0, -1), Vector3(0, 1, 0))


## A point or direction of the robot's, as the engine writes it.
static func point(of_robot: Vector3) -> Vector3:
	return TURN * of_robot


## A point or direction of the engine's, as the robot's files write it.
static func point_to_robot(of_engine: Vector3) -> Vector3:
	return TURN.transposed() * of_engine


## A frame of the engine's, as the robot's files write it.
static func pose_to_robot(of_engine: Transform3D) -> Transform3D:
	return Transform3D(TURN.transposed() * of_engine.basis * TURN, point_to_robot(of_engine.origin))


## An inertia of the robot's (xx, xy, xz, yy, yz, zz), as a matrix along the engine's axes.
static func inertia(of_robot: PackedFloat64Array) -> Basis:
	var i := of_robot
	var matrix := Basis(Vector3(i[0], i[1], i[2]), Vector3(i[1], i[3], i[4]), Vector3(i[2], i[4], i[5]))
	return TURN * matrix * TURN.transposed()


## How a joint at [param position] (rad or m) stands in its rest frame.
static func motion(joint_type: StringName, position: float) -> Transform3D:
	if joint_type == &"prismatic":
		return Transform3D(Basis(), Vector3(position, 0.0, 0.0))
	return Transform3D(Basis(Vector3.RIGHT, position), Vector3.ZERO)
