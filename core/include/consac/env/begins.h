#pragma once
// Which agents of a step are at the beginning of an episode, for policies that remember (Policy::Act(ActRows)). Used by
// whoever acts in a world step by step: models of a run, drivers in an engine's ticks.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "consac/env/batch.h"

namespace consac {

/// Follows the slots of one behaviour from step to step. Never allocates once made.
class EpisodeBegins {
 public:
  /// For slots 0 to `slots` - 1, none of which has acted.
  explicit EpisodeBegins(std::int32_t slots) : acted_(static_cast<std::size_t>(slots)) {
    begins_.reserve(acted_.size());
  }

  /// The world begins anew: no episode goes on.
  void Restart() { std::fill(acted_.begin(), acted_.end(), std::uint8_t{0}); }

  /// The slots that act now, [acting]: 1 for those that did not act in the step before, or whose episode ended with it,
  /// as `whole`, the batch of all slots, still says. Once for each step; valid until the next.
  std::span<const std::uint8_t> Next(const Batch& whole, std::span<const std::int32_t> acting) {
    begins_.resize(acting.size());
    for (std::size_t row = 0; row < acting.size(); ++row) {
      const auto i = static_cast<std::size_t>(acting[row]);
      begins_[row] = acted_[i] == 0 || (whole.terminated[i] | whole.truncated[i]) != 0 ? 1 : 0;
    }
    Restart();
    for (const std::int32_t slot : acting) acted_[static_cast<std::size_t>(slot)] = 1;
    return begins_;
  }

 private:
  std::vector<std::uint8_t> acted_;   // [slots] in the latest step
  std::vector<std::uint8_t> begins_;  // [acting]
};

}  // namespace consac
