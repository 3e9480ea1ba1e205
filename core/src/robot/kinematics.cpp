#include "consac/robot/kinematics.h"

#include <algorithm>
#include <cmath>

namespace consac::robot {

double JointPosition(const Joint& joint, std::span<const double> positions) {
  if (joint.position_index < 0) return 0.0;
  return joint.multiplier * positions[static_cast<std::size_t>(joint.position_index)] + joint.offset;
}

Transform JointMotion(const Joint& joint, double position) {
  if (joint.type == JointType::kPrismatic) return {{}, {position, 0, 0}};
  return {RotationAboutX(position), {}};
}

Kinematics::Kinematics(const Robot& robot) : robot_(&robot), links_(robot.links.size()) {
  const std::vector<double> zero(robot.position_joints.size(), 0.0);
  Forward(zero);
}

void Kinematics::Forward(std::span<const double> positions) {
  CONSAC_ASSERT(positions.size() == robot_->position_joints.size());
  for (std::size_t j = 0; j < robot_->joints.size(); ++j) {
    const Joint& joint = robot_->joints[j];
    const Transform& parent = links_[static_cast<std::size_t>(joint.parent)];
    links_[j + 1] = parent * joint.rest;
    if (joint.type == JointType::kFixed) continue;
    links_[j + 1] = links_[j + 1] * JointMotion(joint, JointPosition(joint, positions));
  }
}

void Kinematics::Jacobian(const Frame& frame, std::span<double> jacobian) const {
  const std::size_t columns = robot_->position_joints.size();
  CONSAC_ASSERT(jacobian.size() == 6 * columns);
  std::fill(jacobian.begin(), jacobian.end(), 0.0);
  const Vector3 point = Pose(frame).position;
  for (std::int32_t link = frame.link; link > 0;) {
    const Joint& joint = robot_->joints[static_cast<std::size_t>(link) - 1];
    const Transform& at = links_[static_cast<std::size_t>(link)];
    link = joint.parent;
    if (joint.position_index < 0) continue;
    const Vector3 axis = Rotate(at.rotation, {joint.multiplier, 0, 0});
    const bool slides = joint.type == JointType::kPrismatic;
    const Vector3 linear = slides ? axis : Cross(axis, point - at.position);
    const Vector3 angular = slides ? Vector3{} : axis;
    const double rows[6] = {linear.x, linear.y, linear.z, angular.x, angular.y, angular.z};
    for (std::size_t row = 0; row < 6; ++row)
      jacobian[row * columns + static_cast<std::size_t>(joint.position_index)] += rows[row];
  }
}

PositionLimits LimitsOf(const Robot& robot) {
  const std::size_t count = robot.position_joints.size();
  PositionLimits limits{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const JointDrive& own = robot.joints[static_cast<std::size_t>(robot.position_joints[i])].drive;
    limits.lower[i] = own.lower, limits.upper[i] = own.upper, limits.velocity[i] = own.velocity;
  }
  for (const Joint& joint : robot.joints) {
    if (joint.mimics < 0 || joint.multiplier == 0.0) continue;
    const auto i = static_cast<std::size_t>(joint.position_index);
    const double ends[2] = {(joint.drive.lower - joint.offset) / joint.multiplier,
                            (joint.drive.upper - joint.offset) / joint.multiplier};
    const double lower = std::max(limits.lower[i], std::min(ends[0], ends[1]));
    const double upper = std::min(limits.upper[i], std::max(ends[0], ends[1]));
    limits.velocity[i] = std::min(limits.velocity[i], joint.drive.velocity / std::abs(joint.multiplier));
    if (lower <= upper) limits.lower[i] = lower, limits.upper[i] = upper;
  }
  return limits;
}

void ClampToLimits(const PositionLimits& limits, std::span<double> positions) {
  for (std::size_t i = 0; i < positions.size(); ++i)
    positions[i] = std::clamp(positions[i], limits.lower[i], limits.upper[i]);
}

}  // namespace consac::robot
