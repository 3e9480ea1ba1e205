#include "grad/head_gradient.h"

#include <algorithm>
#include <array>

#include "consac/base/text.h"

namespace consac::learn {

const DistributionGradient* FindDistributionGradient(std::string_view name) {
  static const std::array kRows = {CategoricalGradient(), BernoulliGradient(), GaussianGradient(),
                                   SdeGaussianGradient(), SquashedSdeGaussianGradient()};
  for (const DistributionGradient& row : kRows) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

Result<HeadGradient> HeadGradient::Create(const ActionHead& head, std::int64_t mask_bytes) {
  for (const ActionHead::Part& part : head.parts()) {
    if (FindDistributionGradient(part.distribution->name) != nullptr) continue;
    return Status{StatusCode::kInvalidArgument,
                  "the action " + part.leaf.space.ToString() +
                      (part.leaf.name.empty() ? "" : " at " + Quote(part.leaf.name)) + " has the head " +
                      Quote(part.distribution->name) +
                      ", which has no likelihood to learn by; choose categorical, bernoulli or gaussian"};
  }
  return HeadGradient(head, mask_bytes);
}

HeadGradient::HeadGradient(const ActionHead& head, std::int64_t mask_bytes) {
  for (const ActionHead::Part& part : head.parts()) {
    HeadSegment segment{FindDistributionGradient(part.distribution->name),
                        1,
                        part.head_offset,
                        part.raw_offset,
                        part.leaf.mask_offset,
                        part.log_std_offset,
                        part.noise,
                        0,
                        part.leaf.count};
    const std::vector<std::int64_t>* choices =
        part.leaf.space.kind() == SpaceKind::kMultiDiscrete ? &part.leaf.space.nvec() : nullptr;
    const std::int64_t masked = part.leaf.mask_count > 0 ? part.leaf.mask_count / part.leaf.count : 0;
    for (std::int64_t i = 0; i < part.leaf.count; ++i) {
      segment.n = choices != nullptr ? (*choices)[static_cast<std::size_t>(i)] : part.head_size / part.leaf.count;
      segments_.push_back(segment);
      segment.head_offset += segment.n;
      segment.raw_offset += 1;
      segment.mask_offset += choices != nullptr ? segment.n : masked;
      segment.log_std_offset += part.distribution->follows_state ? 0 : 1;
      segment.element += 1;
    }
  }
  block_.head_size = head.size();
  block_.features_offset = head.features_offset();
  block_.raw_size = head.raw_size();
  block_.mask_bytes = mask_bytes;
  neglogp_.resize(kBlockRows);
  entropy_.resize(kBlockRows);
  values_.resize(static_cast<std::size_t>(kBlockRows * head.size()));
  shifted_.resize(static_cast<std::size_t>(kBlockRows * head.size()));
  log_sum_.resize(segments_.size() * kBlockRows);
  entropies_.resize(segments_.size() * kBlockRows);
}

std::int64_t HeadGradient::Bytes(const ActionHead& head) {
  constexpr auto kOfRow = static_cast<std::int64_t>(2 * kBlockRows * sizeof(float));
  return kOfRow * (1 + head.size() + head.raw_size()) +
         static_cast<std::int64_t>(sizeof(HeadSegment)) * head.raw_size();
}

HeadWork HeadGradient::WorkOf(const HeadSegment& segment) {
  const auto index = static_cast<std::size_t>(&segment - segments_.data());
  return {values_.data() + segment.head_offset * kBlockRows,
          shifted_.data(),
          log_sum_.data() + index * kBlockRows,
          entropies_.data() + index * kBlockRows,
          neglogp_.data(),
          entropy_.data()};
}

void HeadGradient::Forward(std::int64_t rows, const float* head, const float* log_std, const std::uint8_t* masks,
                           const float* raw) {
  block_.rows = rows;
  block_.head = head;
  block_.log_std = log_std;
  block_.masks = masks;
  block_.raw = raw;
  std::fill_n(neglogp_.begin(), rows, 0.0f);
  std::fill_n(entropy_.begin(), rows, 0.0f);
  for (const HeadSegment& segment : segments_) segment.row->forward(segment, block_, WorkOf(segment));
}

void HeadGradient::Backward(std::span<const float> d_neglogp, std::span<const float> d_entropy, float* d_head,
                            float* d_log_std) {
  for (const HeadSegment& segment : segments_)
    segment.row->backward(segment, block_, WorkOf(segment), d_neglogp, d_entropy, d_head, d_log_std);
  // The last hidden layer learns by the means alone. Source: Stable Baselines3, learn_features.
  for (std::int64_t r = 0; r < block_.rows; ++r)
    std::fill(d_head + r * block_.head_size + block_.features_offset, d_head + (r + 1) * block_.head_size, 0.0f);
}

}  // namespace consac::learn
