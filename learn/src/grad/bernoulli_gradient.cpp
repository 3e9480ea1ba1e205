// The Bernoulli distribution over a block at once, one bit of the action at a time.

#include <cmath>

#include "grad/distribution_gradients.h"

namespace consac::learn {
namespace {

float LogitOf(const HeadSegment& segment, const HeadBlock& block, std::int64_t r) {
  return MaskedBitLogit(*block.HeadOf(segment, r), block.MaskOf(segment, r));
}

void BernoulliForward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work) {
  float* p = work.values;
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const float logit = LogitOf(segment, block, r);
    p[r] = 1.0f / (1.0f + std::exp(-logit));
    const bool set = block.RawOf(segment, r) > 0.5f;
    work.neglogp[r] += Softplus(set ? -logit : logit);
    work.entropy[r] += p[r] * Softplus(-logit) + (1.0f - p[r]) * Softplus(logit);
  }
}

// d(-log p)/dz = p - [bit set]; dH/dz = -z p (1 - p). A forced bit does not depend on its logit.
void BernoulliBackward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work,
                       std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head, float*) {
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const float p = work.values[r], logit = LogitOf(segment, block, r);
    const bool forced = logit == kMaskedLogit || logit == -kMaskedLogit;
    const float set = block.RawOf(segment, r) > 0.5f ? 1.0f : 0.0f;
    d_head[r * block.head_size + segment.head_offset] =
        forced ? 0.0f : d_neglogp[row] * (p - set) - d_entropy[row] * logit * p * (1.0f - p);
  }
}

}  // namespace

DistributionGradient BernoulliGradient() {
  return {"bernoulli", BernoulliForward, BernoulliBackward};
}

}  // namespace consac::learn
