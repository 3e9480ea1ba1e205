// PPO's first half: act, record, normalise, bootstrap what was cut off.
#include <algorithm>
#include <cmath>

#include "algo/ppo_learner.h"

namespace consac::learn {

Batch Ppo::Stage(std::span<const std::int32_t> slots) {
  CONSAC_ASSERT(!LearningDue());
  return rollout_.Stage(slots);
}

void Ppo::Encode(const std::byte* observations, std::int64_t rows, float* features) {
  EncodeFeatures(behaviour_.observation_layout, observations, rows, features);
}

void Ppo::EncodeNormalised(const std::byte* observations, std::int64_t rows, float* features) {
  Encode(observations, rows, features);
  if (ppo_.norm_obs) normaliser_.Apply(features, rows);
}

// In place, so that a step never allocates once the vectors have their size.
void Ppo::RefreshNormaliser() {
  normaliser_.clip = static_cast<float>(ppo_.clip_obs);
  normaliser_.mean.resize(observation_moments_.mean.size());
  normaliser_.scale.resize(observation_moments_.mean.size());
  for (std::size_t d = 0; d < normaliser_.mean.size(); ++d) {
    normaliser_.mean[d] = static_cast<float>(observation_moments_.mean[d]);
    normaliser_.scale[d] = static_cast<float>(1.0 / std::sqrt(observation_moments_.variance[d] + ppo_.norm_epsilon));
  }
}

void Ppo::ValuesOf(const float* features, std::int64_t rows, float* values) {
  evaluator_.ForwardTo(1, std::span<const float* const>(&features, 1), rows);
  std::copy_n(evaluator_.output(1), rows, values);
}

void Ppo::Begin(const Batch& batch) {
  // A slot that begins again in the middle of a rollout has lost its episode: what it had is cut there.
  for (const std::int32_t slot : batch.slots) {
    discounted_[static_cast<std::size_t>(slot)] = 0.0f;
    if (rollout_.length(slot) == 0) continue;
    const auto last = static_cast<std::size_t>(rollout_.RowOf(slot) - behaviour_.slots);
    if (rollout_.ended[last] != 0) continue;
    float value = 0.0f;
    EncodeNormalised(rollout_.observations(rollout_.RowOf(slot)), 1, work_features_.data());
    ValuesOf(work_features_.data(), 1, &value);
    rollout_.rewards[last] += static_cast<float>(ppo_.gamma) * value;
    rollout_.ended[last] = 1;
  }
  rollout_.Begin(batch);
  if (!ppo_.norm_obs) return;
  Encode(batch.next_observations, batch.rows(), work_features_.data());
  observation_moments_.Update(work_features_.data(), batch.rows());
  RefreshNormaliser();
}

// What was chosen is kept slot by slot until its outcome is recorded. Where all slots act, their rows are the batch's.
void Ppo::Act(Batch& batch) {
  const std::int64_t rows = batch.rows();
  const bool whole = rows == behaviour_.slots;  // ascending and unique, so slot i is row i
  CONSAC_ASSERT(!whole || batch.slots[0] == 0);
  float* features = whole ? step_features_.data() : work_features_.data();
  float* raw = whole ? step_raw_.data() : part_raw_.data();
  float* neglogp = whole ? step_neglogp_.data() : part_neglogp_.data();
  EncodeNormalised(batch.observations, rows, features);
  const float* input = features;
  evaluator_.Forward(std::span<const float* const>(&input, 1), rows);
  SelectActions(behaviour_.action_layout, evaluator_.output(0), log_std().data(), batch.action_masks, rows,
                ActionMode::kSample, action_rng_, raw, neglogp);
  WriteActions(behaviour_.action_layout, raw, rows, batch.actions);
  for (std::int64_t i = 0; i < rows; ++i) {
    const auto slot = static_cast<std::size_t>(batch.slots[static_cast<std::size_t>(i)]);
    step_values_[slot] = evaluator_.output(1)[i];
    step_neglogp_[slot] = -neglogp[i];
    if (whole) continue;
    std::copy_n(features + i * features_, features_,
                step_features_.data() + slot * static_cast<std::size_t>(features_));
    std::copy_n(raw + i * raw_size_, raw_size_, step_raw_.data() + slot * static_cast<std::size_t>(raw_size_));
  }
}

// VecNormalize: rewards are divided by the deviation of the running discounted return; no mean is taken off.
void Ppo::NormaliseRewards(const Batch& batch) {
  const auto gamma = static_cast<float>(ppo_.gamma);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    float& discounted = discounted_[static_cast<std::size_t>(batch.slots[i])];
    discounted = discounted * gamma + batch.rewards[i];
    step_rewards_[i] = discounted;
  }
  return_moments_.Update(step_rewards_.data(), batch.rows());
  const double scale = 1.0 / std::sqrt(return_moments_.variance[0] + ppo_.norm_epsilon);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    step_rewards_[i] = static_cast<float>(std::clamp(batch.rewards[i] * scale, -ppo_.clip_reward, ppo_.clip_reward));
    if ((batch.terminated[i] | batch.truncated[i]) != 0) discounted_[static_cast<std::size_t>(batch.slots[i])] = 0.0f;
  }
}

// An episode that was cut goes on in the value estimate: r += gamma V(final observation).
void Ppo::BootstrapTruncated(const Batch& batch) {
  const std::size_t row_bytes = behaviour_.observation_layout.row_bytes;
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    if (batch.truncated[i] == 0 || batch.terminated[i] != 0) continue;
    float value = 0.0f;
    EncodeNormalised(batch.final_observations + i * row_bytes, 1, work_features_.data());
    ValuesOf(work_features_.data(), 1, &value);
    step_rewards_[i] += static_cast<float>(ppo_.gamma) * value;
  }
}

void Ppo::Record(const Batch& batch) {
  const std::int64_t rows = batch.rows();
  if (ppo_.norm_obs) {
    Encode(batch.next_observations, rows, work_features_.data());
    observation_moments_.Update(work_features_.data(), rows);
    RefreshNormaliser();
  }
  if (ppo_.norm_reward)
    NormaliseRewards(batch);
  else
    std::copy_n(batch.rewards, rows, step_rewards_.data());
  if (ppo_.bootstrap_truncation) BootstrapTruncated(batch);

  const auto features = static_cast<std::size_t>(features_), raw = static_cast<std::size_t>(raw_size_);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const auto slot = static_cast<std::size_t>(batch.slots[i]);
    const auto row = static_cast<std::size_t>(rollout_.RowOf(batch.slots[i]));
    std::copy_n(step_features_.data() + slot * features, features, slab_features_.data() + row * features);
    std::copy_n(step_raw_.data() + slot * raw, raw, rollout_.raw_actions.data() + row * raw);
    rollout_.values[row] = step_values_[slot];
    rollout_.neglogp[row] = step_neglogp_[slot];
    rollout_.rewards[row] = step_rewards_[i];
    rollout_.ended[row] = batch.terminated[i] | batch.truncated[i];
  }
  rollout_.Commit(batch);
  steps_ += rows;
}

}  // namespace consac::learn
