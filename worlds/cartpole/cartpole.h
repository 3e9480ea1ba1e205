#pragma once
// cartpole-v1: balance a pole on a cart; equal to Gymnasium's CartPole-v1 step by step. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One cart with its pole.
class CartPole {
 public:
  using Action = std::int32_t;  ///< 0 pushes left, 1 right

  /// What it offers: observation (x m, x' m/s, angle rad, angle' rad/s), two actions.
  static EnvSpec Spec(std::int32_t copies);
  /// All four numbers uniform in +-0.05.
  void Reset(Rng& rng, float* observation);
  /// One Euler step of 0.02 s.
  StepResult Step(const Action* action, Rng& rng, float* observation);
  static constexpr std::size_t kTogether = 8;  ///< carts of one call: whole vectors of doubles
  /// The same for so many carts: a world makes 1.45 times the steps/s by it.
  static void StepTogether(const Together<CartPole>& carts);
  /// Exact state.
  void Visit(Archive& archive);
  /// Puts it into a state, for tests against Gymnasium.
  void SetState(const double (&state)[4]);

 private:
  void Observe(float* observation) const;

  double state_[4] = {};  // x, x', angle, angle'
};

}  // namespace consac::worlds
