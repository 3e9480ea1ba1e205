#pragma once
// What steps pay by the goals that they reached and those that were wanted. Private to host.

#include <vector>

#include "consac/host/tick_world.h"

namespace consac::host {

/// Goals of one behaviour, ready to be priced. Without a GoalReward::kFunction any thread may ask.
class GoalPrices {
 public:
  /// None.
  GoalPrices() = default;
  /// kInvalidArgument says what is missing, by the behaviour's name.
  static Result<GoalPrices> Of(const Goals& goals, const BehaviourSpec& behaviour);
  /// What they are paid by.
  GoalReward reward() const { return goals_.reward; }
  /// Whether the world pays by them.
  bool pays() const { return goals_.pays; }
  /// What steps pay that lead to `observations`, [rows, observation row_bytes]; rewards [rows] out. Not for kNone.
  void Price(const std::byte* observations, std::int64_t rows, float* rewards) const;

 private:
  float Distance(const std::byte* row) const;
  Goals goals_;
  std::size_t row_bytes_ = 0;
  std::vector<std::pair<Leaf, Leaf>> parts_;  // achieved, desired
};

}  // namespace consac::host
