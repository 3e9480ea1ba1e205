#include "collect/replay_minibatch.h"

namespace consac::learn {

ReplayMinibatch::ReplayMinibatch(const BehaviourSpec& behaviour, std::int64_t rows, std::int64_t n_steps,
                                 const Communicator& ranks)
    : ranks_(ranks.size),
      features_(static_cast<std::size_t>(behaviour.observation_layout.feature_count)),
      n_steps_(n_steps),
      places_(static_cast<std::size_t>(rows)),
      observations_(places_.size()) {
  rewards.resize(places_.size());
  discounts.resize(places_.size());
  weights.assign(places_.size(), 1.0f);
  next_features.resize(places_.size() * features_);
  next_masks.resize(places_.size());
  errors.resize(places_.size());
}

bool ReplayMinibatch::Draw(ReplayCollector& collector, double beta) {
  collector_ = &collector;
  const Priorities* priorities = collector.replay().priorities();
  const std::optional<std::int64_t> with_other_goals = collector.DrawWithOtherGoals(places_);
  if (!with_other_goals.has_value()) return false;
  const std::int64_t others = *with_other_goals;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (static_cast<std::int64_t>(i) >= others) places_[i] = collector.Sample();
    const Lookahead ahead = collector.Look(places_[i], n_steps_);
    rewards[i] = static_cast<float>(ahead.reward);
    discounts[i] = ahead.discount;
    next_masks[i] = ahead.next_mask;
    if (priorities != nullptr) weights[i] = priorities->Weight(places_[i], beta);
    observations_[i] = collector.replay().observation(places_[i]);
    if (static_cast<std::int64_t>(i) >= others)
      collector.Encode(ahead.next_observation, next_features.data() + i * features_);
  }
  if (others > 0) GiveOtherGoals(others);
  return true;
}

// What the first rows saw, led to and brought, had their goals been meant.
void ReplayMinibatch::GiveOtherGoals(std::int64_t rows) {
  Hindsight& hindsight = *collector_->hindsight();
  const std::span<const float> paid = hindsight.paid();
  for (std::int64_t r = 0; r < rows; ++r) {
    const auto i = static_cast<std::size_t>(r);
    observations_[i] = hindsight.observation(r);
    collector_->Encode(hindsight.next_observation(r), next_features.data() + i * features_);
    rewards[i] = collector_->Reward(paid[i]);
    if (hindsight.forgets_ends()) discounts[i] = collector_->gamma();
  }
}

void ReplayMinibatch::Gather(const LossBlock& block) const {
  for (std::int64_t r = 0; r < block.rows; ++r) {
    collector_->Encode(observations_[static_cast<std::size_t>(block.first_row + r)],
                       block.inputs[0] + static_cast<std::size_t>(r) * features_);
  }
}

void ReplayMinibatch::Encode(float* features) const {
  for (std::size_t i = 0; i < places_.size(); ++i) collector_->Encode(observations_[i], features + i * features_);
}

void ReplayMinibatch::SetPriorities() {
  Priorities* priorities = collector_->replay().priorities();
  if (priorities == nullptr) return;
  for (std::size_t i = 0; i < places_.size(); ++i) priorities->Update(places_[i], static_cast<double>(errors[i]));
}

}  // namespace consac::learn
