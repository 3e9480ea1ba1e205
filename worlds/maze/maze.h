#pragma once
// maze-v0: find the way out of a small maze from anywhere; a grid. See README.md.

#include "worlds/batched.h"

namespace consac::worlds {

/// One walker in the maze.
class Maze {
 public:
  using Action = std::int32_t;  ///< 0 up, 1 right, 2 down, 3 left

  static constexpr int kSize = 7;  ///< cells along a side

  /// What it offers: observation (row, column) scaled to [0, 1] and four bits "open" per direction; four actions.
  static EnvSpec Spec(std::int32_t copies);
  /// Any free cell but the exit.
  void Reset(Rng& rng, float* observation);
  /// One move; into a wall it stays.
  StepResult Step(const Action* action, Rng& rng, float* observation);
  /// Exact state.
  void Visit(Archive& archive);

 private:
  void Observe(float* observation) const;

  std::int32_t row_ = 0, column_ = 0;
};

}  // namespace consac::worlds
