#pragma once
// One exploration matrix for a whole minibatch, and how it moves with its log standard deviations: what an actor that
// explores by its state (gSDE) is learned by. Source: Stable Baselines3, Actor.reset_noise before each gradient step of
// SAC. Private to learn.

#include <cstdint>
#include <vector>

#include "consac/base/rng.h"
#include "consac/policy/head.h"

namespace consac::learn {

/// W = sigma xi of each leaf, one behind the other. Never allocates after creation.
class StateMatrices {
 public:
  /// For `head`; empty where it does not follow the state.
  explicit StateMatrices(const ActionHead& head) : head_(head) {
    const auto numbers = static_cast<std::size_t>(head.exploration_size());
    for (std::vector<float>* of : {&normals, &deviations, &slopes, &matrices}) of->resize(numbers);
  }

  /// Draws anew.
  void Draw(const float* log_std, Rng& rng) {
    for (const ActionHead::Part& part : head_.parts()) {
      for (std::int64_t l = 0; l < part.noise.features; ++l) {
        for (std::int64_t i = 0; i < part.leaf.count; ++i) {
          const auto at = static_cast<std::size_t>(part.exploration_offset + l * part.leaf.count + i);
          const float own = log_std[part.log_std_offset + part.noise.log_std_of(l, i, part.leaf.count)];
          normals[at] = rng.Normal();
          deviations[at] = part.noise.Deviation(own);
          slopes[at] = part.noise.Slope(own, deviations[at]);
          matrices[at] = deviations[at] * normals[at];
        }
      }
    }
  }
  /// Mean of the deviations.
  double MeanDeviation() const {
    double sum = 0.0;
    for (const float deviation : deviations) sum += static_cast<double>(deviation);
    return sum / static_cast<double>(deviations.size());
  }

  std::vector<float> normals, deviations, slopes, matrices;  // [exploration_size] xi, sigma, d sigma / d log sigma, W

 private:
  const ActionHead head_;
};

}  // namespace consac::learn
