#pragma once
// point-v0: push a point mass over a plane to a goal and stop there; continuous. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One point mass.
class Point {
 public:
  using Action = float;  ///< acceleration along x and y, -1 to 1

  /// What it offers: observation (x, y, x', y', goal x, goal y), two accelerations.
  static EnvSpec Spec(std::int32_t copies);
  /// Point and goal uniform in the square, at rest.
  void Reset(Rng& rng, float* observation);
  /// One step of 0.1 s.
  StepResult Step(const Action* action, Rng& rng, float* observation);
  /// Exact state.
  void Visit(Archive& archive);

 private:
  void Observe(float* observation) const;

  double position_[2] = {}, velocity_[2] = {}, goal_[2] = {};
};

}  // namespace consac::worlds
