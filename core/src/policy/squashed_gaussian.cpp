// The squashed Gaussian of bounded Box leaves: means, then log standard deviations, from the network; raw is the tanh
// of the normal number, which the world gets stretched to its bounds. Source: Haarnoja et al. 2018, arXiv:1801.01290,
// appendix C; Stable Baselines3, SquashedDiagGaussianDistribution (clip of log standard deviations, epsilon).

#include <algorithm>
#include <cmath>
#include <utility>

#include "policy/distributions.h"

namespace consac {
namespace {

constexpr float kLargestSquashed = 1.0f - 1.1920929e-7f;  // the inverse of tanh is finite within it

bool IsBounded(const Leaf& leaf) {
  if (leaf.space.kind() != SpaceKind::kBox || leaf.dtype != DType::kF32 || leaf.space.shape().size() != 1) return false;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const auto [low, high] = ElementBounds(leaf, i);
    if (!std::isfinite(low) || !std::isfinite(high)) return false;
  }
  return true;
}

std::int64_t MeansAndDeviations(const Leaf& leaf) {
  return 2 * leaf.count;
}

float LogStdOf(const Leaf& leaf, const HeadRow& row, std::int64_t i) {
  return std::clamp(row.head[leaf.count + i], kLeastLogStd, kMostLogStd);
}

void SelectSquashed(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw) {
  const bool sample = mode == ActionMode::kSample;
  for (std::int64_t i = 0; i < leaf.count; ++i)
    raw[i] = std::tanh(row.head[i] + (sample ? std::exp(LogStdOf(leaf, row, i)) * rng.Normal() : 0.0f));
}

float SquashedLogProbability(const Leaf& leaf, const HeadRow& row, const float* raw) {
  float log_p = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float log_std = LogStdOf(leaf, row, i);
    const float z = (Unsquashed(raw[i]) - row.head[i]) * std::exp(-log_std);
    log_p -= 0.5f * z * z + log_std + 0.5f * kLogTwoPi + LogSquashSlope(raw[i]);
  }
  return log_p;
}

float SquashedEntropy(const Leaf& leaf, const HeadRow& row) {
  double entropy = 0.0;
  for (std::int64_t i = 0; i < leaf.count; ++i)
    entropy +=
        SquashedNormalEntropy(static_cast<double>(row.head[i]), std::exp(static_cast<double>(LogStdOf(leaf, row, i))));
  return static_cast<float>(entropy);
}

/// Of the normal numbers before tanh: a divergence does not change when both sides are mapped alike.
float SquashedKl(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  float kl = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float a = LogStdOf(leaf, from, i), b = LogStdOf(leaf, to, i);
    const float difference = (from.head[i] - to.head[i]) * std::exp(-b), ratio = std::exp(a - b);
    kl += b - a + 0.5f * (ratio * ratio + difference * difference - 1.0f);
  }
  return kl;
}

// The network of a deterministic policy ends in tanh itself; what goes beyond the bounds is brought back.

std::int64_t ActionCount(const Leaf& leaf) {
  return leaf.count;
}

void TakeAsItIs(const Leaf& leaf, const HeadRow& row, ActionMode, Rng&, float* raw) {
  std::copy_n(row.head, leaf.count, raw);
}

float LogProbabilityOfOne(const Leaf& leaf, const HeadRow& row, const float* raw) {
  return std::equal(raw, raw + leaf.count, row.head) ? 0.0f : kMaskedLogit;
}

float EntropyOfOne(const Leaf&, const HeadRow&) {
  return 0.0f;
}

float KlOfOne(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  return -LogProbabilityOfOne(leaf, from, to.head);
}

}  // namespace

float Unsquashed(float raw) {
  return std::atanh(std::clamp(raw, -kLargestSquashed, kLargestSquashed));
}

float LogSquashSlope(float raw) {
  return std::log(1.0f - raw * raw + kSquashEpsilon);
}

/// The normal entropy and the mean of log(1 - tanh^2), which has no closed form: by Simpson's rule over six deviations
/// to either side.
double SquashedNormalEntropy(double mean, double deviation) {
  constexpr int kIntervals = 96;
  constexpr double kReach = 6.0, kStep = 2.0 * kReach / kIntervals;
  double entropy = std::log(deviation) + 0.5 * (static_cast<double>(kLogTwoPi) + 1.0);
  for (int k = 0; k <= kIntervals; ++k) {
    const double z = -kReach + kStep * k;
    const double weight = (k == 0 || k == kIntervals ? 1.0 : k % 2 == 1 ? 4.0 : 2.0) * kStep / 3.0;
    const double density = std::exp(-0.5 * (z * z + static_cast<double>(kLogTwoPi)));
    const double squashed = std::tanh(mean + deviation * z);
    entropy += weight * density * std::log(1.0 - squashed * squashed + static_cast<double>(kSquashEpsilon));
  }
  return entropy;
}

double StretchedToBounds(const Leaf& leaf, std::int64_t index, float raw) {
  const auto [low, high] = ElementBounds(leaf, index);
  return std::clamp(low + 0.5 * (static_cast<double>(raw) + 1.0) * (high - low), low, high);
}

Distribution SquashedGaussianDistribution() {
  return {.name = "squashed_gaussian",
          .fits = IsBounded,
          .head_size = MeansAndDeviations,
          .select = SelectSquashed,
          .log_probability = SquashedLogProbability,
          .entropy = SquashedEntropy,
          .kl = SquashedKl,
          .world_value = StretchedToBounds};
}

Distribution DeterministicDistribution() {
  return {.name = "deterministic",
          .fits = IsBounded,
          .head_size = ActionCount,
          .select = TakeAsItIs,
          .log_probability = LogProbabilityOfOne,
          .entropy = EntropyOfOne,
          .kl = KlOfOne,
          .world_value = StretchedToBounds};
}

}  // namespace consac
