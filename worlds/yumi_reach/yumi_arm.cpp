#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::worlds {
namespace {

using robot::Vector3;

constexpr double kDegree = robot::kPiRadians / 180.0;  // rad

struct ArmJoint {
  const char* name;
  Vector3 position, roll_pitch_yaw;  // of its frame in the link before, m and rad; it turns about z
  double lower, upper, velocity;     // rad, rad/s
};

constexpr double kRightAngle = 1.57079632679;  // as the file has it
constexpr ArmJoint kJoints[kYumiJoints] = {
    // The torso stands 0.1 m above `world`.
    {"yumi_joint_1_r",
     {0.05355, -0.0725, 0.51492},
     {-0.9795, -0.5682, -2.3155},
     -2.94087978961,
     2.94087978961,
     3.14159265359},
    {"yumi_joint_2_r", {0.03, 0.0, 0.1}, {kRightAngle, 0.0, 0.0}, -2.50454747661, 0.759218224618, 3.14159265359},
    {"yumi_joint_7_r", {-0.03, 0.17283, 0.0}, {-kRightAngle, 0.0, 0.0}, -2.94087978961, 2.94087978961, 3.14159265359},
    {"yumi_joint_3_r",
     {-0.0405, 0.0, 0.07867},
     {kRightAngle, -kRightAngle, 0.0},
     -2.15548162621,
     1.3962634016,
     3.14159265359},
    {"yumi_joint_4_r", {0.0405, 0.16461, 0.0}, {-kRightAngle, 0.0, 0.0}, -5.06145483078, 5.06145483078, 6.98131700798},
    {"yumi_joint_5_r", {-0.027, 0.0, 0.10039}, {kRightAngle, 0.0, 0.0}, -1.53588974176, 2.40855436775, 6.98131700798},
    {"yumi_joint_6_r", {0.027, 0.029, 0.0}, {-kRightAngle, 0.0, 0.0}, -3.99680398707, 3.99680398707, 6.98131700798},
};
constexpr Vector3 kToolInLink7{0.0, 0.0, 0.143};  // m, in the file's frame

robot::Robot MakeArm() {
  robot::RobotDescription description;
  description.name = "yumi right arm";
  description.links.push_back({"world", std::nullopt});
  for (const ArmJoint& row : kJoints) {
    robot::JointDescription joint;
    joint.name = row.name;
    joint.type = robot::JointType::kRevolute;
    joint.parent = description.links.back().name;
    joint.child = std::string("yumi_link_") + std::to_string(description.links.size()) + "_r";
    joint.origin = {robot::FromRollPitchYaw(row.roll_pitch_yaw), row.position};
    joint.axis = {0, 0, 1};
    joint.drive.lower = row.lower, joint.drive.upper = row.upper, joint.drive.velocity = row.velocity;
    description.links.push_back({joint.child, std::nullopt});
    description.joints.push_back(joint);
  }
  return *robot::MakeRobot(description);
}

}  // namespace

const robot::Robot& YumiRightArm() {
  static const robot::Robot arm = MakeArm();
  return arm;
}

robot::Frame YumiTool() {
  const robot::Quaternion back = robot::Inverse(YumiRightArm().joints.back().axis_turn);
  return {static_cast<std::int32_t>(kYumiJoints), {back, robot::Rotate(back, kToolInLink7)}};
}

const std::array<double, kYumiJoints>& YumiReadyPose() {
  static constexpr std::array<double, kYumiJoints> kPose = {
      3.7 * kDegree, -16.1 * kDegree, -40.3 * kDegree, 50.3 * kDegree, -119.4 * kDegree, 22.8 * kDegree, 0.0};
  return kPose;
}

}  // namespace consac::worlds
