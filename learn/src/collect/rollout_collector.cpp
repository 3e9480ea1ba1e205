#include "collect/rollout_collector.h"

#include <algorithm>
#include <limits>

#include "buffer/moments.h"
#include "consac/nn/features.h"

namespace consac::learn {
namespace {

VecNormaliseOptions WithGamma(VecNormaliseOptions options, double gamma) {
  options.gamma = gamma;
  return options;
}

/// Whether network inputs are kept as they were acted upon: normalised ones, since the moments move on, and small ones;
/// an image's are four times itself, and made anew from it.
bool KeepsFeatures(const BehaviourSpec& behaviour, const RolloutOptions& options) {
  return options.normalise.norm_obs || !nn::HasImage(behaviour.observation_layout);
}

}  // namespace

RolloutCollector::RolloutCollector(const BehaviourSpec& behaviour, const RolloutOptions& options, ActorCritic& model,
                                   std::uint64_t seed, const Communicator& ranks)
    : behaviour_(behaviour),
      options_(options),
      feature_count_(static_cast<std::size_t>(behaviour.observation_layout.feature_count)),
      raw_size_(static_cast<std::size_t>(model.action_head().raw_size())),
      model_(model),
      normalise_(behaviour, WithGamma(options.normalise, options.gamma), ranks),
      memory_(behaviour.slots, behaviour.observation_layout.feature_count, model.action_head().raw_size()),
      rollout_(behaviour, options.n_steps, model.action_head().raw_size()),
      action_rng_(seed, StreamId("action_sampling")),
      exploration_(model.action_head(), behaviour.slots, seed) {
  const auto slots = static_cast<std::size_t>(behaviour_.slots);
  const std::size_t rows = slots * static_cast<std::size_t>(options_.n_steps);
  if (KeepsFeatures(behaviour, options)) slab_features_.resize(rows * feature_count_);
  step_rewards_.resize(slots);
  work_features_.resize(slots * feature_count_);
  if (model_.apart())
    unvalued_.emplace(behaviour.slots, behaviour.observation_layout.feature_count, model_.most_rows());
  last_values_.resize(slots);
  rows_.resize(rows);
}

std::int64_t RolloutCollector::BytesOfTransition(const BehaviourSpec& behaviour, const RolloutOptions& options,
                                                 std::int64_t raw_size) {
  const Layout &seen = behaviour.observation_layout, &done = behaviour.action_layout;
  constexpr std::int64_t kNumbers = 8;  // reward, value, advantage, place in the order, ...
  const std::int64_t features = KeepsFeatures(behaviour, options) ? seen.feature_count : 0;
  return static_cast<std::int64_t>(seen.row_bytes) + done.mask_bytes +
         (features + raw_size + kNumbers) * static_cast<std::int64_t>(sizeof(float));
}

std::int64_t RolloutCollector::StateBytesOfTransition(const BehaviourSpec& behaviour, const RolloutOptions& options,
                                                      std::int64_t raw_size) {
  const Layout &seen = behaviour.observation_layout, &done = behaviour.action_layout;
  constexpr std::int64_t kNumbers = 5, kEnded = 1;  // rewards, values, neglogp, advantages, returns
  const std::int64_t features = KeepsFeatures(behaviour, options) ? seen.feature_count : 0;
  const std::int64_t masks = behaviour.masks_actions ? done.mask_bytes : 0;
  return static_cast<std::int64_t>(seen.row_bytes) + masks + kEnded +
         (features + raw_size + kNumbers) * static_cast<std::int64_t>(sizeof(float));
}

Status RolloutCollector::StartFrom(const PolicyData& model) {
  CONSAC_RETURN_IF_ERROR(normalise_.StartFrom(model.normaliser));
  return model_.StartFrom(model);
}

float RolloutCollector::ValueOf(const std::byte* observation) {
  normalise_.Encode(observation, 1, work_features_.data());
  return *model_.ValuesOf(work_features_.data(), 1);
}

void RolloutCollector::Begin(const Batch& batch) {
  // A slot that begins again in the middle of a rollout has lost its episode: what it had is cut there.
  for (const std::int32_t slot : batch.slots) {
    normalise_.Forget(slot);
    if (rollout_.length(slot) == 0) continue;
    const auto last = static_cast<std::size_t>(rollout_.RowOf(slot) - behaviour_.slots);
    if (rollout_.ended[last] != 0) continue;
    rollout_.rewards[last] += static_cast<float>(options_.gamma) * ValueOf(rollout_.observations(rollout_.RowOf(slot)));
    rollout_.ended[last] = 1;
  }
  rollout_.Begin(batch);
  normalise_.Observe(batch.next_observations, batch.rows());
}

void RolloutCollector::Act(Batch& batch) {
  const std::int64_t rows = batch.rows();
  const StepRows step = memory_.Stage(batch.slots);
  normalise_.Encode(batch.observations, rows, step.features);
  if (unvalued_.has_value()) {
    if (!unvalued_->HasRoomFor(batch.slots.size())) FindValues();
    unvalued_->Begin(batch.slots, step.features);
    model_.ForwardActor(step.features, rows);
  } else {
    model_.Forward(step.features, rows);
    std::copy_n(model_.values(), rows, step.values);
  }
  const SlotNoise noise =
      exploration_.Act(model_.action_head(), batch.slots, model_.log_std().data(),
                       [this](std::int32_t slot) { return static_cast<std::int64_t>(rollout_.length(slot)); });
  model_.action_head().Select(model_.head(), model_.log_std().data(), batch.action_masks, rows, ActionMode::kSample,
                              action_rng_, step.raw, step.neglogp, noise);
  model_.action_head().Write(step.raw, rows, batch.actions);
  for (std::int64_t i = 0; i < rows; ++i)
    step.neglogp[i] = -step.neglogp[i];  // what was written is the logarithm itself
  memory_.Keep(batch.slots);
}

// An episode that was cut goes on in the value estimate: r += gamma V(final observation).
void RolloutCollector::BootstrapTruncated(const Batch& batch) {
  const std::size_t row_bytes = behaviour_.observation_layout.row_bytes;
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    if (batch.truncated[i] == 0 || batch.terminated[i] != 0) continue;
    step_rewards_[i] += static_cast<float>(options_.gamma) * ValueOf(batch.final_observations + i * row_bytes);
  }
}

