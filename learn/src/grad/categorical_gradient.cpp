// The categorical distribution over a block at once.

#include <algorithm>
#include <cmath>

#include "consac/nn/kernels.h"
#include "grad/distribution_gradients.h"

namespace consac::learn {
namespace {

// Softmax over a block at once: shift by the largest logit, one vectorised exp over all rows, then the sums.
void CategoricalForward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work) {
  const std::int64_t n = segment.n;
  float* p = work.values;
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const float* z = block.HeadOf(segment, r);
    const std::uint8_t* mask = block.MaskOf(segment, r);
    float* shifted = p + r * n;
    for (std::int64_t j = 0; j < n; ++j) shifted[j] = mask == nullptr || mask[j] != 0 ? z[j] : kMaskedLogit;
    const float largest = *std::max_element(shifted, shifted + n);
    for (std::int64_t j = 0; j < n; ++j) shifted[j] -= largest;
    work.log_sum[r] = largest;
    work.neglogp[r] -= shifted[static_cast<std::int64_t>(block.RawOf(segment, r))];
  }
  // The entropy is log S - sum(e^s s) / S with s the shifted logits, so the products are summed around the exp.
  const std::span<float> all(p, static_cast<std::size_t>(block.rows * n));
  std::copy(all.begin(), all.end(), work.shifted);
  nn::Exp(all, all);
  for (std::int64_t r = 0; r < block.rows; ++r) {
    float sum = 0.0f, products = 0.0f;
    for (std::int64_t j = 0; j < n; ++j) {
      sum += p[r * n + j];
      products += p[r * n + j] > 0.0f ? p[r * n + j] * work.shifted[r * n + j] : 0.0f;
    }
    const float inverse = 1.0f / sum, log_of_sum = std::log(sum);
    for (std::int64_t j = 0; j < n; ++j) p[r * n + j] *= inverse;
    work.log_sum[r] += log_of_sum;
    work.entropies[r] = log_of_sum - products * inverse;
    work.neglogp[r] += log_of_sum;
    work.entropy[r] += work.entropies[r];
  }
}

// d(-log p_a)/dz_j = p_j - [j = a];  dH/dz_j = -p_j (log p_j + H). What a mask forbids does not depend on its logit, be
// it that nothing is legal.
void CategoricalBackward(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work,
                         std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head, float*) {
  const std::int64_t n = segment.n;
  const float* p = work.values;
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const float* z = block.HeadOf(segment, r);
    const std::uint8_t* mask = block.MaskOf(segment, r);
    float* d = d_head + r * block.head_size + segment.head_offset;
    for (std::int64_t j = 0; j < n; ++j) {
      const float probability = p[r * n + j];
      const float surprise = probability > 0.0f ? z[j] - work.log_sum[r] + work.entropies[r] : 0.0f;
      d[j] = probability * (d_neglogp[row] - d_entropy[row] * surprise);
    }
    d[static_cast<std::int64_t>(block.RawOf(segment, r))] -= d_neglogp[row];
    for (std::int64_t j = 0; mask != nullptr && j < n; ++j) d[j] = mask[j] != 0 ? d[j] : 0.0f;
  }
}

}  // namespace

DistributionGradient CategoricalGradient() {
  return {"categorical", CategoricalForward, CategoricalBackward};
}

}  // namespace consac::learn
