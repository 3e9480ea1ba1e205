#include "collect/actor_critic.h"

#include <algorithm>
#include <iterator>

#include "collect/acting_model.h"
#include "consac/nn/features.h"
#include "consac/nn/plan.h"

namespace consac::learn {
namespace {

bool HaveNoLayerInCommon(const nn::Network& network) {
  const nn::Plan plan(network);
  const std::vector<std::size_t> actor = plan.StepsTo(0), critic = plan.StepsTo(1);  // ascending
  std::vector<std::size_t> both;
  std::set_intersection(actor.begin(), actor.end(), critic.begin(), critic.end(), std::back_inserter(both));
  return both.empty();
}

}  // namespace

ActorCritic::ActorCritic(nn::Network network, ActionHead head, const BehaviourSpec& behaviour, std::uint64_t seed,
                         float log_std_init, const Communicator& ranks)
    : network_(std::move(network)),
      action_head_(std::move(head)),
      apart_(HaveNoLayerInCommon(network_) && !nn::HasImage(behaviour.observation_layout)),
      most_rows_(apart_ ? std::max<std::int64_t>(behaviour.slots, nn::Evaluator::kRowsTogether) : behaviour.slots),
      parameters_(network_count() + static_cast<std::size_t>(action_head_.log_std_size()), log_std_init),
      evaluator_(network_, most_rows_) {
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
