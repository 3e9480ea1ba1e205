#include "collect/actor_critic.h"

#include <algorithm>

#include "collect/acting_model.h"

namespace consac::learn {
ActorCritic::ActorCritic(nn::Network network, ActionHead head, const BehaviourSpec& behaviour, std::uint64_t seed,
                         float log_std_init, const Communicator& ranks)
    : network_(std::move(network)),
      action_head_(std::move(head)),
      parameters_(network_count() + static_cast<std::size_t>(action_head_.log_std_size()), log_std_init),
      evaluator_(network_, behaviour.slots) {
  Rng rng(seed, StreamId("network_initialisation"));
  network_.Initialise(rng, std::span(parameters_).first(network_count()));
  ranks.Broadcast(parameters_);
  Publish();
}

Status ActorCritic::StartFrom(const PolicyData& model) {
  if (!SameNetwork(model.network, network_.spec()) || model.parameters.size() != network_count() ||
      model.log_std.size() != log_std().size()) {
    return {StatusCode::kInvalidArgument,
            "its network is another than this run's; give the policy, net_arch, act_fun, use_sde and full_std that it "
            "was trained with"};
  }
  std::copy(model.log_std.begin(), model.log_std.end(),
            std::copy(model.parameters.begin(), model.parameters.end(), parameters_.begin()));
  Publish();
  return Status::Ok();
}

void ActorCritic::ValuesOf(const float* features, std::int64_t rows, float* values) {
  evaluator_.ForwardTo(1, {&features, 1}, rows);
  std::copy_n(evaluator_.output(1), rows, values);
}

PolicyData ActorCritic::Snapshot(const BehaviourSpec& behaviour, const ObservationNormaliser& normaliser,
                                 std::string training_json) const {
  PolicyData data = ActingModel(behaviour, network_, action_head_, normaliser, std::move(training_json));
  const auto network_end = parameters_.begin() + static_cast<std::ptrdiff_t>(network_count());
  data.parameters.assign(parameters_.begin(), network_end);
  data.log_std.assign(network_end, parameters_.end());
  return data;
}

void ActorCritic::Visit(Archive& archive) {
  archive("parameters", std::span<float>(parameters_));
  if (archive.loading()) Publish();
}

}  // namespace consac::learn
