#include "collect/vec_normalise.h"

#include <algorithm>
#include <cmath>

namespace consac::learn {

VecNormalise::VecNormalise(const BehaviourSpec& behaviour, const VecNormaliseOptions& options,
                           const Communicator& ranks)
    : options_(options),
      layout_(behaviour.observation_layout),
      observation_moments_(options.norm_obs ? layout_.feature_count : 0, ranks),
      return_moments_(1, ranks),
      discounted_(static_cast<std::size_t>(behaviour.slots)),
      returns_(discounted_.size()),
      work_(options.norm_obs ? static_cast<std::size_t>(behaviour.slots * layout_.feature_count) : 0) {
  Refresh();
  RefreshRewards();
}

// In place, so that a step never allocates once the vectors have their size.
void VecNormalise::Refresh() {
  const RunningMoments& moments = observation_moments_.now();
  frozen_.clip = static_cast<float>(options_.clip_obs);
  frozen_.mean.resize(moments.mean.size());
  frozen_.scale.resize(moments.mean.size());
  for (std::size_t d = 0; d < frozen_.mean.size(); ++d) {
    frozen_.mean[d] = static_cast<float>(moments.mean[d]);
    frozen_.scale[d] = static_cast<float>(1.0 / std::sqrt(moments.variance[d] + options_.epsilon));
  }
}

Status VecNormalise::StartFrom(const ObservationNormaliser& normaliser) {
  if (normaliser.active() != options_.norm_obs) {
    return {StatusCode::kInvalidArgument, normaliser.active()
                                              ? "it normalises observations; set norm_obs=true"
                                              : "it does not normalise observations; set norm_obs=false"};
  }
  if (!options_.norm_obs) return Status::Ok();
  RunningMoments moments(layout_.feature_count);
  for (std::size_t d = 0; d < moments.mean.size(); ++d) {
    const auto scale = static_cast<double>(normaliser.scale[d]);
    moments.mean[d] = normaliser.mean[d];
    moments.variance[d] = std::max(0.0, 1.0 / (scale * scale) - options_.epsilon);
  }
  moments.count = kObservationsOfModel;
  observation_moments_.StartFrom(moments);
  Refresh();
  return Status::Ok();
}

void VecNormalise::Observe(const std::byte* observations, std::int64_t rows) {
  if (!options_.norm_obs) return;
  EncodeFeatures(layout_, observations, rows, work_.data());
  observation_moments_.Update(work_.data(), rows);
  Refresh();
}

void VecNormalise::Encode(const std::byte* observations, std::int64_t rows, float* features) const {
  EncodeFeatures(layout_, observations, rows, features);
  if (options_.norm_obs) frozen_.Apply(features, rows);
}

// The return begins anew after the step that ended an episode.
void VecNormalise::ObserveRewards(const Batch& batch) {
  if (!options_.norm_reward) return;
  const auto gamma = static_cast<float>(options_.gamma);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    float& discounted = discounted_[static_cast<std::size_t>(batch.slots[i])];
    discounted = discounted * gamma + batch.rewards[i];
    returns_[i] = discounted;
    if ((batch.terminated[i] | batch.truncated[i]) != 0) Forget(batch.slots[i]);
  }
  return_moments_.Update(returns_.data(), batch.rows());
  RefreshRewards();
}

void VecNormalise::RefreshRewards() {
  reward_scale_ = 1.0 / std::sqrt(return_moments_.now().variance[0] + options_.epsilon);
}

// Divided by the deviation of the running discounted return; no mean is taken off.
void VecNormalise::Rewards(const Batch& batch, float* rewards) {
  ObserveRewards(batch);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) rewards[i] = Reward(batch.rewards[i]);
}

void VecNormalise::Share() {
  observation_moments_.Share();
  return_moments_.Share();
  Refresh();
  RefreshRewards();
}

void VecNormalise::Visit(Archive& archive) {
  archive("observation_moments", observation_moments_);
  archive("return_moments", return_moments_);
  archive("discounted", std::span<float>(discounted_));
  if (!archive.loading()) return;
  Refresh();
  RefreshRewards();
}

}  // namespace consac::learn
