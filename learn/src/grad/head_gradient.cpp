#include "grad/head_gradient.h"

#include <algorithm>
#include <cmath>

#include "consac/nn/kernels.h"
#include "consac/policy/head.h"

namespace consac::learn {
HeadGradient::HeadGradient(const Layout& action)
    : head_size_(HeadSize(action)), raw_size_(RawActionSize(action)), mask_bytes_(action.mask_bytes) {
  std::int64_t raw_offset = 0, log_std_offset = 0;
  for (const Leaf& leaf : action.leaves) {
    std::int64_t head_offset = leaf.feature_offset, mask_offset = leaf.mask_offset;
    const SpaceKind kind = leaf.space.kind();
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const std::int64_t n = kind == SpaceKind::kDiscrete        ? leaf.space.n()
                             : kind == SpaceKind::kMultiDiscrete ? leaf.space.nvec()[static_cast<std::size_t>(i)]
                                                                 : 1;
      segments_.push_back({kind, n, head_offset, raw_offset++, mask_offset, log_std_offset});
      head_offset += n;
      mask_offset += kind == SpaceKind::kMultiBinary ? 2 : n;
      log_std_offset += kind == SpaceKind::kBox ? 1 : 0;
    }
  }
  neglogp_.resize(kBlockRows);
  entropy_.resize(kBlockRows);
  probability_.resize(static_cast<std::size_t>(kBlockRows * head_size_));
  shifted_.resize(static_cast<std::size_t>(kBlockRows * head_size_));
  log_sum_.resize(segments_.size() * kBlockRows);
  choice_entropy_.resize(segments_.size() * kBlockRows);
}

void HeadGradient::Forward(std::int64_t rows, const float* head, const float* log_std, const std::uint8_t* masks,
                           const float* raw) {
  rows_ = rows;
  head_ = head;
  log_std_ = log_std;
  masks_ = masks;
  raw_ = raw;
  std::fill_n(neglogp_.begin(), rows, 0.0f);
  std::fill_n(entropy_.begin(), rows, 0.0f);
  for (const Segment& segment : segments_) {
    if (segment.kind == SpaceKind::kBox)
      ForwardGaussian(segment);
    else if (segment.kind == SpaceKind::kMultiBinary)
      ForwardBit(segment);
    else
      ForwardChoice(segment);
  }
}

// Softmax over a block at once: shift by the largest logit, one vectorised exp over all rows, then the sums.
void HeadGradient::ForwardChoice(const Segment& segment) {
  const std::int64_t n = segment.n;
  const auto index = static_cast<std::size_t>(&segment - segments_.data());
  float* p = probability_.data() + segment.head_offset * kBlockRows;
  float* log_sum = log_sum_.data() + index * kBlockRows;
  float* entropies = choice_entropy_.data() + index * kBlockRows;
  for (std::int64_t r = 0; r < rows_; ++r) {
    const float* z = head_ + r * head_size_ + segment.head_offset;
    const std::uint8_t* mask = masks_ == nullptr ? nullptr : masks_ + r * mask_bytes_ + segment.mask_offset;
    float* shifted = p + r * n;
    for (std::int64_t j = 0; j < n; ++j) shifted[j] = mask == nullptr || mask[j] != 0 ? z[j] : kMaskedLogit;
    const float largest = *std::max_element(shifted, shifted + n);
    for (std::int64_t j = 0; j < n; ++j) shifted[j] -= largest;
    log_sum[r] = largest;
    neglogp_[static_cast<std::size_t>(r)] -=
        shifted[static_cast<std::int64_t>(raw_[r * raw_size_ + segment.raw_offset])];
  }
  // The entropy is log S - sum(e^s s) / S with s the shifted logits, so the products are summed around the exp.
  const std::span<float> block(p, static_cast<std::size_t>(rows_ * n));
  std::copy(block.begin(), block.end(), shifted_.begin());
  nn::Exp(block, block);
  for (std::int64_t r = 0; r < rows_; ++r) {
    float sum = 0.0f, products = 0.0f;
    for (std::int64_t j = 0; j < n; ++j) {
      sum += p[r * n + j];
      products += p[r * n + j] > 0.0f ? p[r * n + j] * shifted_[static_cast<std::size_t>(r * n + j)] : 0.0f;
    }
    const float inverse = 1.0f / sum, log_of_sum = std::log(sum);
    for (std::int64_t j = 0; j < n; ++j) p[r * n + j] *= inverse;
    log_sum[r] += log_of_sum;
    entropies[r] = log_of_sum - products * inverse;
    neglogp_[static_cast<std::size_t>(r)] += log_of_sum;
    entropy_[static_cast<std::size_t>(r)] += entropies[r];
  }
}

