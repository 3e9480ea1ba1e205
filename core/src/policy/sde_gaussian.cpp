// State-dependent exploration of Box leaves (policy/state_noise.h), as it is or squashed by tanh: means from the
// network, the last hidden layer's numbers behind all heads, and free log standard deviations of a matrix. Given a
// slot's matrix a draw is mean + phi W; its probability is that of the normal number that it is over all matrices.

#include <cmath>

#include "policy/distributions.h"

namespace consac {
namespace {

std::int64_t SdeMeanCount(const Leaf& leaf) {
  return leaf.count;
}

std::int64_t SdeLogStds(const Leaf& leaf, const StateNoise& noise) {
  return noise.log_stds(leaf.count);
}

float SdeMean(const HeadRow& row, std::int64_t i) {
  return row.noise->Clip(row.head[i]);
}

float SdeVariance(const Leaf& leaf, const HeadRow& row, std::int64_t i) {
  float variance = StateNoise::kEpsilon;
  for (std::int64_t l = 0; l < row.noise->features; ++l) {
    const float part = row.features[l] * row.noise->Deviation(row.log_std[row.noise->log_std_of(l, i, leaf.count)]);
    variance += part * part;
  }
  return variance;
}

float SdeDraw(const Leaf& leaf, const HeadRow& row, std::int64_t i, Rng& rng) {
  const float mean = SdeMean(row, i);
  if (row.exploration == nullptr) return mean + std::sqrt(SdeVariance(leaf, row, i)) * rng.Normal();
  float drawn = mean;
  for (std::int64_t l = 0; l < row.noise->features; ++l) drawn += row.features[l] * row.exploration[l * leaf.count + i];
  return std::isfinite(drawn) ? drawn : mean;
}

float SdeNormalLogProbability(const Leaf& leaf, const HeadRow& row, std::int64_t i, float number) {
  const float variance = SdeVariance(leaf, row, i), difference = number - SdeMean(row, i);
  return -0.5f * (difference * difference / variance + std::log(variance) + kLogTwoPi);
}

void SelectSde(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw) {
  for (std::int64_t i = 0; i < leaf.count; ++i)
    raw[i] = mode == ActionMode::kSample ? SdeDraw(leaf, row, i, rng) : SdeMean(row, i);
}

float SdeLogProbability(const Leaf& leaf, const HeadRow& row, const float* raw) {
  float log_p = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) log_p += SdeNormalLogProbability(leaf, row, i, raw[i]);
  return log_p;
}

float SdeEntropy(const Leaf& leaf, const HeadRow& row) {
  float entropy = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i)
    entropy += 0.5f * (std::log(SdeVariance(leaf, row, i)) + kLogTwoPi + 1.0f);
  return entropy;
}

/// A divergence does not change when both sides are squashed alike.
float SdeKl(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  float kl = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float own = SdeVariance(leaf, from, i), other = SdeVariance(leaf, to, i);
    const float difference = SdeMean(from, i) - SdeMean(to, i);
    kl += 0.5f * (std::log(other / own) + (own + difference * difference) / other - 1.0f);
  }
  return kl;
}

void SelectSquashedSde(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw) {
  SelectSde(leaf, row, mode, rng, raw);
  for (std::int64_t i = 0; i < leaf.count; ++i) raw[i] = std::tanh(raw[i]);
}

float SquashedSdeLogProbability(const Leaf& leaf, const HeadRow& row, const float* raw) {
  float log_p = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i)
    log_p += SdeNormalLogProbability(leaf, row, i, Unsquashed(raw[i])) - LogSquashSlope(raw[i]);
  return log_p;
}

float SquashedSdeEntropy(const Leaf& leaf, const HeadRow& row) {
  double entropy = 0.0;
  for (std::int64_t i = 0; i < leaf.count; ++i)
    entropy += SquashedNormalEntropy(static_cast<double>(SdeMean(row, i)),
                                     std::sqrt(static_cast<double>(SdeVariance(leaf, row, i))));
  return static_cast<float>(entropy);
}

}  // namespace

Distribution SdeGaussianDistribution() {
  Distribution row = GaussianDistribution();
  row.name = "sde_gaussian";
  row.follows_state = true;
  row.log_std_size = SdeLogStds;
  row.head_size = SdeMeanCount;
  row.select = SelectSde;
  row.log_probability = SdeLogProbability;
  row.entropy = SdeEntropy;
  row.kl = SdeKl;
  return row;
}

Distribution SquashedSdeGaussianDistribution() {
  Distribution row = SquashedGaussianDistribution();
  row.name = "squashed_sde_gaussian";
  row.follows_state = true;
  row.log_std_size = SdeLogStds;
  row.head_size = SdeMeanCount;
  row.select = SelectSquashedSde;
  row.log_probability = SquashedSdeLogProbability;
  row.entropy = SquashedSdeEntropy;
  row.kl = SdeKl;
  return row;
}

}  // namespace consac
