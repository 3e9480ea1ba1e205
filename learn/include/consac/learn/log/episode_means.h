#pragma once
// The last episodes of a training, as Stable Baselines' ep_info buffer keeps them for ep_reward_mean and ep_len_mean.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "consac/base/archive.h"

namespace consac::learn {

/// The means that are shown are over so many episodes. Source: Stable Baselines.
inline constexpr std::int64_t kEpisodesOfMean = 100;

/// Reward and length of the last kWindow episodes.
class EpisodeMeans {
 public:
  static constexpr auto kWindow = static_cast<std::size_t>(kEpisodesOfMean);

  /// An episode ended; the oldest makes room.
  void Add(double reward, std::int64_t length) {
    const auto place = static_cast<std::size_t>(count_ % static_cast<std::int64_t>(kWindow));
    rewards_[place] = reward;
    lengths_[place] = static_cast<double>(length);
    ++count_;
  }
  /// Episodes ever.
  std::int64_t count() const { return count_; }
  /// Mean over the window; NaN before the first episode.
  double mean_reward() const { return Mean(rewards_); }
  /// Mean over the window, in steps; NaN before the first episode.
  double mean_length() const { return Mean(lengths_); }
  /// Everything.
  void Visit(Archive& archive) {
    archive("rewards", std::span<double>(rewards_));
    archive("lengths", std::span<double>(lengths_));
    archive("count", count_);
    if (count_ < 0) count_ = 0;
  }

 private:
  using Ring = std::array<double, kWindow>;

  double Mean(const Ring& values) const {
    if (count_ <= 0) return std::numeric_limits<double>::quiet_NaN();
    const std::size_t filled = count_ < static_cast<std::int64_t>(kWindow) ? static_cast<std::size_t>(count_) : kWindow;
    double sum = 0.0;
    for (const double value : std::span(values).first(filled)) sum += value;
    return sum / static_cast<double>(filled);
  }

  Ring rewards_{}, lengths_{};
  std::int64_t count_ = 0;
};

}  // namespace consac::learn
