#pragma once
// pendulum-v1: swing a pendulum up and hold it; equal to Gymnasium's Pendulum-v1 step by step. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One pendulum.
class Pendulum {
 public:
  using Action = float;  ///< torque in N m, -2 to 2

  /// What it offers: observation (cos angle, sin angle, angle' rad/s), one torque.
  static EnvSpec Spec(std::int32_t copies);
  /// Gravity (m/s^2), mass (kg), length (m).
  void SetParameters(std::span<const double> values);
  /// Angle uniform in +-pi, speed in +-1.
  void Reset(Rng& rng, float* observation);
  /// One step of 0.05 s.
  StepResult Step(const Action* action, Rng& rng, float* observation);
  /// Exact state.
  void Visit(Archive& archive);
  /// Puts it into a state (angle rad, speed rad/s), for tests against Gymnasium.
  void SetState(const double (&state)[2]);

 private:
  void Observe(float* observation) const;

  double angle_ = 0.0;                                 // rad, 0 is upright
  double speed_ = 0.0;                                 // rad/s
  double gravity_ = 10.0, mass_ = 1.0, length_ = 1.0;  // m/s^2, kg, m: of this episode
};

}  // namespace consac::worlds
