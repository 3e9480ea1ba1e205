#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::worlds {
namespace {

using robot::Vector3;

constexpr double kDegree = robot::kPiRadians / 180.0;  // rad

constexpr double kRightAngle = 1.57079632679;  // as the file has it

struct ArmJoint {
  const char* name;                  // without its side
  Vector3 position, roll_pitch_yaw;  // of its frame in the link before, m and rad; it turns about z
  double lower, upper, velocity;     // rad, rad/s
};
struct ArmCapsule {
  std::int32_t link;  // of an arm, from 1
  Vector3 from, to;   // m
  double radius;      // m
};
// An arm's side: what its names end in, and where its first joint is. The torso stands 0.1 m above `world`.
struct Side {
  const char* name;
  Vector3 position, roll_pitch_yaw;
};

constexpr Side kRight{"r", {0.05355, -0.0725, 0.51492}, {-0.9795, -0.5682, -2.3155}};
constexpr Side kLeft{"l", {0.05355, 0.0725, 0.51492}, {0.9781, -0.5716, 2.3180}};
constexpr ArmJoint kJoints[kYumiJoints] = {
    {"yumi_joint_1_", {}, {}, -2.94087978961, 2.94087978961, 3.14159265359},
    {"yumi_joint_2_", {0.03, 0.0, 0.1}, {kRightAngle, 0.0, 0.0}, -2.50454747661, 0.759218224618, 3.14159265359},
    {"yumi_joint_7_", {-0.03, 0.17283, 0.0}, {-kRightAngle, 0.0, 0.0}, -2.94087978961, 2.94087978961, 3.14159265359},
    {"yumi_joint_3_",
     {-0.0405, 0.0, 0.07867},
     {kRightAngle, -kRightAngle, 0.0},
     -2.15548162621,
     1.3962634016,
     3.14159265359},
    {"yumi_joint_4_", {0.0405, 0.16461, 0.0}, {-kRightAngle, 0.0, 0.0}, -5.06145483078, 5.06145483078, 6.98131700798},
    {"yumi_joint_5_", {-0.027, 0.0, 0.10039}, {kRightAngle, 0.0, 0.0}, -1.53588974176, 2.40855436775, 6.98131700798},
    {"yumi_joint_6_", {0.027, 0.029, 0.0}, {-kRightAngle, 0.0, 0.0}, -3.99680398707, 3.99680398707, 6.98131700798},
};
// As `consac twin import` finds them around the meshes; the gripper and its fingers, closed, are link 7's.
constexpr ArmCapsule kCapsules[] = {
    {2, {-0.0273, -0.0017, 0.0014}, {-0.0051, 0.1345, 0.0292}, 0.0647},
    {3, {0.0303, -0.0050, 0.0032}, {0.0754, -0.0412, 0.0439}, 0.0585},
    {4, {-0.0316, 0.0001, -0.0029}, {0.0029, 0.1246, -0.0388}, 0.0580},
    {5, {0.0138, -0.0042, -0.0001}, {0.0885, -0.0500, 0.0259}, 0.0467},
    {6, {-0.0103, -0.0101, -0.0222}, {-0.0182, -0.0131, -0.0077}, 0.0596},
    {7, {-0.0014, -0.0007, -0.0002}, {-0.0015, 0.0000, -0.0002}, 0.0328},
    {7, {0.0311, -0.0010, 0.0075}, {0.0728, -0.0029, -0.0096}, 0.0474},
    {7, {0.0911, 0.0000, 0.0000}, {0.1311, 0.0000, 0.0000}, 0.0180},
};
constexpr Vector3 kToolInLink7{0.0, 0.0, 0.143};  // m, in the file's frame

void AddArm(const Side& side, robot::RobotDescription& description) {
  for (std::size_t j = 0; j < kYumiJoints; ++j) {
    const ArmJoint& row = kJoints[j];
    const bool first = j == 0;
    robot::JointDescription joint;
    joint.name = std::string(row.name) + side.name;
    joint.type = robot::JointType::kRevolute;
    joint.parent = first ? description.links.front().name : description.links.back().name;
    joint.child = "yumi_link_" + std::to_string(j + 1) + "_" + side.name;
    joint.origin = {robot::FromRollPitchYaw(first ? side.roll_pitch_yaw : row.roll_pitch_yaw),
                    first ? side.position : row.position};
    joint.axis = {0, 0, 1};
    joint.drive.lower = row.lower, joint.drive.upper = row.upper, joint.drive.velocity = row.velocity;
    description.links.push_back({joint.child, std::nullopt});
    description.joints.push_back(joint);
  }
}

robot::Robot MakeRightArm() {
  robot::RobotDescription description{"yumi right arm", {{"world", std::nullopt}}, {}};
  AddArm(kRight, description);
  return *robot::MakeRobot(description);
}

robot::Robot MakeBothArms() {
  robot::RobotDescription description{"yumi", {{"world", std::nullopt}}, {}};
  AddArm(kRight, description);
  AddArm(kLeft, description);
  robot::Robot robot = *robot::MakeRobot(description);
  constexpr auto kArm = static_cast<std::int32_t>(kYumiJoints);
  for (const std::int32_t before : {0, kArm}) {
    for (const ArmCapsule& row : kCapsules) robot.capsules.push_back({before + row.link, row.from, row.to, row.radius});
    for (std::int32_t a = 1; a <= kArm; ++a) {
      for (std::int32_t b = a + 1; b <= kArm; ++b) robot.allowed_collisions.emplace_back(before + a, before + b);
    }
  }
  return robot;
}

// The tool of the arm whose last link this is.
robot::Frame ToolOn(std::int32_t link) {
  const robot::Joint& last = YumiBothArms().joints[static_cast<std::size_t>(link) - 1];
  const robot::Quaternion back = robot::Inverse(last.axis_turn);
  return {link, {back, robot::Rotate(back, kToolInLink7)}};
}

}  // namespace

const robot::Robot& YumiRightArm() {
  static const robot::Robot arm = MakeRightArm();
  return arm;
}

const robot::Robot& YumiBothArms() {
  static const robot::Robot arms = MakeBothArms();
  return arms;
}

robot::Frame YumiTool() {
  return ToolOn(static_cast<std::int32_t>(kYumiJoints));
}

robot::Frame YumiLeftTool() {
  return ToolOn(static_cast<std::int32_t>(2 * kYumiJoints));
}

const std::array<double, kYumiJoints>& YumiReadyPose() {
  static constexpr std::array<double, kYumiJoints> kPose = {
      3.7 * kDegree, -16.1 * kDegree, -40.3 * kDegree, 50.3 * kDegree, -119.4 * kDegree, 22.8 * kDegree, 0.0};
  return kPose;
}

std::array<double, kYumiJoints> YumiLeftReadyPose() {
  constexpr double kMirror[kYumiJoints] = {-1, 1, -1, 1, -1, 1, -1};  // the arms are alike, their bases are mirrored
  std::array<double, kYumiJoints> pose = YumiReadyPose();
  for (std::size_t j = 0; j < kYumiJoints; ++j) pose[j] *= kMirror[j];
  return pose;
}

}  // namespace consac::worlds
