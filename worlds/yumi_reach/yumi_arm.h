#pragma once
// The arms of ABB's YuMi (IRB 14000) as a kinematic world knows them: seven joints each, the tool point of the gripper,
// a pose from which they begin, and capsules around them. Numbers of examples/robots/yumi's calibrated URDF, which is
// within 0.007 mm of RobotStudio, and of its import's capsules.

#include <array>

#include "consac/robot/kinematics.h"

namespace consac::worlds {

inline constexpr std::size_t kYumiJoints = 7;  ///< of an arm, in physical order: 1, 2, 7, 3, 4, 5, 6

/// The right arm; its base is the robot's frame `world`: z up from the underside of the torso, x ahead, m.
const robot::Robot& YumiRightArm();
/// Both arms, the right one first, with capsules from link 2 on; an arm is not held against itself.
const robot::Robot& YumiBothArms();
/// Between the fingers of the right gripper of either robot, 136 mm from the flange.
robot::Frame YumiTool();
/// The same of the left one, of YumiBothArms.
robot::Frame YumiLeftTool();
/// Joints of the right arm's pose with the gripper straight down and nothing near, rad; tool point at (0.350, -0.150,
/// 0.250) m.
const std::array<double, kYumiJoints>& YumiReadyPose();
/// The left arm's, its mirror: tool point at (0.350, 0.150, 0.250) m within 3 mm.
std::array<double, kYumiJoints> YumiLeftReadyPose();

}  // namespace consac::worlds
