// State-dependent exploration over a block at once, one number of the action at a time: a normal number whose variance
// is sum_l phi_l^2 sigma_l^2 + 1e-6. phi itself learns nothing by it. Source: Raffin et al. 2020, arXiv:2005.05719;
// Stable Baselines3, StateDependentNoiseDistribution (learn_features is false in PPO and A2C).

#include <algorithm>
#include <cmath>

#include "consac/learn/grad/backpropagation.h"
#include "grad/distribution_gradients.h"

namespace consac::learn {
namespace {

/// The variance of every row, [rows].
void SdeVariances(const HeadSegment& segment, const HeadBlock& block, float* variance) {
  const StateNoise& noise = segment.noise;
  std::fill_n(variance, block.rows, StateNoise::kEpsilon);
  for (std::int64_t l = 0; l < noise.features; ++l) {
    const std::int64_t place = segment.log_std_offset + noise.log_std_of(l, segment.element, segment.count);
    const float deviation = noise.Deviation(block.log_std[place]), square = deviation * deviation;
    const float* phi = block.head + block.features_offset + l;
    for (std::int64_t r = 0; r < block.rows; ++r) {
      const float feature = phi[r * block.head_size];
      variance[r] += square * feature * feature;
    }
  }
}

// values: (a - mean) / deviation; log_sum: the variance.
void SdeForward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work) {
  SdeVariances(segment, block, work.log_sum);
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const float variance = work.log_sum[r], constant = 0.5f * (std::log(variance) + kLogTwoPi);
    const float mean = segment.noise.Clip(*block.HeadOf(segment, r));
    const float z = (block.RawOf(segment, r) - mean) / std::sqrt(variance);
    work.values[r] = z;
    work.neglogp[r] += 0.5f * z * z + constant;
    work.entropy[r] += constant + 0.5f;
  }
}

// d(-log p)/dmean = -z / deviation; d(-log p)/dvariance = (1 - z^2) / (2 variance), dH/dvariance = 1 / (2 variance);
// dvariance/dsigma_l = 2 phi_l^2 sigma_l.
void SdeBackwardOf(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work,
                   std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head,
                   float* d_log_std) {
  const StateNoise& noise = segment.noise;
  float* d_variance = work.shifted;  // [rows]
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const float z = work.values[r], variance = work.log_sum[r];
    const bool within = noise.Within(*block.HeadOf(segment, r));
    d_head[r * block.head_size + segment.head_offset] = within ? -d_neglogp[row] * z / std::sqrt(variance) : 0.0f;
    d_variance[r] = 0.5f * (d_neglogp[row] * (1.0f - z * z) + (d_entropy.empty() ? 0.0f : d_entropy[row])) / variance;
  }
  for (std::int64_t l = 0; l < noise.features; ++l) {
    const std::int64_t place = segment.log_std_offset + noise.log_std_of(l, segment.element, segment.count);
    const float log_std = block.log_std[place], deviation = noise.Deviation(log_std);
    const float* phi = block.head + block.features_offset + l;
    float sum = 0.0f;
    for (std::int64_t r = 0; r < block.rows; ++r) {
      const float feature = phi[r * block.head_size];
      sum += d_variance[r] * feature * feature;
    }
    d_log_std[place] += 2.0f * deviation * noise.Slope(log_std, deviation) * sum;
  }
}

// The entropy has no closed form: as in Stable Baselines3 it is -log p of what was drawn, one sample of it.
void SquashedSdeForward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work) {
  SdeVariances(segment, block, work.log_sum);
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const float variance = work.log_sum[r], raw = block.RawOf(segment, r);
    const float mean = segment.noise.Clip(*block.HeadOf(segment, r));
    const float z = (Unsquashed(raw) - mean) / std::sqrt(variance);
    const float neglogp = 0.5f * (z * z + std::log(variance) + kLogTwoPi) + LogSquashSlope(raw);
    work.values[r] = z;
    work.neglogp[r] += neglogp;
    work.entropy[r] += neglogp;
  }
}

void SquashedSdeBackward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work,
                         std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head,
                         float* d_log_std) {
  float both[kBlockRows];
  for (std::size_t r = 0; r < static_cast<std::size_t>(block.rows); ++r) both[r] = d_neglogp[r] + d_entropy[r];
  SdeBackwardOf(segment, block, work, std::span<const float>(both, static_cast<std::size_t>(block.rows)), {}, d_head,
                d_log_std);
}

}  // namespace

DistributionGradient SdeGaussianGradient() {
  return {"sde_gaussian", SdeForward, SdeBackwardOf};
}

DistributionGradient SquashedSdeGaussianGradient() {
  return {"squashed_sde_gaussian", SquashedSdeForward, SquashedSdeBackward};
}

}  // namespace consac::learn