void RolloutCollector::Record(const Batch& batch) {
  normalise_.Observe(batch.next_observations, batch.rows());
  normalise_.Rewards(batch, step_rewards_.data());
  if (options_.truncation == Truncation::kBootstrap) BootstrapTruncated(batch);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const StepRows step = memory_.Row(batch.slots[i]);
    const auto row = static_cast<std::size_t>(rollout_.RowOf(batch.slots[i]));
    if (!slab_features_.empty())
      std::copy_n(step.features, feature_count_, slab_features_.data() + row * feature_count_);
    std::copy_n(step.raw, raw_size_, rollout_.raw_actions.data() + row * raw_size_);
    if (!unvalued_.has_value() || !unvalued_->Record(batch.slots[i], row)) rollout_.values[row] = *step.values;
    rollout_.neglogp[row] = *step.neglogp;
    rollout_.rewards[row] = step_rewards_[i];
    rollout_.ended[row] = batch.terminated[i] | batch.truncated[i];
  }
  rollout_.Commit(batch);
  steps_ += batch.rows();
}

// By the parameters that acted: of what is recorded by Finish at the latest, of steps under way by Restart.
void RolloutCollector::FindValues() {
  if (!unvalued_.has_value() || unvalued_->size() == 0) return;
  unvalued_->Give(
      model_.ValuesOf(unvalued_->features(), unvalued_->size()),
      [this](std::size_t row, float value) { rollout_.values[row] = value; },
      [this](std::int32_t slot, float value) { *memory_.Row(slot).values = value; });
}

std::span<std::int32_t> RolloutCollector::Finish() {
  FindValues();
  for (std::int32_t slot = 0; slot < behaviour_.slots; ++slot) {
    normalise_.Encode(rollout_.observations(rollout_.RowOf(slot)), 1,
                      work_features_.data() + static_cast<std::size_t>(slot) * feature_count_);
  }
  std::copy_n(model_.ValuesOf(work_features_.data(), behaviour_.slots), last_values_.size(), last_values_.begin());
  EstimateAdvantages(rollout_, last_values_, options_.gamma, options_.gae_lambda);
  return std::span(rows_).first(static_cast<std::size_t>(rollout_.ListRows(rows_)));
}

void RolloutCollector::Encode(std::size_t row, float* features) const {
  if (slab_features_.empty())
    return normalise_.Encode(rollout_.observations(static_cast<std::int64_t>(row)), 1, features);
  std::copy_n(slab_features_.data() + row * feature_count_, feature_count_, features);
}

double RolloutCollector::ExplainedVariance(std::span<const std::int32_t> rows) const {
  const Moments returns(rows, [this](std::size_t row) { return rollout_.returns[row]; });
  const Moments errors(rows, [this](std::size_t row) { return rollout_.returns[row] - rollout_.values[row]; });
  return returns.variance == 0.0 ? std::numeric_limits<double>::quiet_NaN() : 1.0 - errors.variance / returns.variance;
}

void RolloutCollector::Visit(Archive& archive) {
  // A state knows no steps that wait for their value.
  if (archive.loading() && unvalued_.has_value()) unvalued_->Clear();
  FindValues();
  archive("rollout", rollout_);
  archive("action_rng", action_rng_);
  exploration_.Visit(archive);
  normalise_.Visit(archive);
  archive("slab_features", std::span<float>(slab_features_));
  archive("steps", steps_);
}

}  // namespace consac::learn
