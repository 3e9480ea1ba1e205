#include "consac/robot/posture.h"

#include <cmath>
#include <string>
#include <utility>

#include "consac/base/text.h"

namespace consac::robot {
namespace {

Status CanBe(const Joint& joint, double position) {
  if (std::abs(position) <= kFurthestPosition) return Status::Ok();  // not a number is not
  return {StatusCode::kInvalidArgument, "joint " + Quote(joint.name) + " cannot be brought to " +
                                            std::to_string(position) + ", which is no number of rad or m"};
}

}  // namespace

Posture::Posture(Robot robot)
    : robot_(std::make_unique<const Robot>(std::move(robot))),
      kinematics_(*robot_),
      limits_(LimitsOf(*robot_)),
      positions_(robot_->position_joints.size(), 0.0) {
  Take();
}

Status Posture::Set(std::int32_t joint, double position) {
  if (joint < 0 || static_cast<std::size_t>(joint) >= robot_->joints.size())
    return {StatusCode::kNotFound, "the robot has no joint number " + std::to_string(joint)};
  const Joint& which = robot_->joints[static_cast<std::size_t>(joint)];
  if (which.position_index < 0)
    return {StatusCode::kInvalidArgument, "joint " + Quote(which.name) + " is fixed and cannot be moved"};
  if (which.mimics >= 0)
    return {StatusCode::kInvalidArgument,
            "joint " + Quote(which.name) + " follows joint " + Quote(robot_->LeaderOf(which).name) + "; move that one"};
  CONSAC_RETURN_IF_ERROR(CanBe(which, position));
  positions_[static_cast<std::size_t>(which.position_index)] = position;
  Take();
  return Status::Ok();
}

Status Posture::SetAll(std::span<const double> positions) {
  if (positions.size() != positions_.size())
    return {StatusCode::kInvalidArgument, "a pose of this robot has " + std::to_string(positions_.size()) +
                                              " numbers, and " + std::to_string(positions.size()) + " are given"};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto joint = static_cast<std::size_t>(robot_->position_joints[i]);
    CONSAC_RETURN_IF_ERROR(CanBe(robot_->joints[joint], positions[i]));
  }
  positions_.assign(positions.begin(), positions.end());
  Take();
  return Status::Ok();
}

void Posture::Take() {
  ClampToLimits(limits_, positions_);
  kinematics_.Forward(positions_);
}

}  // namespace consac::robot
