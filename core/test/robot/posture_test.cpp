// A robot in a pose: what moves with a joint and what does not, limits, joints that follow, what is refused.
#include "consac/robot/posture.h"

#include <gtest/gtest.h>

#include "consac/robot/conventions.h"
#include "core/test/robot/small_robot.h"

namespace consac::robot {
namespace {

std::vector<Transform> LinksOf(const Posture& posture) {
  return {posture.links().begin(), posture.links().end()};
}

TEST(RobotPosture, AJointMovesExactlyWhatHangsOnIt) {
  Posture posture(MustMake(SmallArm()));
  const Robot& robot = posture.robot();
  for (const std::int32_t moved : robot.position_joints) {
    const std::vector<Transform> before = LinksOf(posture);
    ASSERT_TRUE(posture.Set(moved, posture.At(moved) + 0.01).ok());
    for (std::size_t link = 0; link < before.size(); ++link) {
      bool hangs = false;
      for (auto at = static_cast<std::int32_t>(link); at > 0 && !hangs;) {
        const Joint& joint = robot.joints[static_cast<std::size_t>(at) - 1];
        hangs = at - 1 == moved || joint.mimics == moved;
        at = joint.parent;
      }
      EXPECT_EQ(posture.links()[link] != before[link], hangs) << robot.links[link].name;
    }
  }
}

TEST(RobotPosture, KeepsLimitsAndMovesWhatFollows) {
  Posture posture(MustMake(SmallArm()));
  const Robot& robot = posture.robot();
  const std::int32_t lift = robot.FindJoint("lift"), grip = robot.FindJoint("grip"),
                     mimic = robot.FindJoint("grip mimic");
  ASSERT_TRUE(posture.Set(lift, 9.0).ok());
  EXPECT_EQ(posture.At(lift), 2.0);
  ASSERT_TRUE(posture.Set(lift, -9.0).ok());
  EXPECT_EQ(posture.At(lift), -1.5);
  ASSERT_TRUE(posture.Set(robot.FindJoint("yaw"), 100.0).ok());
  EXPECT_EQ(posture.At(robot.FindJoint("yaw")), 100.0) << "it turns without end";
  ASSERT_TRUE(posture.Set(grip, 0.02).ok());
  EXPECT_NEAR(posture.At(mimic), 1.5 * 0.02 + 0.002, 1e-15);
  EXPECT_EQ(posture.At(robot.FindJoint("mount")), 0.0);
  const std::vector<double> far(posture.positions().size(), 1000.0);
  ASSERT_TRUE(posture.SetAll(far).ok());
  EXPECT_EQ(posture.At(grip), 0.03);
}

TEST(RobotPosture, BeginsWithinItsLimits) {
  RobotDescription description = SmallArm();
  description.joints[1].drive.lower = 0.25;
  EXPECT_EQ(Posture(MustMake(description)).positions()[1], 0.25);
}

TEST(RobotPosture, SaysWhatCannotBeAndStaysAsItWas) {
  Posture posture(MustMake(SmallArm()));
  const Robot& robot = posture.robot();
  ASSERT_TRUE(posture.Set(robot.FindJoint("lift"), 0.5).ok());
  const std::vector<Transform> before = LinksOf(posture);
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  const auto message = [&](const Status& status) { return std::string(status.message()); };
  EXPECT_EQ(posture.Set(99, 0.0).code(), StatusCode::kNotFound);
  EXPECT_EQ(posture.Set(-1, 0.0).code(), StatusCode::kNotFound);
  EXPECT_NE(message(posture.Set(robot.FindJoint("mount"), 0.1)).find("'mount' is fixed"), std::string::npos);
  EXPECT_NE(message(posture.Set(robot.FindJoint("grip mimic"), 0.01)).find("follows joint 'grip'"), std::string::npos);
  EXPECT_NE(message(posture.Set(robot.FindJoint("lift"), nothing)).find("'lift'"), std::string::npos);
  EXPECT_FALSE(posture.Set(robot.FindJoint("yaw"), kNoLimit).ok());
  EXPECT_FALSE(posture.Set(robot.FindJoint("yaw"), 1e300).ok());
  EXPECT_FALSE(posture.SetAll({}).ok());
  std::vector<double> pose(posture.positions().begin(), posture.positions().end());
  pose[0] = 0.7, pose[2] = nothing;
  EXPECT_NE(message(posture.SetAll(pose)).find("'out'"), std::string::npos);
  EXPECT_EQ(LinksOf(posture), before);
}

TEST(RobotPosture, PositionsComeBackFromEveryConvention) {
  for (const Convention convention : {Convention::kRobot, Convention::kGltf, Convention::kUnreal}) {
    for (const JointType type : {JointType::kRevolute, JointType::kContinuous, JointType::kPrismatic})
      EXPECT_NEAR(JointFrom(convention, type, JointIn(convention, type, 0.3)), 0.3, 1e-15);
  }
  EXPECT_NEAR(JointIn(Convention::kUnreal, JointType::kRevolute, kPiRadians / 6), 30.0, 1e-12);
  EXPECT_NEAR(JointIn(Convention::kUnreal, JointType::kPrismatic, 0.025), 2.5, 1e-12);
}

}  // namespace
}  // namespace consac::robot
