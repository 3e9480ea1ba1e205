#pragma once
// Forward kinematics and the Jacobian: where a robot's links are, and how they move with its joints. Deterministic, no
// allocation after creation. One object per thread.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/robot/robot.h"

namespace consac::robot {

/// A frame that is fixed to a link: a tool point.
struct Frame {
  std::int32_t link = 0;
  Transform offset;  ///< in the link's frame
};

/// A joint's position: what the positions make of it, mimics included; 0 for a fixed joint.
double JointPosition(const Joint& joint, std::span<const double> positions);
/// What a joint's motion is, in its rest frame: a turn about X or a shift along X.
Transform JointMotion(const Joint& joint, double position);

/// The poses of one robot's links.
class Kinematics {
 public:
  /// `robot` must outlive this. All positions are 0.
  explicit Kinematics(const Robot& robot);

  /// Computes all links for `positions` ([positions], rad or m, not clamped). Cost: some 60 multiplications per joint.
  void Forward(std::span<const double> positions);
  /// Frames of the links in the base's, [L]; valid until the next Forward.
  std::span<const Transform> links() const { return links_; }
  /// A frame fixed to a link, in the base's.
  Transform Pose(const Frame& frame) const { return links_[static_cast<std::size_t>(frame.link)] * frame.offset; }
  /// How `frame` moves per unit of each position, at the latest Forward: `jacobian` is [6, positions] row-major; rows 0
  /// to 2 its velocity (m/s), 3 to 5 its angular velocity (rad/s), both along the base's axes.
  void Jacobian(const Frame& frame, std::span<double> jacobian) const;
  /// The robot.
  const Robot& robot() const { return *robot_; }

 private:
  const Robot* robot_;
  std::vector<Transform> links_;
};

/// Limits of each position, [positions] each.
struct PositionLimits {
  std::vector<double> lower, upper, velocity;
};
/// Those of the robot's joints, joints that follow included; a joint whose followers allow nothing keeps its own.
PositionLimits LimitsOf(const Robot& robot);
/// Brings `positions` within `limits`.
void ClampToLimits(const PositionLimits& limits, std::span<double> positions);

}  // namespace consac::robot
