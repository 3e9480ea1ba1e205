#include "collect/replay_collector.h"

#include <algorithm>

#include "collect/acting_model.h"

namespace consac::learn {
namespace {

VecNormaliseOptions WithDiscount(VecNormaliseOptions options, double gamma) {
  options.gamma = gamma;
  return options;
}

}  // namespace

ReplayCollector::ReplayCollector(const BehaviourSpec& behaviour, ActionHead head, const ReplayCollectorOptions& options,
                                 std::uint64_t seed, const Communicator& ranks)
    : behaviour_(behaviour),
      options_(options),
      action_head_(std::move(head)),
      raw_size_(static_cast<std::size_t>(action_head_.raw_size())),
      normalise_(behaviour, WithDiscount(options.normalise, options.gamma), ranks),
      replay_(behaviour, action_head_.raw_size(), options.replay),
      episodes_(behaviour.slots),
      sampling_rng_(seed, StreamId("replay_sampling")),
      round_slot_steps_(static_cast<std::size_t>(behaviour.slots)),
      features_(static_cast<std::size_t>(behaviour.slots * behaviour.observation_layout.feature_count)),
      raw_(static_cast<std::size_t>(behaviour.slots) * raw_size_),
      kept_raw_(raw_.size()),
      terminated_(static_cast<std::size_t>(behaviour.slots)) {
  if (options_.hindsight.buffer == ReplayBufferClass::kHindsight) hindsight_.emplace(behaviour_, options_.hindsight);
}

Status ReplayCollector::StartFrom(const PolicyData& model, LearnedNetwork* acts) {
  CONSAC_RETURN_IF_ERROR(normalise_.StartFrom(model.normaliser));
  if (!SameNetwork(model.network, acts->network().spec()) ||
      model.parameters.size() != acts->network_parameters().size() || model.log_std.size() != acts->extra().size()) {
    return {StatusCode::kInvalidArgument,
            "its network is another than this run's; give the policy, net_arch, activation_fn, layer_norm and, where "
            "the algorithm has them, dueling, use_sde and full_std that it was trained with"};
  }
  std::vector<float> all = model.parameters;
  all.insert(all.end(), model.log_std.begin(), model.log_std.end());
  acts->StartFrom(all);
  return Status::Ok();
}

PolicyData ReplayCollector::Snapshot(const LearnedNetwork& acts, std::string training_json) const {
  PolicyData data = ActingModel(behaviour_, acts.network(), action_head_, normaliser(), std::move(training_json));
  data.parameters.assign(acts.network_parameters().begin(), acts.network_parameters().end());
  data.log_std.assign(acts.extra().begin(), acts.extra().end());
  return data;
}

void ReplayCollector::Begin(const Batch& batch) {
  for (const std::int32_t slot : batch.slots) {
    normalise_.Forget(slot);
    episodes_.Forget(slot);
  }
  replay_.Begin(batch);
  normalise_.Observe(batch.next_observations, batch.rows());
}

ReplayCollector::Acting ReplayCollector::BeginAct(const Batch& batch) {
  normalise_.Encode(batch.observations, batch.rows(), features_.data());
  return {features_.data(), raw_.data()};
}

void ReplayCollector::FinishAct(Batch& batch) {
  action_head_.Write(raw_.data(), batch.rows(), batch.actions);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    std::copy_n(raw_.data() + i * raw_size_, raw_size_,
                kept_raw_.data() + static_cast<std::size_t>(batch.slots[i]) * raw_size_);
  }
}

// Learning is due when the quickest agent has taken train_freq steps: where all step together, after so many of them.
bool ReplayCollector::Record(const Batch& batch) {
  normalise_.Observe(batch.next_observations, batch.rows());
  normalise_.ObserveRewards(batch);
  Batch kept = batch;
  if (options_.truncation == Truncation::kTerminal) {
    for (std::size_t i = 0; i < batch.slots.size(); ++i) terminated_[i] = batch.terminated[i] | batch.truncated[i];
    kept.terminated = terminated_.data();
  }
  const std::int64_t reports_before = reports();
  bool quickest = false;
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const auto slot = static_cast<std::size_t>(batch.slots[i]);
    std::copy_n(kept_raw_.data() + slot * raw_size_, raw_size_, raw_.data() + i * raw_size_);
    quickest = ++round_slot_steps_[slot] >= options_.train_freq || quickest;
  }
  replay_.Commit(kept, raw_.data());
  steps_ += batch.rows();
  round_steps_ += batch.rows();
  round_episodes_ += episodes_.Add(batch);
  const bool whole = options_.train_freq_unit == TrainUnit::kStep ? quickest : round_episodes_ >= options_.train_freq;
  if (whole) {
    if (steps_ > options_.learning_starts) due_ += options_.gradient_steps < 0 ? round_steps_ : options_.gradient_steps;
    round_steps_ = round_episodes_ = 0;
    std::fill(round_slot_steps_.begin(), round_slot_steps_.end(), 0);
  }
  return reports() != reports_before;
}

// Rounds that came due in one look at all agents: each takes one more step at most before learning begins.
std::int64_t ReplayCollector::MostDue() const {
  const std::int64_t slots = behaviour_.slots;
  if (replay_.size() == 0) return 0;
  if (options_.gradient_steps >= 0) return slots * options_.gradient_steps;
  return options_.train_freq_unit == TrainUnit::kStep ? std::min(steps_, slots * (options_.train_freq + 1)) : steps_;
}

void ReplayCollector::Visit(Archive& archive) {
  archive("replay", replay_);
  archive("replay_rng", sampling_rng_);
  normalise_.Visit(archive);
  archive("episodes", episodes_);
  archive("steps", steps_);
  archive("due", due_);
  archive.CheckWithin("due", due_, 0, MostDue());
  archive("round", round_);
  archive.CheckWithin("round", round_, 0, due_);
  archive("round_steps", round_steps_);
  archive.CheckWithin("round_steps", round_steps_, 0, steps_);
  archive("round_episodes", round_episodes_);
  archive.CheckWithin("round_episodes", round_episodes_, 0, round_steps_);
  archive("round_slot_steps", std::span<std::int64_t>(round_slot_steps_));
  std::int64_t left = round_steps_;
  const bool within = std::ranges::all_of(round_slot_steps_, [&left](std::int64_t steps) {
    const bool fits = steps >= 0 && steps <= left;
    left -= fits ? steps : 0;
    return fits;
  });
  archive.Check("round_slot_steps", within && left == 0);
}

}  // namespace consac::learn
