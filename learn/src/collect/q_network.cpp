#include "collect/q_network.h"

#include <utility>

#include "collect/same_network.h"
#include "consac/nn/kernels.h"

namespace consac::learn {

QNetwork::QNetwork(nn::Network network, std::uint64_t seed, std::int64_t max_rows, const Communicator& ranks)
    : network_(std::move(network)),
      parameters_(static_cast<std::size_t>(network_.parameter_count())),
      evaluator_(network_, max_rows),
      target_evaluator_(network_, max_rows) {
  Rng rng(seed, StreamId("network_initialisation"));
  network_.Initialise(rng, parameters_);
  ranks.Broadcast(parameters_);
  target_ = parameters_;
}

Status QNetwork::StartFrom(const PolicyData& model) {
  if (!SameNetwork(model.network, network_.spec()) || model.parameters.size() != parameters_.size()) {
    return {StatusCode::kInvalidArgument,
            "its network is another than this run's; give the policy, net_arch, activation_fn, dueling and layer_norm "
            "that it was trained with"};
  }
  parameters_ = target_ = model.parameters;
  packed_ = target_packed_ = false;
  return Status::Ok();
}

void QNetwork::UpdateTarget(double tau) {
  nn::Polyak(static_cast<float>(tau), parameters_, target_);
  target_packed_ = false;
}

const float* QNetwork::Values(const float* features, std::int64_t rows) {
  if (!std::exchange(packed_, true)) evaluator_.Load(parameters_);
  evaluator_.Forward({&features, 1}, rows);
  return evaluator_.output(0);
}

const float* QNetwork::TargetValues(const float* features, std::int64_t rows) {
  if (!std::exchange(target_packed_, true)) target_evaluator_.Load(target_);
  target_evaluator_.Forward({&features, 1}, rows);
  return target_evaluator_.output(0);
}

PolicyData QNetwork::Snapshot(const BehaviourSpec& behaviour, const ObservationNormaliser& normaliser,
                              std::string training_json) const {
  PolicyData data;
  data.behaviour = behaviour.name;
  data.observation_space = behaviour.observation_space;
  data.action_space = behaviour.action_space;
  data.network = network_.spec();
  data.parameters = parameters_;
  if (normaliser.active()) data.normaliser = normaliser;
  data.training_json = std::move(training_json);
  return data;
}

void QNetwork::Visit(Archive& archive) {
  archive("parameters", std::span<float>(parameters_));
  archive("target", std::span<float>(target_));
  if (archive.loading()) packed_ = target_packed_ = false;
}

}  // namespace consac::learn
