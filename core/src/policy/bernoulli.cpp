// The Bernoulli distribution of MultiBinary leaves.

#include <algorithm>
#include <cmath>

#include "policy/distributions.h"

namespace consac {
namespace {

float BitSigmoid(float x) {
  return 1.0f / (1.0f + std::exp(-x));
}

float LogitOfBit(const HeadRow& row, const std::uint8_t* mask, std::int64_t i) {
  return MaskedBitLogit(row.head[i], mask == nullptr ? nullptr : mask + 2 * i);
}

bool IsBits(const Leaf& leaf) {
  return leaf.space.kind() == SpaceKind::kMultiBinary;
}

std::int64_t BitHeadSize(const Leaf& leaf) {
  return leaf.count;
}

void SelectBits(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw) {
  const bool sample = mode == ActionMode::kSample;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float p = BitSigmoid(LogitOfBit(row, row.mask, i));
    raw[i] = (sample ? rng.Uniform() < p : p > 0.5f) ? 1.0f : 0.0f;
  }
}

float BernoulliLogProbability(const Leaf& leaf, const HeadRow& row, const float* raw) {
  float log_p = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float logit = LogitOfBit(row, row.mask, i);
    log_p -= raw[i] > 0.5f ? Softplus(-logit) : Softplus(logit);
  }
  return log_p;
}

float BernoulliEntropy(const Leaf& leaf, const HeadRow& row) {
  float entropy = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float logit = LogitOfBit(row, row.mask, i);
    const float p = BitSigmoid(logit);
    entropy += p * Softplus(-logit) + (1.0f - p) * Softplus(logit);
  }
  return entropy;
}

float BernoulliKl(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  float kl = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float a = LogitOfBit(from, from.mask, i), b = LogitOfBit(to, from.mask, i);
    const float p = BitSigmoid(a);
    kl += p * (Softplus(-b) - Softplus(-a)) + (1.0f - p) * (Softplus(b) - Softplus(a));
  }
  return kl;
}

double BitInWorld(const Leaf&, std::int64_t, float raw) {
  return static_cast<double>(raw);
}

}  // namespace

float Softplus(float x) {
  return std::max(x, 0.0f) + std::log1p(std::exp(-std::fabs(x)));
}

float MaskedBitLogit(float logit, const std::uint8_t* mask) {
  if (mask == nullptr || (mask[0] != 0 && mask[1] != 0)) return logit;
  return mask[1] != 0 ? -kMaskedLogit : kMaskedLogit;
}

Distribution BernoulliDistribution() {
  return {.name = "bernoulli",
          .fits = IsBits,
          .head_size = BitHeadSize,
          .select = SelectBits,
          .log_probability = BernoulliLogProbability,
          .entropy = BernoulliEntropy,
          .kl = BernoulliKl,
          .world_value = BitInWorld};
}

}  // namespace consac
