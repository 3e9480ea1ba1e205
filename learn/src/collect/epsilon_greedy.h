#pragma once
// How algorithms of action values explore: the best legal choice, or with probability epsilon any of the legal ones.
// Private to learn.

#include <algorithm>
#include <cstdint>

#include "consac/base/archive.h"
#include "consac/base/rng.h"

namespace consac::learn {

/// Epsilon over the training: linear from `initial` to `final`, then constant.
struct ExplorationSchedule {
  double initial = 1.0;   ///< at the start
  double final = 0.05;    ///< from `fraction` on
  double fraction = 0.1;  ///< share of the training over which it falls

  /// Epsilon when the share `elapsed` of the training is over. Source: Stable Baselines, LinearSchedule.
  double At(double elapsed) const {
    return elapsed >= fraction ? final : initial + elapsed / fraction * (final - initial);
  }
};

/// Draws choices. Discrete actions of one leaf.
class EpsilonGreedy {
 public:
  /// Among `choices` choices, by a stream of `seed`.
  EpsilonGreedy(std::int64_t choices, std::uint64_t seed) : choices_(choices), rng_(seed, StreamId("exploration")) {}

  /// values [rows, choices], masks [rows, choices] or null -> raw [rows], the choice's index. Where nothing is legal,
  /// everything is. Draws at least one number a row, so that a row's luck is the same whatever epsilon is.
  void Choose(const float* values, const std::uint8_t* masks, std::int64_t rows, double epsilon, float* raw) {
    for (std::int64_t row = 0; row < rows; ++row) {
      const std::uint8_t* mask = masks == nullptr ? nullptr : masks + row * choices_;
      const bool explores = rng_.UniformDouble() < epsilon;
      raw[row] = static_cast<float>(explores ? AnyOf(mask) : BestOf(values + row * choices_, mask));
    }
  }
  /// The best legal choice, the first of several; `mask` may be null.
  std::int64_t BestOf(const float* values, const std::uint8_t* mask) const {
    std::int64_t best = -1;
    for (std::int64_t i = 0; i < choices_; ++i) {
      if (mask != nullptr && mask[i] == 0) continue;
      if (best < 0 || values[i] > values[best]) best = i;
    }
    return best >= 0 || mask == nullptr ? std::max<std::int64_t>(best, 0) : BestOf(values, nullptr);
  }
  /// The generator.
  void Visit(Archive& archive) { archive("exploration_rng", rng_); }

 private:
  std::int64_t AnyOf(const std::uint8_t* mask) {
    std::uint32_t legal = 0;
    for (std::int64_t i = 0; i < choices_; ++i) legal += mask == nullptr || mask[i] != 0 ? 1u : 0u;
    if (legal == 0) return rng_.Below(static_cast<std::uint32_t>(choices_));
    std::uint32_t left = rng_.Below(legal);
    for (std::int64_t i = 0;; ++i) {
      if (mask != nullptr && mask[i] == 0) continue;
      if (left-- == 0) return i;
    }
  }

  std::int64_t choices_;
  Rng rng_;
};

}  // namespace consac::learn
