#pragma once
// The returns of the latest hundred episodes, for algorithms that report by episodes. Private to learn.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "consac/base/archive.h"
#include "consac/env/batch.h"

namespace consac::learn {

/// Counts episodes and keeps returns. Never allocates after creation.
class EpisodeWindow {
 public:
  /// Of `slots` slots.
  explicit EpisodeWindow(std::int64_t slots) : sums_(static_cast<std::size_t>(slots)), latest_(kEpisodes) {}

  /// Takes the rewards of a step; returns how many episodes ended with it.
  std::int64_t Add(const Batch& batch) {
    const std::int64_t before = count_;
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      double& sum = sums_[static_cast<std::size_t>(batch.slots[i])];
      sum += static_cast<double>(batch.rewards[i]);
      if ((batch.terminated[i] | batch.truncated[i]) == 0) continue;
      latest_[static_cast<std::size_t>(count_++ % kEpisodes)] = sum;
      sum = 0.0;
    }
    return count_ - before;
  }
  /// The episode of `slot` is lost.
  void Forget(std::int32_t slot) { sums_[static_cast<std::size_t>(slot)] = 0.0; }
  /// Episodes that have ended.
  std::int64_t count() const { return count_; }
  /// Mean return of the latest hundred; NaN before the first.
  double mean() const {
    const std::int64_t held = std::min<std::int64_t>(count_, kEpisodes);
    double sum = 0.0;
    for (std::int64_t i = 0; i < held; ++i) sum += latest_[static_cast<std::size_t>(i)];
    return held == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / static_cast<double>(held);
  }

  /// Sums, returns and their number.
  void Visit(Archive& archive) {
    archive("sums", std::span<double>(sums_));
    archive("latest", std::span<double>(latest_));
    archive("count", count_);
    archive.CheckWithin("count", count_, 0, std::numeric_limits<std::int64_t>::max());
  }

 private:
  static constexpr std::int64_t kEpisodes = 100;
  std::vector<double> sums_;    // [N] of the episode under way
  std::vector<double> latest_;  // [kEpisodes] a ring
  std::int64_t count_ = 0;
};

}  // namespace consac::learn
