#pragma once
// The learning half of core's table of distributions (consac/policy/distribution.h): log-probabilities, entropies and
// their gradients over a block of rows. One row per distribution that has them, found by the same name; what only acts
// (values of choices, deterministic actions) has none. Private to learn.

#include <cstdint>
#include <span>
#include <string_view>

#include "consac/policy/head.h"

namespace consac::learn {

/// An independent part of a leaf's distribution: a choice of n, or one number or bit (n is 1).
struct HeadSegment {
  const struct DistributionGradient* row = nullptr;  ///< how it is differentiated
  std::int64_t n = 1;                                ///< numbers of the head
  std::int64_t head_offset = 0, raw_offset = 0;      ///< in a row of the head, of a raw action
  std::int64_t mask_offset = 0, log_std_offset = 0;  ///< in a row of masks, among the log standard deviations
  StateNoise noise = {};                             ///< where it follows the state: how
  std::int64_t element = 0, count = 1;  ///< which of the leaf's elements it is; log_std_offset is the leaf's
};

/// A block of actions; everything row-major.
struct HeadBlock {
  std::int64_t rows = 0;                ///< at most kBlockRows
  const float* head = nullptr;          // [rows, head_size]
  const float* log_std = nullptr;       // [log_std_size]
  const std::uint8_t* masks = nullptr;  // [rows, mask_bytes] or null
  const float* raw = nullptr;           // [rows, raw_size]
  std::int64_t head_size = 0, mask_bytes = 0, raw_size = 0;
  std::int64_t features_offset = 0;  ///< in a row of the head: what segments that follow the state read

  /// The head's numbers of one segment in row `r`.
  const float* HeadOf(const HeadSegment& segment, std::int64_t r) const {
    return head + r * head_size + segment.head_offset;
  }
  /// Its mask, or null.
  const std::uint8_t* MaskOf(const HeadSegment& segment, std::int64_t r) const {
    return masks == nullptr ? nullptr : masks + r * mask_bytes + segment.mask_offset;
  }
  /// Its first raw number.
  float RawOf(const HeadSegment& segment, std::int64_t r) const { return raw[r * raw_size + segment.raw_offset]; }
};

/// What forward leaves for backward and adds up for the loss.
struct HeadWork {
  float* values = nullptr;     // [rows, n] of this segment: probabilities or standardised numbers
  float* shifted = nullptr;    // [rows, n] scratch
  float* log_sum = nullptr;    // [rows] of this segment
  float* entropies = nullptr;  // [rows] of this segment
  float* neglogp = nullptr;    // [rows] of all segments: to be added to
  float* entropy = nullptr;    // [rows] of all segments: to be added to
};

/// One row of the table.
struct DistributionGradient {
  std::string_view name;  ///< as in Distribution
  /// Adds -log p and entropy of every row.
  void (*forward)(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work);
  /// Writes d(loss)/d(head) [rows, head_size] of the segment and adds d(loss)/d(log_std), given d(loss)/d(-log p) and
  /// d(loss)/d(entropy) per row.
  void (*backward)(const HeadSegment& segment, const HeadBlock& block, const HeadWork& work,
                   std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head, float* d_log_std);
};

/// The row of that name, or null.
const DistributionGradient* FindDistributionGradient(std::string_view name);

/// The rows, one per file.
DistributionGradient CategoricalGradient();
DistributionGradient BernoulliGradient();
DistributionGradient GaussianGradient();
DistributionGradient SdeGaussianGradient();
DistributionGradient SquashedSdeGaussianGradient();

}  // namespace consac::learn
