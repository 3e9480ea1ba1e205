#pragma once
// Steps whose value is found later, many at once: a call for a step's few rows takes a critic longer than they take
// among many (bench/results/speed.md). Private to learn.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/hooks.h"

namespace consac::learn {

/// What has been acted upon and has no value yet, in the order of acting.
class UnvaluedSteps {
 public:
  /// Room for `most` steps of `slots` slots with `features` network inputs.
  UnvaluedSteps(std::int64_t slots, std::int64_t features, std::int64_t most)
      : feature_count_(static_cast<std::size_t>(features)),
        most_(static_cast<std::size_t>(most)),
        features_(most_ * feature_count_),
        under_way_(static_cast<std::size_t>(slots), kNone) {
    steps_.reserve(most_);
  }

  /// Whether `steps` more fit.
  bool HasRoomFor(std::size_t steps) const { return steps_.size() + steps <= most_; }
  /// `slots`, for which there must be room, act, seeing `features` [slots, F]. What one of them was doing before is no
  /// longer waited for.
  void Begin(std::span<const std::int32_t> slots, const float* features) {
    CONSAC_ASSERT(HasRoomFor(slots.size()));
    std::copy_n(features, slots.size() * feature_count_, features_.data() + steps_.size() * feature_count_);
    for (const std::int32_t slot : slots) {
      under_way_[static_cast<std::size_t>(slot)] = steps_.size();
      steps_.push_back({slot, kNone});
    }
  }
  /// What `slot` was doing is row `row` of the rollout; false where it has its value.
  bool Record(std::int32_t slot, std::size_t row) {
    std::size_t& at = under_way_[static_cast<std::size_t>(slot)];
    if (at == kNone) return false;
    steps_[at].row = row;
    at = kNone;
    return true;
  }

  /// Steps that wait.
  std::int64_t size() const { return static_cast<std::int64_t>(steps_.size()); }
  /// Network inputs of those that wait, [size, F].
  const float* features() const { return features_.data(); }
  /// Their values, [size], are here: `recorded(row, value)` of those recorded, `under_way(slot, value)` of the others.
  template <class Recorded, class UnderWay>
  void Give(const float* values, Recorded&& recorded, UnderWay&& under_way) {
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const Step& step = steps_[i];
      std::size_t& at = under_way_[static_cast<std::size_t>(step.slot)];
      if (step.row != kNone) recorded(step.row, values[i]);
      if (at != i) continue;
      under_way(step.slot, values[i]);
      at = kNone;
    }
    steps_.clear();
  }
  /// Nothing waits.
  void Clear() {
    steps_.clear();
    std::fill(under_way_.begin(), under_way_.end(), kNone);
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  struct Step {
    std::int32_t slot;
    std::size_t row;  // kNone: under way
  };

  std::size_t feature_count_, most_;
  std::vector<float> features_;         // [most, F]
  std::vector<Step> steps_;             // [up to most]
  std::vector<std::size_t> under_way_;  // [slots] place among steps_, or kNone
};

}  // namespace consac::learn
