#include "algo/off_policy_learner.h"

#include "collect/same_network.h"

namespace consac::learn {

PolicyData ActingModel(const BehaviourSpec& behaviour, const ReplayCollector& collector, const LearnedNetwork& acts,
                       std::string training_json) {
  PolicyData data;
  data.behaviour = behaviour.name;
  data.observation_space = behaviour.observation_space;
  data.action_space = behaviour.action_space;
  data.network = acts.network().spec();
  data.heads = collector.action_head().specs();
  data.parameters.assign(acts.parameters().begin(), acts.parameters().end());
  if (collector.normaliser().active()) data.normaliser = collector.normaliser();
  data.training_json = std::move(training_json);
  return data;
}

Status StartActingFrom(const PolicyData& model, ReplayCollector* collector, LearnedNetwork* acts) {
  CONSAC_RETURN_IF_ERROR(collector->StartFrom(model.normaliser));
  if (!SameNetwork(model.network, acts->network().spec()) || model.parameters.size() != acts->parameters().size()) {
    return {StatusCode::kInvalidArgument,
            "its network is another than this run's; give the policy, net_arch, activation_fn, layer_norm and, where "
            "the algorithm has it, dueling that it was trained with"};
  }
  acts->StartFrom(model.parameters);
  return Status::Ok();
}

}  // namespace consac::learn
