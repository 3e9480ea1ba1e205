#pragma once
// road-v0: the thesis' worked example. An actor on a road from 0 to 40 learns to walk to a coin. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One road.
class Road {
 public:
  using Action = std::int32_t;  ///< 0 left, 1 stay, 2 right

  static constexpr int kFirst = 0;       ///< first place of the road
  static constexpr int kLast = 40;       ///< last place
  static constexpr int kStart = 10;      ///< where the actor first stands
  static constexpr int kCoinMoves = 50;  ///< steps after which the coin moves by itself

  /// What it offers: observation (actor, coin), three actions.
  static EnvSpec Spec(std::int32_t copies);
  /// The first episode starts at 10 with the coin anywhere else; later ones anywhere.
  void Reset(Rng& rng, float* observation);
  /// One step along the road.
  StepResult Step(const Action* action, Rng& rng, float* observation);
  /// Exact state.
  void Visit(Archive& archive);

  /// Where the actor stands.
  int actor() const { return actor_; }
  /// Where the coin lies.
  int coin() const { return coin_; }

 private:
  void PlaceCoin(Rng& rng);
  void Observe(float* observation) const;

  std::int32_t actor_ = kStart;
  std::int32_t coin_ = kLast;
  std::int32_t since_coin_ = 0;
  std::int32_t episodes_ = 0;
};

}  // namespace consac::worlds
