// The diagonal Gaussian over a block at once, one number of the action at a time.

#include <cmath>

#include "grad/distribution_gradients.h"

namespace consac::learn {
namespace {

void GaussianForward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work) {
  const float log_std = block.log_std[segment.log_std_offset], inverse = std::exp(-log_std);
  const float constant = log_std + 0.5f * kLogTwoPi;
  float* z = work.values;
  for (std::int64_t r = 0; r < block.rows; ++r) {
    z[r] = (block.RawOf(segment, r) - *block.HeadOf(segment, r)) * inverse;
    work.neglogp[r] += 0.5f * z[r] * z[r] + constant;
    work.entropy[r] += constant + 0.5f;
  }
}

// With z = (a - mean) / std: d(-log p)/dmean = -z / std, d(-log p)/dlog_std = 1 - z^2, dH/dlog_std = 1.
void GaussianBackward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work,
                      std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head,
                      float* d_log_std) {
  const float inverse = std::exp(-block.log_std[segment.log_std_offset]);
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const float z = work.values[r];
    d_head[r * block.head_size + segment.head_offset] = -d_neglogp[row] * z * inverse;
    d_log_std[segment.log_std_offset] += d_neglogp[row] * (1.0f - z * z) + d_entropy[row];
  }
}

}  // namespace

DistributionGradient GaussianGradient() {
  return {"gaussian", GaussianForward, GaussianBackward};
}

}  // namespace consac::learn
