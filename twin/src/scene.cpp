#include "scene.h"

#include "consac/robot/kinematics.h"

namespace consac::twin {

std::optional<double> HeldAt(const robot::Robot& robot, const robot::Joint& joint) {
  if (joint.type == robot::JointType::kFixed) return std::nullopt;
  const robot::JointDrive& leader = robot.LeaderOf(joint).drive;
  if (leader.lower == leader.upper) return joint.multiplier * leader.lower + joint.offset;
  return joint.drive.lower == joint.drive.upper ? std::optional(joint.drive.lower) : std::nullopt;
}

bool Moves(const robot::Robot& robot, const robot::Joint& joint) {
  return joint.type != robot::JointType::kFixed && !HeldAt(robot, joint).has_value();
}

robot::Transform RestOf(const robot::Robot& robot, const robot::Joint& joint) {
  const std::optional<double> held = HeldAt(robot, joint);
  return held.has_value() ? joint.rest * JointMotion(joint, *held) : joint.rest;
}

}  // namespace consac::twin
