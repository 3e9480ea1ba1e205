#pragma once
// reach3-v0: a three-joint arm reaches for a point in space; three axes. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One arm: a turning base, a shoulder and an elbow.
class Reach3 {
 public:
  using Action = float;  ///< speed of each joint, -1 to 1, in units of kJointSpeed

  /// What it offers: observation (sines and cosines of three joints, hand xyz, target xyz less hand), three speeds.
  static EnvSpec Spec(std::int32_t copies);
  /// Joints uniform, target where some other joints would put the hand.
  void Reset(Rng& rng, float* observation);
  /// One step of 0.05 s.
  StepResult Step(const Action* action, Rng& rng, float* observation);
  /// Exact state.
  void Visit(Archive& archive);

 private:
  void Observe(float* observation) const;

  double joints_[3] = {};  // rad: base, shoulder, elbow
  double hand_[3] = {};    // m
  double target_[3] = {};  // m
};

}  // namespace consac::worlds
