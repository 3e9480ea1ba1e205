#pragma once
// What the tests of the importer share: YuMi's data, its reference poses, and a GLB taken apart.

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "consac/robot/kinematics.h"
#include "consac/robot/transform.h"
#include "consac/twin/import.h"
#include "tests/files.h"

namespace consac::twin {

using testing::Put;
using testing::TextOf;

/// One of RobotStudio's poses: positions of an arm's joints in physical order, and where its flange is from its base.
struct ReferencePose {
  std::vector<double> joints;  // [7] rad
  robot::Transform flange;
};

/// Those of `yumi`, the folder of YuMi's data.
inline std::vector<ReferencePose> ReferencePoses(const std::string& yumi) {
  const double degree = robot::kPiRadians / 180.0;
  std::vector<ReferencePose> poses;
  const nlohmann::json json = nlohmann::json::parse(TextOf(yumi + "/reference_fk.json"));
  for (const auto& row : json["poses"]) {
    ReferencePose pose;
    for (const double q : row["q"]) pose.joints.push_back(q * degree);
    const std::vector<double> p = row["position"], rpy = row["rpy"];
    pose.flange.position = {p[0] / 1000, p[1] / 1000, p[2] / 1000};
    pose.flange.rotation = robot::FromRollPitchYaw({rpy[0] * degree, rpy[1] * degree, rpy[2] * degree});
    poses.push_back(pose);
  }
  return poses;
}

/// From the frame of joint 1 at rest, as the file has it, to the arm's base; from link 7 to the flange.
inline const robot::Transform kBaseOfArm{{0, 0, 1, 0}, {0, 0, -0.206}};
inline const robot::Transform kFlange{{0, 0, 1, 0}, {0, 0, 0.007}};

/// How far off RobotStudio's ten poses a robot is.
struct Deviation {
  double position = 0.0;     // m, of the worst pose
  double orientation = 0.0;  // rad
};

/// `link_pose(positions, link)` says where a link's frame of the file is; both arms are looked at.
template <class LinkPose>
Deviation OffReference(const robot::Robot& robot, const std::vector<ReferencePose>& poses, const LinkPose& link_pose) {
  Deviation worst;
  for (const std::string side : {"r", "l"}) {
    const auto link = [&](int i) { return robot.FindLink("yumi_link_" + std::to_string(i) + "_" + side); };
    const std::vector<double> zero(robot.position_joints.size(), 0.0);
    const robot::Transform base = link_pose(zero, link(1)) * kBaseOfArm;
    for (const ReferencePose& pose : poses) {
      std::vector<double> positions = zero;
      constexpr int kPhysical[7] = {1, 2, 7, 3, 4, 5, 6};
      for (std::size_t i = 0; i < 7; ++i) {
        const std::int32_t joint = robot.FindJoint("yumi_joint_" + std::to_string(kPhysical[i]) + "_" + side);
        positions[static_cast<std::size_t>(robot.joints[static_cast<std::size_t>(joint)].position_index)] =
            pose.joints[i];
      }
      const robot::Transform flange = Inverse(base) * link_pose(positions, link(7)) * kFlange;
      worst.position = std::max(worst.position, Norm(flange.position - pose.flange.position));
      worst.orientation = std::max(worst.orientation, AngleBetween(flange.rotation, pose.flange.rotation));
    }
  }
  return worst;
}

/// A link's frame of the file, by the joint table.
inline robot::Transform FileFrame(robot::Kinematics& kinematics, const std::vector<double>& positions,
                                  std::int32_t link) {
  kinematics.Forward(positions);
  const robot::Robot& robot = kinematics.robot();
  const robot::Quaternion turn =
      link == 0 ? robot::Quaternion{} : robot.joints[static_cast<std::size_t>(link) - 1].axis_turn;
  return kinematics.links()[static_cast<std::size_t>(link)] * robot::Transform{Inverse(turn), {}};
}

/// Off by these much, both arms.
inline Deviation OffReference(const robot::Robot& robot, const std::vector<ReferencePose>& poses) {
  robot::Kinematics kinematics(robot);
  return OffReference(robot, poses, [&](const std::vector<double>& positions, std::int32_t link) {
    return FileFrame(kinematics, positions, link);
  });
}

/// A GLB's JSON and numbers; checks the container.
struct Glb {
  nlohmann::json json;
  std::string numbers;
};
inline Glb TakeApart(const std::string& bytes) {
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  Glb glb;
  EXPECT_EQ(word(0), 0x46546C67u);
  EXPECT_EQ(word(4), 2u);
  EXPECT_EQ(word(8), bytes.size());
  const std::size_t length = word(12);
  EXPECT_EQ(length % 4, 0u);
  glb.json = nlohmann::json::parse(bytes.substr(20, length));
  if (20 + length < bytes.size()) {
    EXPECT_EQ(word(24 + length), 0x004E4942u);
    glb.numbers = bytes.substr(28 + length);
    EXPECT_EQ(word(20 + length), glb.numbers.size());
    EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.numbers.size());
  }
  return glb;
}

}  // namespace consac::twin
