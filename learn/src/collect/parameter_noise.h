#pragma once
// Exploration by noise in the parameters of what acts: as strong as epsilon-greedy would be, Stable Baselines 2's for
// DQN, or so strong that actions move by a given distance, its DDPG's. Source: Plappert et al. 2018, arXiv:1706.01905;
// Stable Baselines 2.10.2, deepq/build_graph.py and ddpg/noise.py. Private to learn.

#include <vector>

#include "consac/base/archive.h"
#include "consac/base/rng.h"
#include "consac/nn/network.h"

namespace consac::learn {

/// A perturbed copy that acts, and a second one that tells how strong the noise is. Dense layers alone are perturbed.
class ParameterNoise {
 public:
  /// For `network`, whose only output is Q or actions, and at most `max_rows` rows at once; begins with `deviation`.
  ParameterNoise(const nn::Network& network, std::uint64_t seed, std::int64_t max_rows, double deviation = 0.01);

  /// New noise for what acts: theta + N(0, deviation^2).
  void Perturb(std::span<const float> parameters);
  /// The output of the perturbed copy, features [rows, F] -> [rows, outputs]; until the next call.
  const float* Values(const float* features, std::int64_t rows);
  /// Noise of the present strength is tried on the same rows, whose undisturbed `values` are given: the deviation grows
  /// by a hundredth where it changes less than an epsilon-greedy choice would,
  /// KL(softmax Q || softmax Q~) < -log(1 - epsilon + epsilon / choices), else it shrinks.
  void Adapt(std::span<const float> parameters, const float* features, const float* values, std::int64_t rows,
             double epsilon);
  /// Noise of the present strength is tried on rows whose undisturbed `outputs` are given: how far it moves them, the
  /// root of the mean square.
  double Distance(std::span<const float> parameters, const float* features, const float* outputs, std::int64_t rows);
  /// The deviation shrinks by `factor` where that `distance` is more than `desired`, else it grows up to kStrongest.
  void AdaptTo(double distance, double desired, double factor) {
    deviation_ = distance > desired ? deviation_ / factor : std::min(deviation_ * factor, kStrongest);
  }
  /// Of more an actor acts at its bounds whatever it sees, and a network's numbers leave float32.
  static constexpr double kStrongest = 1000.0;
  /// Standard deviation of the noise.
  double deviation() const { return deviation_; }

  /// Noise, deviation and generator.
  void Visit(Archive& archive);

 private:
  void Draw(std::span<const float> parameters, std::vector<float>* perturbed);
  const float* Try(std::span<const float> parameters, const float* features, std::int64_t rows);

  std::vector<std::uint8_t> disturbed_;  // [parameters] 1: of a dense layer
  std::vector<float> acting_, trial_;    // [parameters]
  nn::Evaluator acting_evaluator_, trial_evaluator_;
  std::int64_t outputs_;
  Rng rng_;
  double deviation_;
};

}  // namespace consac::learn
