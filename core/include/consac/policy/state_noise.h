#pragma once
// Generalised state-dependent exploration (gSDE): noise that is a linear function of what the last hidden layer says,
// phi(s) W, so that a state that is seen again is answered by the same noise until W is drawn again. Used by the heads
// "sde_gaussian" and "squashed_sde_gaussian" (policy/distribution.h) and by what learns them.
// Source: Raffin et al. 2020, arXiv:2005.05719; Stable Baselines3, StateDependentNoiseDistribution.

#include <cmath>
#include <cstdint>

namespace consac {

/// What such a head is made of besides its leaf. An exploration matrix W has a row for each feature and a column for
/// each element of the action, W_ij from N(0, sigma_ij^2); the action is drawn from N(mean, sum_i phi_i^2 sigma_ij^2).
struct StateNoise {
  std::int64_t features = 0;      ///< numbers of the last hidden layer, behind all heads; 0: a head of another kind
  bool full_std = true;           ///< a log sigma for each feature and element [features, count], or for each feature
  bool use_expln = false;         ///< sigma = exp(x) below 0 and log(1 + x) + 1 above, or exp(x) everywhere
  float clip_mean = 0.0f;         ///< means are brought within plus and minus this; 0: as they are
  std::int64_t sample_freq = -1;  ///< actions for which a slot's W lasts; -1: as long as an episode, or a rollout
  friend bool operator==(const StateNoise&, const StateNoise&) = default;

  /// Log sigmas of a leaf of `count` elements.
  std::int64_t log_stds(std::int64_t count) const { return full_std ? features * count : features; }
  /// Which of them is that of a feature and an element.
  std::int64_t log_std_of(std::int64_t feature, std::int64_t element, std::int64_t count) const {
    return full_std ? feature * count + element : feature;
  }
  /// sigma.
  float Deviation(float log_std) const {
    return use_expln && log_std > 0.0f ? std::log1p(log_std + kEpsilon) + 1.0f : std::exp(log_std);
  }
  /// d sigma / d log sigma, given sigma.
  float Slope(float log_std, float deviation) const {
    return use_expln && log_std > 0.0f ? 1.0f / (1.0f + log_std + kEpsilon) : deviation;
  }
  /// Whether a mean stays as it is.
  bool Within(float mean) const { return clip_mean <= 0.0f || (mean > -clip_mean && mean < clip_mean); }
  /// The mean as the action has it.
  float Clip(float mean) const { return Within(mean) ? mean : mean > 0.0f ? clip_mean : -clip_mean; }

  /// Added to the variance, and to what log1p is taken of.
  static constexpr float kEpsilon = 1e-6f;
};

}  // namespace consac
