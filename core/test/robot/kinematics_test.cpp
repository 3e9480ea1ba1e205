// The Jacobian against differences, inverse kinematics back to where forward kinematics came from, within limits.
#include "consac/robot/kinematics.h"

#include <gtest/gtest.h>

#include "consac/robot/inverse_kinematics.h"
#include "core/test/robot/small_robot.h"

namespace consac::robot {
namespace {

Frame ToolOf(const Robot& robot) {
  return {robot.FindLink("other finger"), {FromRollPitchYaw({0.3, 0.2, 0.1}), {0.02, 0.05, 0.1}}};
}

TEST(RobotKinematics, TheJacobianIsWhatDifferencesSay) {
  const Robot robot = MustMake(SmallArm());
  Kinematics kinematics(robot), other(robot);
  const Frame tool = ToolOf(robot);
  const auto count = static_cast<std::size_t>(robot.positions());
  std::vector<double> jacobian(6 * count);
  Rng rng(1, 1);
  for (int i = 0; i < 20; ++i) {
    std::vector<double> positions = SomePositions(robot, rng);
    kinematics.Forward(positions);
    kinematics.Jacobian(tool, jacobian);
    const Transform at = kinematics.Pose(tool);
    for (std::size_t k = 0; k < count; ++k) {
      constexpr double kStep = 1e-6;
      positions[k] += kStep;
      other.Forward(positions);
      positions[k] -= kStep;
      const Transform moved = other.Pose(tool);
      const Vector3 linear = (1.0 / kStep) * (moved.position - at.position);
      const Vector3 angular = (1.0 / kStep) * RotationVector(moved.rotation * Inverse(at.rotation));
      const double expected[6] = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
      for (std::size_t row = 0; row < 6; ++row) EXPECT_NEAR(jacobian[row * count + k], expected[row], 1e-5) << row << k;
    }
  }
}

TEST(RobotKinematics, MovingAJointMovesExactlyWhatItCarries) {
  const Robot robot = MustMake(SmallArm());
  Kinematics before(robot), after(robot);
  Rng rng(2, 1);
  for (std::size_t k = 0; k < 4; ++k) {
    std::vector<double> positions = SomePositions(robot, rng);
    before.Forward(positions);
    positions[k] += 0.01;
    after.Forward(positions);
    for (std::size_t link = 0; link < robot.links.size(); ++link) {
      bool carried = false;
      for (std::size_t at = link; at > 0; at = static_cast<std::size_t>(robot.joints[at - 1].parent))
        carried = carried || robot.joints[at - 1].position_index == static_cast<std::int32_t>(k);
      EXPECT_EQ(before.links()[link] == after.links()[link], !carried) << robot.links[link].name;
    }
  }
}

// A chain of seven joints as cobots have them: shoulder, elbow and wrist of two and three crossing axes.
Robot SevenJoints() {
  RobotDescription description;
  description.name = "seven";
  description.links.push_back({"base", std::nullopt});
  const Vector3 axes[7] = {{0, 0, 1}, {0, 1, 0}, {0, 0, 1}, {0, 1, 0}, {0, 0, 1}, {0, 1, 0}, {0, 0, 1}};
  const double lengths[7] = {0.3, 0.0, 0.2, 0.2, 0.2, 0.2, 0.1};
  for (std::size_t i = 0; i < 7; ++i) {
    JointDescription joint;
    joint.name = "j" + std::to_string(i + 1), joint.type = JointType::kRevolute;
    joint.parent = description.links.back().name, joint.child = "l" + std::to_string(i + 1);
    joint.origin.position = {i % 2 == 0 ? 0.03 : -0.03, 0, lengths[i]};
    joint.axis = axes[i];
    joint.drive.lower = -2.2, joint.drive.upper = 2.2, joint.drive.velocity = 3.0;
    description.links.push_back({joint.child, std::nullopt});
    description.joints.push_back(joint);
  }
  return MustMake(description);
}

TEST(InverseKinematics, FindsPosesThatAreThere) {
  const Robot robot = SevenJoints();
  const Frame tool{7, {{}, {0, 0, 0.1}}};
  InverseKinematics inverse(robot, tool, {});
  Kinematics kinematics(robot);
  Rng rng(3, 1);
  int reached = 0;
  for (int i = 0; i < 200; ++i) {
    std::vector<double> wanted = SomePositions(robot, rng), start = wanted;
    kinematics.Forward(wanted);
    const Transform target = kinematics.Pose(tool);
    for (double& position : start) position += rng.Between(-0.5, 0.5);
    const InverseResult result = inverse.Solve(target, start);
    kinematics.Forward(start);
    EXPECT_NEAR(Norm(kinematics.Pose(tool).position - target.position), result.position_error, 1e-12);
    EXPECT_NEAR(AngleBetween(kinematics.Pose(tool).rotation, target.rotation), result.orientation_error, 1e-12);
    for (const double position : start) EXPECT_LE(std::abs(position), 2.2);
    EXPECT_EQ(result.reached, result.position_error <= 1e-5 && result.orientation_error <= 1e-4);
    reached += result.reached ? 1 : 0;
  }
  EXPECT_GE(reached, 190) << "of 200 that start half a radian away in every joint";
}

TEST(InverseKinematics, WhatIsOutOfReachIsSaidAndComesAsNearAsItGets) {
  const Robot robot = SevenJoints();
  InverseKinematics inverse(robot, {7, {}}, {.task = Task::kPosition});
  std::vector<double> positions(7, 0.1);
  const InverseResult result = inverse.Solve({{}, {0, 0, 5}}, positions);
  EXPECT_FALSE(result.reached);
  EXPECT_NEAR(result.position_error, 3.8, 0.02) << "1.2 m high at most";
  EXPECT_EQ(result.iterations, InverseOptions{}.most_iterations);
}

TEST(InverseKinematics, AStepKeepsSpeedsAndLimitsAndTheOtherJointsTakeOver) {
  const Robot robot = SevenJoints();
  const Frame tool{7, {}};
  InverseKinematics inverse(robot, tool, {.task = Task::kPosition});
  std::vector<double> positions = {0.3, 0.9, -0.2, 2.2, 0.4, 0.5, 0.0}, moves(7);
  const std::vector<double> furthest(7, 0.02);
  inverse.Forward(positions);
  inverse.Step({0.002, 0.001, -0.003}, {}, {}, moves);
  Kinematics kinematics(robot);
  kinematics.Forward(positions);
  const Vector3 before = kinematics.Pose(tool).position;
  EXPECT_EQ(inverse.tool().position, before);
  for (std::size_t k = 0; k < 7; ++k) positions[k] += moves[k];
  kinematics.Forward(positions);
  const Vector3 moved = kinematics.Pose(tool).position - before;
  EXPECT_LE(positions[3], 2.2);
  EXPECT_LT(Norm(moved - Vector3{0.002, 0.001, -0.003}), 2e-4) << "though the elbow stands at its limit";
  inverse.Forward(positions);
  inverse.Step({0.05, 0.05, 0.05}, {}, furthest, moves);
  for (const double move : moves) EXPECT_LE(std::abs(move), 0.02);
}

TEST(InverseKinematics, TheToolAdvancesOnAStraightLineWithinSpeeds) {
  const Robot robot = SevenJoints();
  InverseKinematics inverse(robot, {7, {}}, {.task = Task::kPosition});
  std::vector<double> positions = {0.3, 0.9, -0.2, 1.2, 0.4, 0.5, 0.0};
  inverse.Forward(positions);
  const Vector3 before = inverse.tool().position;
  const std::vector<double> start = positions;
  inverse.Advance({0.02, 0.01, -0.02}, 0.1, 4, positions);
  EXPECT_LT(Norm(inverse.tool().position - before - Vector3{0.02, 0.01, -0.02}), 1e-3);
  double furthest = 0.0;
  for (std::size_t k = 0; k < 7; ++k) furthest = std::max(furthest, std::abs(positions[k] - start[k]));
  // A hundredth of that time: no joint is as fast as that asks for.
  positions = start;
  inverse.Forward(positions);
  inverse.Advance({0.02, 0.01, -0.02}, 0.001, 4, positions);
  for (std::size_t k = 0; k < 7; ++k)
    EXPECT_LE(std::abs(positions[k] - start[k]), inverse.limits().velocity[k] * 0.001 * (1 + 1e-12));
  EXPECT_GT(furthest, inverse.limits().velocity[0] * 0.001) << "else the limit is not met";
  Kinematics kinematics(robot);
  kinematics.Forward(positions);
  EXPECT_EQ(kinematics.Pose({7, {}}), inverse.tool());
}

}  // namespace
}  // namespace consac::robot
