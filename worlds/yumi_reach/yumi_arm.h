#pragma once
// One arm of ABB's YuMi (IRB 14000) as a kinematic world knows it: seven joints, the tool point of its gripper, and a
// pose from which it begins. Numbers of examples/robots/yumi's calibrated URDF, which is within 0.007 mm of
// RobotStudio.

#include <array>

#include "consac/robot/kinematics.h"

namespace consac::worlds {

inline constexpr std::size_t kYumiJoints = 7;  ///< of an arm, in physical order: 1, 2, 7, 3, 4, 5, 6

/// The right arm; its base is the robot's frame `world`: z up from the underside of the torso, x ahead, m.
const robot::Robot& YumiRightArm();
/// Between the gripper's fingers, 136 mm from the flange.
robot::Frame YumiTool();
/// Joints of the pose with the gripper straight down and nothing near, rad; tool point at (0.350, -0.150, 0.250) m.
const std::array<double, kYumiJoints>& YumiReadyPose();

}  // namespace consac::worlds
