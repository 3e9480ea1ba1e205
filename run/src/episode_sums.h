#pragma once
// Rewards and lengths of the episodes under way, one per slot. Private to run.

#include <vector>

#include "consac/base/archive.h"
#include "consac/env/batch.h"
#include "consac/run/report.h"

namespace consac::run {

/// Sums of the episodes under way.
class EpisodeSums {
 public:
  /// Of behaviour `b`.
  explicit EpisodeSums(std::int32_t slots, std::size_t b = 0)
      : behaviour_(b), rewards_(static_cast<std::size_t>(slots)), lengths_(static_cast<std::size_t>(slots)) {}

  /// Adds one step; tells the report of episodes that ended.
  void Add(const Batch& batch, std::int64_t steps, Report& report) {
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(batch.slots[i]);
      rewards_[slot] += batch.rewards[i];
      ++lengths_[slot];
      if ((batch.terminated[i] | batch.truncated[i]) == 0) continue;
      report.OnEpisode({batch.slots[i], rewards_[slot], lengths_[slot], steps, behaviour_});
      Clear(slot);
    }
  }
  std::int32_t slots() const { return static_cast<std::int32_t>(rewards_.size()); }
  /// Forgets every episode under way.
  void Clear() {
    for (std::size_t slot = 0; slot < rewards_.size(); ++slot) Clear(slot);
  }
  /// The same of some slots.
  void Clear(std::span<const std::int32_t> slots) {
    for (const std::int32_t slot : slots) Clear(static_cast<std::size_t>(slot));
  }
  void Visit(Archive& archive) {
    archive("rewards", std::span<double>(rewards_));
    archive("lengths", std::span<std::int64_t>(lengths_));
  }

 private:
  void Clear(std::size_t slot) {
    rewards_[slot] = 0.0;
    lengths_[slot] = 0;
  }

  std::size_t behaviour_;
  std::vector<double> rewards_;        // [slots] of the episode under way
  std::vector<std::int64_t> lengths_;  // [slots] of the episode under way
};

}  // namespace consac::run
