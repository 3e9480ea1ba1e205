#include "consac/robot/inverse_kinematics.h"

#include <algorithm>
#include <cmath>

namespace consac::robot {
namespace {

// Solves the symmetric positive definite A x = b in place by Cholesky; n <= 6.
void SolveSymmetric(std::size_t n, double (&a)[6][6], double (&b)[6]) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(sum) : sum / a[j][j];
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
}

Vector3 Shortened(Vector3 v, double longest) {
  const double length = Norm(v);
  return length > longest ? (longest / length) * v : v;
}

}  // namespace

InverseKinematics::InverseKinematics(const Robot& robot, const Frame& tool, const InverseOptions& options)
    : kinematics_(robot), tool_(tool), options_(options), limits_(LimitsOf(robot)) {
  CONSAC_ASSERT(options.damping_squared > 0.0);
  const std::size_t count = robot.position_joints.size();
  positions_.resize(count);
  jacobian_.resize(6 * count);
  moves_.resize(count);
  best_.resize(count);
  furthest_.resize(count);
  held_.resize(count);
}

void InverseKinematics::Damped(std::span<const double> error, std::span<double> moves) {
  const std::size_t rows = error.size(), columns = moves.size();
  double a[6][6] = {}, b[6] = {};
  for (std::size_t i = 0; i < rows; ++i) {
    b[i] = error[i];
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = i == j ? options_.damping_squared : 0.0;
      for (std::size_t k = 0; k < columns; ++k) {
        if (held_[k] == 0) sum += jacobian_[i * columns + k] * jacobian_[j * columns + k];
      }
      a[i][j] = a[j][i] = sum;
    }
  }
  SolveSymmetric(rows, a, b);
  for (std::size_t k = 0; k < columns; ++k) {
    if (held_[k] != 0) continue;
    moves[k] = 0.0;
    for (std::size_t i = 0; i < rows; ++i) moves[k] += jacobian_[i * columns + k] * b[i];
  }
}

void InverseKinematics::Forward(std::span<const double> positions) {
  kinematics_.Forward(positions);
  std::copy(positions.begin(), positions.end(), positions_.begin());
}

void InverseKinematics::Step(Vector3 shift, Vector3 turn, std::span<const double> furthest, std::span<double> moves) {
  const std::size_t count = limits_.lower.size();
  CONSAC_ASSERT(moves.size() == count && (furthest.empty() || furthest.size() == count));
  kinematics_.Jacobian(tool_, jacobian_);
  const double wanted[6] = {shift.x, shift.y, shift.z, turn.x, turn.y, turn.z};
  const std::size_t rows = options_.task == Task::kPose ? 6 : 3;
  std::fill(held_.begin(), held_.end(), std::uint8_t{0});
  std::fill(moves.begin(), moves.end(), 0.0);
  // Each round holds at least one joint more, so there are at most as many as joints.
  for (bool again = true; again;) {
    double left[6];
    for (std::size_t row = 0; row < rows; ++row) {
      left[row] = wanted[row];
      for (std::size_t k = 0; k < count; ++k) {
        if (held_[k] != 0) left[row] -= jacobian_[row * count + k] * moves[k];
      }
    }
    Damped({left, rows}, moves);
    again = false;
    for (std::size_t k = 0; k < count; ++k) {
      if (held_[k] != 0) continue;
      double lower = limits_.lower[k] - positions_[k], upper = limits_.upper[k] - positions_[k];
      if (!furthest.empty()) lower = std::max(lower, -furthest[k]), upper = std::min(upper, furthest[k]);
      const double within = std::clamp(moves[k], std::min(lower, 0.0), std::max(upper, 0.0));
      if (within == moves[k]) continue;
      moves[k] = within;
      held_[k] = 1;
      again = true;
    }
  }
}

void InverseKinematics::Advance(Vector3 shift, double seconds, int parts, std::span<double> positions) {
  CONSAC_ASSERT(parts > 0 && positions.size() == positions_.size());
  const Vector3 target = tool().position + shift;
  for (std::size_t k = 0; k < furthest_.size(); ++k) furthest_[k] = limits_.velocity[k] * seconds / parts;
  for (int part = 0; part < parts; ++part) {
    Step((1.0 / (parts - part)) * (target - tool().position), {}, furthest_, moves_);
    for (std::size_t k = 0; k < positions.size(); ++k) positions[k] += moves_[k];
    ClampToLimits(limits_, positions);
    Forward(positions);
  }
}

InverseResult InverseKinematics::Solve(const Transform& target, std::span<double> positions) {
  ClampToLimits(limits_, positions);
  InverseResult best;
  double least = std::numeric_limits<double>::infinity();
  for (int iteration = 0;; ++iteration) {
    Forward(positions);
    const Transform at = tool();
    const Vector3 shift = target.position - at.position;
    const Vector3 turn = options_.task == Task::kPose
                             ? Rotate(at.rotation, RotationVector(Inverse(at.rotation) * target.rotation))
                             : Vector3{};
    const InverseResult now{Norm(shift) <= options_.position_tolerance && Norm(turn) <= options_.orientation_tolerance,
                            iteration, Norm(shift), Norm(turn)};
    if (now.position_error + now.orientation_error < least || now.reached) {
      least = now.position_error + now.orientation_error;
      best = now;
      std::copy(positions.begin(), positions.end(), best_.begin());
    }
    if (now.reached || iteration >= options_.most_iterations) break;
    Step(Shortened(shift, options_.longest_step), Shortened(turn, options_.longest_step), {}, moves_);
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += moves_[i];
    ClampToLimits(limits_, positions);
  }
  std::copy(best_.begin(), best_.end(), positions.begin());
  Forward(positions);
  if (!best.reached) best.iterations = options_.most_iterations;
  return best;
}

}  // namespace consac::robot
