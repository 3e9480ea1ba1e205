#pragma once
// A robot held in a pose: each joint brought somewhere by its number, limits kept, joints that follow moved along. What
// an engine's component of a robot stands on. Not how it gets there: nothing here has a speed or a mass.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "consac/base/status.h"
#include "consac/robot/kinematics.h"

namespace consac::robot {

/// What a joint without limits may be brought to, rad or m: beyond it a place is no number any more.
inline constexpr double kFurthestPosition = 1e9;

/// One robot and the pose that it is in. One object per thread.
class Posture {
 public:
  /// Every position is 0, or what the limits have nearest to it.
  explicit Posture(Robot robot);

  /// Brings a joint that moves by itself to `position` (rad or m), or to the limit that it would pass. kNotFound where
  /// there is no such number, kInvalidArgument where the joint is fixed or follows another, or `position` is no
  /// number up to kFurthestPosition; the pose is then as it was.
  Status Set(std::int32_t joint, double position);
  /// The same of all of them, [positions]; kInvalidArgument also where there are more or fewer.
  Status SetAll(std::span<const double> positions);

  /// What moves by itself, [positions], rad or m, within limits.
  std::span<const double> positions() const { return positions_; }
  /// Where a joint is, rad or m: what it follows included; 0 of a fixed one. `joint` is one of the robot's.
  double At(std::int32_t joint) const {
    return JointPosition(robot().joints[static_cast<std::size_t>(joint)], positions_);
  }
  /// What the positions may be, [positions].
  const PositionLimits& limits() const { return limits_; }
  /// Frames of the links in the base's, [L]; valid until the pose changes.
  std::span<const Transform> links() const { return kinematics_.links(); }
  /// The robot; it stays where it is when this is moved.
  const Robot& robot() const { return *robot_; }

 private:
  void Take();

  std::unique_ptr<const Robot> robot_;
  Kinematics kinematics_;
  PositionLimits limits_;
  std::vector<double> positions_;
};

}  // namespace consac::robot
