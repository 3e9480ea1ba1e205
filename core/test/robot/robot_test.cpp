// Re-basing keeps every pose; what is no tree, no name or no axis is named.
#include "consac/robot/robot.h"

#include <gtest/gtest.h>

#include <cmath>

#include "consac/base/rng.h"
#include "consac/robot/kinematics.h"
#include "core/test/robot/small_robot.h"

namespace consac::robot {
namespace {

void ExpectRefused(const RobotDescription& description, const std::string& part) {
  const Result<Robot> robot = MakeRobot(description);
  ASSERT_FALSE(robot.ok()) << part;
  EXPECT_NE(robot.status().message().find(part), std::string::npos) << robot.status().message();
}

// Where a link is by the file's own frames: T_j Rot(axis, q), link by link.
Transform ByTheFile(const RobotDescription& description, const Robot& robot, const std::string& link,
                    std::span<const double> positions) {
  for (const JointDescription& joint : description.joints) {
    if (joint.child != link) continue;
    const Joint& row = robot.joints[static_cast<std::size_t>(robot.FindJoint(joint.name))];
    const double q = JointPosition(row, positions);
    Transform motion;
    if (joint.type == JointType::kPrismatic) motion.position = (q / Norm(joint.axis)) * joint.axis;
    if (joint.type == JointType::kRevolute || joint.type == JointType::kContinuous)
      motion.rotation = RotationAbout((1.0 / Norm(joint.axis)) * joint.axis, q);
    return ByTheFile(description, robot, joint.parent, positions) * joint.origin * motion;
  }
  return {};
}

TEST(RobotTable, ReBasedJointsMoveAboutXAndEveryLinkStandsWhereTheFileSays) {
  const RobotDescription description = SmallArm();
  const Robot robot = MustMake(description);
  EXPECT_EQ(robot.positions(), 4);
  Kinematics kinematics(robot);
  Rng rng(7, 1);
  for (int i = 0; i < 200; ++i) {
    const std::vector<double> positions = SomePositions(robot, rng);
    kinematics.Forward(positions);
    for (std::size_t link = 0; link < robot.links.size(); ++link) {
      const Quaternion turn = link == 0 ? Quaternion{} : robot.joints[link - 1].axis_turn;
      const Transform file = kinematics.links()[link] * Transform{Inverse(turn), {}};
      EXPECT_LT(Difference(file, ByTheFile(description, robot, robot.links[link].name, positions)), 1e-13)
          << robot.links[link].name;
    }
  }
}

TEST(RobotTable, AMimicFollowsThroughOthersAndNarrowsTheLimits) {
  RobotDescription description = SmallArm();
  description.links.push_back({"third finger", std::nullopt});
  JointDescription third = description.joints.back();
  third.name = "third", third.child = "third finger";
  third.mimic = Mimic{"grip mimic", -2.0, 0.01};
  third.drive.lower = -1.0, third.drive.upper = 1.0;
  description.joints.insert(description.joints.begin(), third);  // before what it follows
  const Robot robot = MustMake(description);
  std::vector<double> positions(4, 0.0);
  positions[static_cast<std::size_t>(robot.joints[static_cast<std::size_t>(robot.FindJoint("grip"))].position_index)] =
      0.01;
  const auto at = [&](const char* joint) {
    return JointPosition(robot.joints[static_cast<std::size_t>(robot.FindJoint(joint))], positions);
  };
  EXPECT_NEAR(at("grip mimic"), 0.017, 1e-15);
  EXPECT_NEAR(at("third"), -0.024, 1e-15);
  const PositionLimits limits = LimitsOf(robot);
  EXPECT_NEAR(limits.lower[3], 0.0, 1e-15);
  EXPECT_NEAR(limits.upper[3], 0.03, 1e-15) << "the mimic's 0.05 would be reached at 0.032";
  EXPECT_NEAR(limits.velocity[3], 2.0 / 3.0, 1e-15) << "the third finger moves three times as fast";
}

TEST(RobotTable, InertiaTurnsWithTheFrame) {
  RobotDescription description = SmallArm();
  description.links[1].inertial = Inertial{2.0, {0.1, 0.2, 0.3}, {1, 0.1, 0.2, 2, 0.3, 3}};
  const Robot robot = MustMake(description);
  const Inertial& body = *robot.links[1].inertial;
  EXPECT_NEAR(Norm(Rotate(robot.joints[0].axis_turn, body.centre) - Vector3{0.1, 0.2, 0.3}), 0.0, 1e-15);
  EXPECT_NEAR(body.inertia[0], 3.0, 1e-14) << "about the new x, which was z";
  EXPECT_NEAR(body.inertia[0] + body.inertia[3] + body.inertia[5], 6.0, 1e-14);
}

TEST(RobotTable, AnInertiaThatIsZeroButForRoundingIsTaken) {
  RobotDescription description = SmallArm();
  description.links[1].inertial = Inertial{0.5, {}, {-5.42101e-20, 0, 0, -5.42101e-20, 0, 0}};  // iCub's r_hip_2
  const Robot robot = MustMake(description);
  for (const std::size_t moment : {0, 3, 5}) EXPECT_GE(robot.links[1].inertial->inertia[moment], 0.0);
  description.links[1].inertial->inertia[0] = -1e-9;
  EXPECT_FALSE(MakeRobot(description).ok());
}

TEST(RobotTable, RefusesWhatIsNoTree) {
  RobotDescription description = SmallArm();
  description.links.push_back({"lonely", std::nullopt});
  ExpectRefused(description, "links 'base' and 'lonely' both hang on nothing: two roots");
  description = SmallArm();
  description.joints.push_back(description.joints[1]);
  description.joints.back().name = "lift again";
  ExpectRefused(description, "link 'arm' hangs on two joints, 'lift' and 'lift again': a closed chain");
  description = SmallArm();
  description.joints[0].parent = "arm";
  ExpectRefused(description, "'yaw', 'lift' are a loop");
  description = SmallArm();
  description.joints.push_back({});
  description.joints.back() = description.joints[0];
  description.joints.back().name = "closing";
  description.joints.back().parent = "tool", description.joints.back().child = "base";
  ExpectRefused(description, "are a loop");
  description.links.clear();
  ExpectRefused(description, "has no link");
}

TEST(RobotTable, RefusesJointsThatMakeNoSense) {
  const auto refused = [](auto change, const std::string& part) {
    RobotDescription description = SmallArm();
    change(description);
    ExpectRefused(description, part);
  };
  refused([](RobotDescription& d) { d.joints[0].axis = {}; }, "joint 'yaw': its axis is (0, 0, 0)");
  refused([](RobotDescription& d) { d.joints[0].axis.x = std::nan(""); }, "joint 'yaw': its axis is");
  refused([](RobotDescription& d) { d.joints[1].drive.lower = 3; }, "lower limit 3 is above its upper limit 2");
  refused([](RobotDescription& d) { d.joints[1].drive.velocity = -1; }, "velocity and effort");
  refused([](RobotDescription& d) { d.joints[1].origin.position.x = 1e9; }, "are the units metres?");
  refused([](RobotDescription& d) { d.joints[1].origin.position.x = std::nan(""); }, "are the units metres?");
  refused([](RobotDescription& d) { d.joints[1].name = "yaw"; }, "two joints are named 'yaw'");
  refused([](RobotDescription& d) { d.joints[1].name = ""; }, "joint");
  refused([](RobotDescription& d) { d.links[1].name = "base"; }, "two links are named 'base'");
  refused([](RobotDescription& d) { d.joints[1].child = "amr"; }, "names the link 'amr', which is not there");
  refused([](RobotDescription& d) { d.joints[5].mimic->joint = "grab"; }, "mimics 'grab', which is not there");
  refused([](RobotDescription& d) { d.joints[5].mimic->joint = "mount"; }, "mimics 'mount', which is fixed");
  refused([](RobotDescription& d) { d.joints[4].mimic = Mimic{"grip mimic"}; }, "mimics itself");
  refused(
      [](RobotDescription& d) {  // each is a number, their product none
        std::string above = "grip";
        for (int i = 0; i < 60; ++i) {
          d.links.push_back({"l" + std::to_string(i), std::nullopt});
          JointDescription joint = d.joints[5];
          joint.name = "m" + std::to_string(i), joint.child = d.links.back().name, joint.mimic = Mimic{above, 1e6};
          above = joint.name;
          d.joints.push_back(joint);
        }
      },
      "follows through others by a multiplier of");
  refused(
      [](RobotDescription& d) {
        for (int i = 0; i < 2000; ++i) d.links.push_back({"l" + std::to_string(i), std::nullopt});
      },
      "has 2007 links; at most 2000 are taken");
  refused([](RobotDescription& d) { d.links[1].inertial = Inertial{-1.0, {}, {}}; }, "its mass is -1");
}

}  // namespace
}  // namespace consac::robot
