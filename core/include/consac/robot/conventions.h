#pragma once
// Units and handedness: the one place where a pose is written as another program counts. Used by the joint table, the
// writers of glTF and the engines' components. Source: glTF 2.0, 3.4; Unreal's FRotator::Quaternion.
//
//            up  hand   length  angle    from the robot's (x, y, z)
//   kRobot    z  right  m       rad      x, y, z                      URDF, MJCF, this library
//   kGltf     y  right  m       rad      x, z, -y                     glTF; Godot
//   kUnreal   z  left   cm      degree   100 x, -100 y, 100 z         Unreal Engine
// The X axis stays the X axis in each, so a joint that turns about its local X does so everywhere, and by the same
// sign: what is +q here is a rotation about X by +q in glTF and Godot, and a roll of +q degrees in Unreal.

#include <cstdint>

#include "consac/robot/robot.h"

namespace consac::robot {

/// How a program counts positions and rotations.
enum class Convention : std::uint8_t { kRobot, kGltf, kUnreal };

/// A point or a shift of the robot's, as `convention` writes it.
Vector3 PositionIn(Convention convention, Vector3 position);
/// A rotation of the robot's, as `convention` writes it (x, y, z, w).
Quaternion RotationIn(Convention convention, const Quaternion& rotation);
/// A frame of the robot's, as `convention` writes it.
Transform TransformIn(Convention convention, const Transform& transform);
/// The robot's frame of what `convention` writes.
Transform TransformFrom(Convention convention, const Transform& written);
/// What a joint's node is set to: the angle about its local X (rad; in Unreal degrees of roll) of one that turns.
double AngleIn(Convention convention, double angle);
/// The shift along its local X (m; in Unreal cm) of one that slides.
double ShiftIn(Convention convention, double shift);
/// AngleIn or ShiftIn, as a joint of that type is moved.
double JointIn(Convention convention, JointType type, double position);
/// The position (rad or m) of what JointIn wrote.
double JointFrom(Convention convention, JointType type, double written);
}  // namespace consac::robot
