#pragma once
// Inverse kinematics by damped least squares, within joint limits: which positions bring a tool where it should be.
// Source: Wampler 1986; Nakamura and Hanafusa 1986. dq = J^T (J J^T + lambda^2 I)^-1 e. A joint that would leave its
// limits is held there, and the others take over its part. The world yumi_reach and the engines' robots move by it.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/robot/kinematics.h"

namespace consac::robot {

/// What must be met.
enum class Task : std::uint8_t {
  kPosition,  ///< where the tool is; how it is turned is free
  kPose,      ///< both
};

/// How it is solved.
struct InverseOptions {
  Task task = Task::kPose;
  double damping_squared = 1e-4;        ///< lambda^2: larger is slower, and calmer near singular poses; m^2
  double position_tolerance = 1e-5;     ///< m
  double orientation_tolerance = 1e-4;  ///< rad
  double longest_step = 0.1;            ///< of the error that one iteration takes, m and rad
  int most_iterations = 200;
};

/// What came of it.
struct InverseResult {
  bool reached = false;            ///< both errors are within their tolerances
  int iterations = 0;              ///< that it took
  double position_error = 0.0;     ///< m
  double orientation_error = 0.0;  ///< rad; 0 where it is free
};

/// Solves for one tool of one robot. Buffers are made at creation; one object per thread.
class InverseKinematics {
 public:
  /// `robot` must outlive this.
  InverseKinematics(const Robot& robot, const Frame& tool, const InverseOptions& options);

  /// Moves `positions` ([positions], the start; afterwards the nearest that was found, always within limits) until the
  /// tool stands at `target`, in the base's frame. Joints that do not carry the tool stay. Where nothing is reachable
  /// `reached` is false.
  InverseResult Solve(const Transform& target, std::span<double> positions);
  /// Where Step begins: computes all links for `positions` ([positions], not clamped). All 0 at creation.
  void Forward(std::span<const double> positions);
  /// Where the tool is at the latest Forward or Solve, in the base's frame.
  Transform tool() const { return kinematics_.Pose(tool_); }
  /// One step: how far each position should move ([positions], out) from those of the latest Forward or Solve for the
  /// tool to shift by `shift` (m) and turn by `turn` (rotation vector, rad; not looked at where it is free), both along
  /// the base's axes. The result keeps limits, and no position moves further than `furthest` ([positions]) where that
  /// is not empty. The tool stays where it is.
  void Step(Vector3 shift, Vector3 turn, std::span<const double> furthest, std::span<double> moves);
  /// Moves `positions` ([positions], those of the latest Forward, Solve or Advance) so that the tool goes by `shift`
  /// (m, along the base's axes) on a straight line, followed in `parts` steps (1 or more) of `seconds` in all: within
  /// limits and the joints' speeds, not turned where its orientation is not free. What is too far is gone as far as can
  /// be.
  void Advance(Vector3 shift, double seconds, int parts, std::span<double> positions);
  /// The limits it keeps.
  const PositionLimits& limits() const { return limits_; }

 private:
  void Damped(std::span<const double> error, std::span<double> moves);

  Kinematics kinematics_;
  Frame tool_;
  InverseOptions options_;
  PositionLimits limits_;
  std::vector<double> positions_;   // [positions] where the links are
  std::vector<double> jacobian_;    // [6, positions]
  std::vector<double> moves_;       // [positions]
  std::vector<double> best_;        // [positions]
  std::vector<double> furthest_;    // [positions] of a part of Advance
  std::vector<std::uint8_t> held_;  // [positions] at a limit, for the step under way
};

}  // namespace consac::robot
