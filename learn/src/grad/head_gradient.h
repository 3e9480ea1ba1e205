#pragma once
// Log-probabilities and entropies of a block of actions, and their gradients with respect to the head's numbers: what
// policy-gradient losses differentiate through. The same distributions as core's policy/head.h. Private to learn.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/learn/grad/backpropagation.h"
#include "grad/distribution_gradients.h"

namespace consac::learn {

/// Work space and arithmetic for one block of at most kBlockRows rows. One per thread that computes a loss.
class HeadGradient {
 public:
  /// For these heads, each found by the name of its distribution, and rows of `mask_bytes` mask bytes. The error names
  /// a leaf whose distribution has no likelihood to learn by (values of choices, actions that are not drawn).
  static Result<HeadGradient> Create(const ActionHead& head, std::int64_t mask_bytes);

  /// Bytes that one for `head` takes.
  static std::int64_t Bytes(const ActionHead& head);

  /// Computes -log p of `raw` and the entropy of every row. head [rows, ActionHead::size], log_std, masks
  /// [rows, mask_bytes] or null, raw [rows, raw_size]; all must stay until Backward.
  void Forward(std::int64_t rows, const float* head, const float* log_std, const std::uint8_t* masks, const float* raw);
  /// Elements of one raw action.
  std::int64_t raw_size() const { return block_.raw_size; }
  /// [rows] -log p of the last Forward.
  std::span<const float> neglogp() const { return neglogp_; }
  /// [rows] entropies of the last Forward.
  std::span<const float> entropy() const { return entropy_; }
  /// Chain rule: given d loss / d neglogp and d loss / d entropy per row, writes d loss / d head [rows, size]
  /// and adds d loss / d log_std to `d_log_std` [log_std_size].
  void Backward(std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head, float* d_log_std);

 private:
  HeadGradient(const ActionHead& head, std::int64_t mask_bytes);
  HeadWork WorkOf(const HeadSegment& segment);

  std::vector<HeadSegment> segments_;
  HeadBlock block_;                       // of the last Forward
  std::vector<float> neglogp_, entropy_;  // [kBlockRows]
  std::vector<float> values_;             // [kBlockRows * head size] per segment contiguous
  std::vector<float> shifted_;            // [kBlockRows * head size]
  std::vector<float> log_sum_;            // [segments, kBlockRows]
  std::vector<float> entropies_;          // [segments, kBlockRows]
};

}  // namespace consac::learn
