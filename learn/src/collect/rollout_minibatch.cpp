#include "collect/rollout_minibatch.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "buffer/moments.h"

namespace consac::learn {

RolloutMinibatch::RolloutMinibatch(const BehaviourSpec& behaviour, const HeadGradient& head, std::int64_t max_rows,
                                   const Communicator& ranks)
    : ranks_(ranks),
      feature_count_(static_cast<std::size_t>(behaviour.observation_layout.feature_count)),
      raw_size_(static_cast<std::size_t>(head.raw_size())),
      mask_bytes_(behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0) {
  const auto rows = static_cast<std::size_t>(max_rows);
  for (std::vector<float>* column : {&advantages, &returns, &values, &neglogp}) column->resize(rows);
  raw_.resize(rows * raw_size_);
  masks_.resize(rows * mask_bytes_);
  heads_.assign((rows + kBlockRows - 1) / kBlockRows, head);
}

void RolloutMinibatch::Begin(const RolloutCollector& collector, std::span<const std::int32_t> rows) {
  collector_ = &collector;
  rows_ = rows;
  total_ = static_cast<std::int64_t>(ranks_.Sum(static_cast<double>(rows.size())));
  for (std::size_t i = 0; i < rows.size(); ++i)
    advantages[i] = collector.rollout().advantages[static_cast<std::size_t>(rows[i])];
}

void RolloutMinibatch::StandardiseAdvantages(Deviation deviation) {
  if (total_ <= 1) return;
  const std::vector<float>& column = collector_->rollout().advantages;
  const Moments moments(
      rows_, [&](std::size_t row) { return column[row]; }, ranks_);
  const double correction = deviation == Deviation::kSample ? moments.count / (moments.count - 1.0) : 1.0;
  const double inverse = 1.0 / (std::sqrt(moments.variance * correction) + 1e-8);
  for (std::size_t i = 0; i < rows_.size(); ++i)
    advantages[i] = static_cast<float>((column[static_cast<std::size_t>(rows_[i])] - moments.mean) * inverse);
}

void RolloutMinibatch::Gather(const LossBlock& block) {
  const Rollout& rollout = collector_->rollout();
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const auto to = static_cast<std::size_t>(block.first_row + r);
    const auto row = static_cast<std::size_t>(rows_[to]);
    collector_->Encode(row, block.inputs[0] + static_cast<std::size_t>(r) * feature_count_);
    std::copy_n(rollout.raw_actions.data() + row * raw_size_, raw_size_, raw_.data() + to * raw_size_);
    if (mask_bytes_ > 0) {
      std::memcpy(masks_.data() + to * mask_bytes_, rollout.masks(static_cast<std::int64_t>(row)), mask_bytes_);
    }
    returns[to] = rollout.returns[row];
    values[to] = rollout.values[row];
    neglogp[to] = rollout.neglogp[row];
  }
}

HeadGradient& RolloutMinibatch::Head(const LossBlock& block, const float* log_std) {
  HeadGradient& head = heads_[static_cast<std::size_t>(block.index)];
  const auto first = static_cast<std::size_t>(block.first_row);
  head.Forward(block.rows, block.outputs[0], log_std, mask_bytes_ > 0 ? masks_.data() + first * mask_bytes_ : nullptr,
               raw_.data() + first * raw_size_);
  return head;
}

}  // namespace consac::learn
