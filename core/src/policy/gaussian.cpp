// The diagonal Gaussian of Box leaves: means from the network, log standard deviations of their own. The world gets
// the number clipped to the bounds; its probability is that of the number before.

#include <algorithm>
#include <cmath>

#include "policy/distributions.h"

namespace consac {
namespace {

bool IsVector(const Leaf& leaf) {
  return leaf.space.kind() == SpaceKind::kBox && leaf.dtype == DType::kF32 && leaf.space.shape().size() == 1;
}

std::int64_t MeanCount(const Leaf& leaf) {
  return leaf.count;
}

std::int64_t LogStdCount(const Leaf& leaf, const StateNoise&) {
  return leaf.count;
}

void SelectNormal(const Leaf& leaf, const HeadRow& row, ActionMode mode, Rng& rng, float* raw) {
  const bool sample = mode == ActionMode::kSample;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    raw[i] = row.head[i] + (sample ? std::exp(row.log_std[i]) * rng.Normal() : 0.0f);
  }
}

float GaussianLogProbability(const Leaf& leaf, const HeadRow& row, const float* raw) {
  float log_p = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float z = (raw[i] - row.head[i]) * std::exp(-row.log_std[i]);
    log_p -= 0.5f * z * z + row.log_std[i] + 0.5f * kLogTwoPi;
  }
  return log_p;
}

float GaussianEntropy(const Leaf& leaf, const HeadRow& row) {
  float entropy = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) entropy += row.log_std[i] + 0.5f * (kLogTwoPi + 1.0f);
  return entropy;
}

float GaussianKl(const Leaf& leaf, const HeadRow& from, const HeadRow& to) {
  float kl = 0.0f;
  for (std::int64_t i = 0; i < leaf.count; ++i) {
    const float difference = (from.head[i] - to.head[i]) * std::exp(-to.log_std[i]);
    const float ratio = std::exp(from.log_std[i] - to.log_std[i]);
    kl += to.log_std[i] - from.log_std[i] + 0.5f * (ratio * ratio + difference * difference - 1.0f);
  }
  return kl;
}

double ClippedToBounds(const Leaf& leaf, std::int64_t index, float raw) {
  const auto e = static_cast<std::size_t>(index);
  return std::clamp(static_cast<double>(raw), leaf.space.low()[e], leaf.space.high()[e]);
}

}  // namespace

Distribution GaussianDistribution() {
  return {.name = "gaussian",
          .fits = IsVector,
          .log_std_size = LogStdCount,
          .head_size = MeanCount,
          .select = SelectNormal,
          .log_probability = GaussianLogProbability,
          .entropy = GaussianEntropy,
          .kl = GaussianKl,
          .world_value = ClippedToBounds};
}

}  // namespace consac