void HeadGradient::ForwardGaussian(const Segment& segment) {
  const float log_std = log_std_[segment.log_std_offset], inverse = std::exp(-log_std);
  const float constant = log_std + 0.5f * kLogTwoPi;
  float* z = probability_.data() + segment.head_offset * kBlockRows;
  for (std::int64_t r = 0; r < rows_; ++r) {
    z[r] = (raw_[r * raw_size_ + segment.raw_offset] - head_[r * head_size_ + segment.head_offset]) * inverse;
    neglogp_[static_cast<std::size_t>(r)] += 0.5f * z[r] * z[r] + constant;
    entropy_[static_cast<std::size_t>(r)] += constant + 0.5f;
  }
}

float HeadGradient::BitLogit(const Segment& segment, std::int64_t row) const {
  const std::uint8_t* mask = masks_ == nullptr ? nullptr : masks_ + row * mask_bytes_ + segment.mask_offset;
  return MaskedBitLogit(head_[row * head_size_ + segment.head_offset], mask);
}

void HeadGradient::ForwardBit(const Segment& segment) {
  float* p = probability_.data() + segment.head_offset * kBlockRows;
  for (std::int64_t r = 0; r < rows_; ++r) {
    const float logit = BitLogit(segment, r);
    p[r] = 1.0f / (1.0f + std::exp(-logit));
    const bool set = raw_[r * raw_size_ + segment.raw_offset] > 0.5f;
    neglogp_[static_cast<std::size_t>(r)] += Softplus(set ? -logit : logit);
    entropy_[static_cast<std::size_t>(r)] += p[r] * Softplus(-logit) + (1.0f - p[r]) * Softplus(logit);
  }
}

// d(-log p_a)/dz_j = p_j - [j = a];  dH/dz_j = -p_j (log p_j + H). What a mask forbids does not depend on its logit, be
// it that nothing is legal.
void HeadGradient::BackwardChoice(const Segment& segment, std::span<const float> d_neglogp,
                                  std::span<const float> d_entropy, float* d_head) const {
  const std::int64_t n = segment.n;
  const auto index = static_cast<std::size_t>(&segment - segments_.data());
  const float* p = probability_.data() + segment.head_offset * kBlockRows;
  const float* log_sum = log_sum_.data() + index * kBlockRows;
  const float* entropies = choice_entropy_.data() + index * kBlockRows;
  for (std::int64_t r = 0; r < rows_; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const float* z = head_ + r * head_size_ + segment.head_offset;
    const std::uint8_t* mask = masks_ == nullptr ? nullptr : masks_ + r * mask_bytes_ + segment.mask_offset;
    float* d = d_head + r * head_size_ + segment.head_offset;
    for (std::int64_t j = 0; j < n; ++j) {
      const float probability = p[r * n + j];
      const float surprise = probability > 0.0f ? z[j] - log_sum[r] + entropies[r] : 0.0f;
      d[j] = probability * (d_neglogp[row] - d_entropy[row] * surprise);
    }
    d[static_cast<std::int64_t>(raw_[r * raw_size_ + segment.raw_offset])] -= d_neglogp[row];
    for (std::int64_t j = 0; mask != nullptr && j < n; ++j) d[j] = mask[j] != 0 ? d[j] : 0.0f;
  }
}

void HeadGradient::Backward(std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head,
                            float* d_log_std) {
  for (const Segment& segment : segments_) {
    if (segment.kind == SpaceKind::kDiscrete || segment.kind == SpaceKind::kMultiDiscrete) {
      BackwardChoice(segment, d_neglogp, d_entropy, d_head);
      continue;
    }
    const float* saved = probability_.data() + segment.head_offset * kBlockRows;
    const bool box = segment.kind == SpaceKind::kBox;
    const float inverse = box ? std::exp(-log_std_[segment.log_std_offset]) : 0.0f;
    for (std::int64_t r = 0; r < rows_; ++r) {
      const auto row = static_cast<std::size_t>(r);
      float& d = d_head[r * head_size_ + segment.head_offset];
      if (box) {
        d = -d_neglogp[row] * saved[r] * inverse;
        d_log_std[segment.log_std_offset] += d_neglogp[row] * (1.0f - saved[r] * saved[r]) + d_entropy[row];
        continue;
      }
      // A forced bit does not depend on its logit. dH/dz = -z p (1 - p).
      const float logit = BitLogit(segment, r);
      const bool forced = logit == kMaskedLogit || logit == -kMaskedLogit;
      const float set = raw_[r * raw_size_ + segment.raw_offset] > 0.5f ? 1.0f : 0.0f;
      d = forced ? 0.0f : d_neglogp[row] * (saved[r] - set) - d_entropy[row] * logit * saved[r] * (1.0f - saved[r]);
    }
  }
}

}  // namespace consac::learn
