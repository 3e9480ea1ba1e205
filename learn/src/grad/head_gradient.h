#pragma once
// Log-probabilities and entropies of a block of actions, and their gradients with respect to the head's numbers: what
// policy-gradient losses differentiate through. The same distributions as core's policy/head.h. Private to learn.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/learn/grad/backpropagation.h"
#include "consac/space/layout.h"

namespace consac::learn {

/// Work space and arithmetic for one block of at most kBlockRows rows. One per thread that computes a loss.
class HeadGradient {
 public:
  /// For actions of this layout.
  explicit HeadGradient(const Layout& action);

  /// Computes -log p of `raw` and the entropy of every row. head [rows, HeadSize], log_std [LogStdSize], masks
  /// [rows, mask_bytes] or null, raw [rows, RawActionSize]; all must stay until Backward.
  void Forward(std::int64_t rows, const float* head, const float* log_std, const std::uint8_t* masks, const float* raw);
  /// [rows] -log p of the last Forward.
  std::span<const float> neglogp() const { return neglogp_; }
  /// [rows] entropies of the last Forward.
  std::span<const float> entropy() const { return entropy_; }
  /// Chain rule: given d loss / d neglogp and d loss / d entropy per row, writes d loss / d head [rows, HeadSize]
  /// and adds d loss / d log_std to `d_log_std` [LogStdSize].
  void Backward(std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head, float* d_log_std);

 private:
  /// One distribution of a row: a categorical choice of n, or one Box element or bit (n is 1).
  struct Segment {
    SpaceKind kind;
    std::int64_t n;
    std::int64_t head_offset, raw_offset, mask_offset, log_std_offset;
  };
  void ForwardChoice(const Segment& segment);
  void ForwardGaussian(const Segment& segment);
  void ForwardBit(const Segment& segment);
  void BackwardChoice(const Segment& segment, std::span<const float> d_neglogp, std::span<const float> d_entropy,
                      float* d_head) const;
  float BitLogit(const Segment& segment, std::int64_t row) const;

  std::vector<Segment> segments_;
  std::int64_t head_size_, raw_size_, mask_bytes_;
  std::int64_t rows_ = 0;
  const float* head_ = nullptr;
  const float* log_std_ = nullptr;
  const std::uint8_t* masks_ = nullptr;
  const float* raw_ = nullptr;
  std::vector<float> neglogp_, entropy_;  // [kBlockRows]
  std::vector<float> probability_;        // [kBlockRows * HeadSize] per segment contiguous: p, z or sigmoid
  std::vector<float> shifted_;            // [kBlockRows * HeadSize] logits less the row's largest
  std::vector<float> log_sum_;            // [segments, kBlockRows] log of the normaliser
  std::vector<float> choice_entropy_;     // [segments, kBlockRows]
};

}  // namespace consac::learn
