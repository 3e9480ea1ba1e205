#pragma once
// An arm without a symmetry, for tests: nothing that is turned or mirrored wrongly hides in it.

#include <gtest/gtest.h>

#include <vector>

#include "consac/base/rng.h"
#include "consac/robot/robot.h"

namespace consac::robot {

/// base -> turret (about z) -> arm (about a slanted axis) -> slide (prismatic) -> tool (fixed); two fingers on the
/// tool, the second follows the first.
inline RobotDescription SmallArm() {
  RobotDescription arm;
  arm.name = "small arm";
  for (const char* name : {"base", "turret", "arm", "slide", "tool", "finger", "other finger"})
    arm.links.push_back({name, std::nullopt});
  const auto add = [&](const char* name, JointType type, const char* parent, const char* child, Transform origin,
                       Vector3 axis, double lower, double upper) {
    JointDescription joint;
    joint.name = name, joint.type = type, joint.parent = parent, joint.child = child;
    joint.origin = origin, joint.axis = axis, joint.drive.lower = lower, joint.drive.upper = upper;
    joint.drive.velocity = 2.0;
    joint.source = "test";
    arm.joints.push_back(joint);
  };
  add("yaw", JointType::kContinuous, "base", "turret", {FromRollPitchYaw({0.1, 0.2, 0.3}), {0.1, 0.02, 0.3}}, {0, 0, 2},
      0, 0);
  add("lift", JointType::kRevolute, "turret", "arm", {FromRollPitchYaw({1.5, -0.4, 0.7}), {0.05, -0.03, 0.2}},
      {0.6, -0.64, 0.48}, -1.5, 2.0);
  add("out", JointType::kPrismatic, "arm", "slide", {FromRollPitchYaw({0, 0.5, 0}), {0.3, 0.01, -0.02}}, {-1, 0, 0},
      -0.2, 0.4);
  add("mount", JointType::kFixed, "slide", "tool", {FromRollPitchYaw({0, 0, 1.0}), {0.1, 0, 0.04}}, {0, 0, 0}, 0, 0);
  add("grip", JointType::kPrismatic, "tool", "finger", {{}, {0.02, 0.01, 0.05}}, {0, 1, 0}, 0.0, 0.03);
  add("grip mimic", JointType::kPrismatic, "tool", "other finger", {{}, {0.02, -0.01, 0.05}}, {0, -1, 0}, 0.0, 0.05);
  arm.joints.back().mimic = Mimic{"grip", 1.5, 0.002};
  return arm;
}

/// The robot of a description that must be one.
inline Robot MustMake(const RobotDescription& description) {
  Result<Robot> robot = MakeRobot(description);
  EXPECT_TRUE(robot.ok()) << robot.status().message();
  return robot.ok() ? std::move(*robot) : Robot{};
}

/// Positions within limits, or within a turn and a half where there are none.
inline std::vector<double> SomePositions(const Robot& robot, Rng& rng) {
  std::vector<double> positions;
  for (const std::int32_t j : robot.position_joints) {
    const JointDrive& drive = robot.joints[static_cast<std::size_t>(j)].drive;
    const bool limited = drive.upper - drive.lower < 1e3;
    positions.push_back(limited ? rng.Between(drive.lower, drive.upper) : rng.Between(-9.0, 9.0));
  }
  return positions;
}

/// How far apart two frames are: metres or radians, whichever is more.
inline double Difference(const Transform& a, const Transform& b) {
  return std::max(Norm(a.position - b.position), AngleBetween(a.rotation, b.rotation));
}

}  // namespace consac::robot
