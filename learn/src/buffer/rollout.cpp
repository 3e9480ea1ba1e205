#include "consac/learn/buffer/rollout.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace consac::learn {

Rollout::Rollout(const BehaviourSpec& behaviour, std::int64_t n_steps, std::int64_t raw_size)
    : slots_(behaviour.slots),
      n_steps_(n_steps),
      observation_bytes_(behaviour.observation_layout.row_bytes),
      action_bytes_(behaviour.action_layout.row_bytes),
      mask_bytes_(behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0),
      time_(static_cast<std::size_t>(slots_), 0),
      scratch_(behaviour) {
  const auto rows = static_cast<std::size_t>(slots_ * n_steps_), n = static_cast<std::size_t>(slots_);
  raw_actions.resize(rows * static_cast<std::size_t>(raw_size));
  for (std::vector<float>* column : {&rewards, &values, &neglogp, &advantages, &returns}) column->resize(rows);
  ended.resize(rows);
  bytes_.resize((rows + n) * observation_bytes_);
  masks_.resize((rows + n) * mask_bytes_, 1);
  actions_.resize(n * action_bytes_);
  finals_.resize(n * observation_bytes_);
  step_rewards_.resize(n);
  terminated_.resize(n);
  truncated_.resize(n);
  staged_.reserve(n);
}

void Rollout::Begin(const Batch& batch) {
  for (std::int64_t i = 0; i < batch.rows(); ++i) {
    const std::int64_t row = RowOf(batch.slots[static_cast<std::size_t>(i)]);
    const auto from = static_cast<std::size_t>(i);
    std::memcpy(observations(row), batch.next_observations + from * observation_bytes_, observation_bytes_);
    if (mask_bytes_ > 0) std::memcpy(masks(row), batch.next_action_masks + from * mask_bytes_, mask_bytes_);
  }
}

Batch Rollout::Stage(std::span<const std::int32_t> slots) {
  staged_.assign(slots.begin(), slots.end());
  const std::int64_t time = time_[0];
  const bool in_step = static_cast<std::int64_t>(slots.size()) == slots_ &&
                       std::all_of(time_.begin(), time_.end(), [time](std::int64_t t) { return t == time; });
  Batch batch;
  if (in_step) {
    batch.observations = observations(time * slots_);
    batch.next_observations = observations((time + 1) * slots_);
    batch.action_masks = masks(time * slots_);
    batch.next_action_masks = masks((time + 1) * slots_);
    batch.actions = actions_.data();
    batch.rewards = step_rewards_.data();
    batch.terminated = terminated_.data();
    batch.truncated = truncated_.data();
    batch.final_observations = finals_.data();
  } else {
    batch = scratch_.batch();
    for (std::size_t i = 0; i < slots.size(); ++i) {
      std::memcpy(batch.observations + i * observation_bytes_, observations(RowOf(slots[i])), observation_bytes_);
      if (mask_bytes_ > 0) std::memcpy(batch.action_masks + i * mask_bytes_, masks(RowOf(slots[i])), mask_bytes_);
    }
  }
  batch.slots = staged_;
  return batch;
}

void Rollout::Commit(const Batch& batch) {
  const bool in_place = batch.actions == actions_.data();
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const std::int32_t slot = batch.slots[i];
    std::int64_t& time = time_[static_cast<std::size_t>(slot)];
    ++time;
    full_ = full_ || time == n_steps_;
    if (in_place) continue;
    std::memcpy(observations(RowOf(slot)), batch.next_observations + i * observation_bytes_, observation_bytes_);
    if (mask_bytes_ > 0) std::memcpy(masks(RowOf(slot)), batch.next_action_masks + i * mask_bytes_, mask_bytes_);
  }
}

void Rollout::Restart() {
  for (std::int32_t slot = 0; slot < slots_; ++slot) {
    const std::int64_t row = RowOf(slot);
    if (row == slot) continue;
    std::memcpy(observations(slot), observations(row), observation_bytes_);
    if (mask_bytes_ > 0) std::memcpy(masks(slot), masks(row), mask_bytes_);
    time_[static_cast<std::size_t>(slot)] = 0;
  }
  full_ = false;
}

std::int64_t Rollout::size() const {
  return std::accumulate(time_.begin(), time_.end(), std::int64_t{0});
}

std::int64_t Rollout::ListRows(std::span<std::int32_t> rows) const {
  std::size_t count = 0;
  for (std::int64_t slot = 0; slot < slots_; ++slot) {
    for (std::int64_t t = 0; t < time_[static_cast<std::size_t>(slot)]; ++t)
      rows[count++] = static_cast<std::int32_t>(t * slots_ + slot);
  }
  return static_cast<std::int64_t>(count);
}

void Rollout::Visit(Archive& archive) {
  archive("time", std::span<std::int64_t>(time_));
  archive.Check("time",
                std::all_of(time_.begin(), time_.end(), [&](std::int64_t t) { return t >= 0 && t <= n_steps_; }));
  archive("full", full_);
  archive.Check("full", full_ == (std::ranges::find(time_, n_steps_) != time_.end()));
  archive("observations", std::span<std::uint8_t>(reinterpret_cast<std::uint8_t*>(bytes_.data()), bytes_.size()));
  archive("masks", std::span<std::uint8_t>(masks_));
  archive("raw_actions", std::span<float>(raw_actions));
  archive("rewards", std::span<float>(rewards));
  archive("values", std::span<float>(values));
  archive("neglogp", std::span<float>(neglogp));
  archive("advantages", std::span<float>(advantages));
  archive("returns", std::span<float>(returns));
  archive("ended", std::span<std::uint8_t>(ended));
}

void EstimateAdvantages(Rollout& rollout, std::span<const float> last_values, double gamma, double gae_lambda) {
  const std::int64_t slots = rollout.slot_count();
  const auto discount = static_cast<float>(gamma), decay = static_cast<float>(gamma * gae_lambda);
  for (std::int64_t slot = 0; slot < slots; ++slot) {
    float next_value = last_values[static_cast<std::size_t>(slot)];
    float advantage = 0.0f;
    for (std::int64_t t = rollout.length(static_cast<std::int32_t>(slot)) - 1; t >= 0; --t) {
      const auto row = static_cast<std::size_t>(t * slots + slot);
      const float goes_on = rollout.ended[row] != 0 ? 0.0f : 1.0f;
      const float delta = rollout.rewards[row] + discount * next_value * goes_on - rollout.values[row];
      advantage = delta + decay * goes_on * advantage;
      rollout.advantages[row] = advantage;
      rollout.returns[row] = advantage + rollout.values[row];
      next_value = rollout.values[row];
    }
  }
}

}  // namespace consac::learn
