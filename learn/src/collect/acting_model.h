#pragma once
// Between a learner's network and models: what a model of it says besides its parameters, and whether another model's
// parameters fit. Private to learn.

#include <string>
#include <utility>

#include "consac/env/vector_env.h"
#include "consac/nn/network.h"
#include "consac/policy/policy.h"

namespace consac::learn {

/// Everything but its parameters of a model that acts for `behaviour` by `network` and `head`, behind `normaliser`;
/// `training_json` is told to people.
inline PolicyData ActingModel(const BehaviourSpec& behaviour, const nn::Network& network, const ActionHead& head,
                              const ObservationNormaliser& normaliser, std::string training_json) {
  PolicyData data;
  data.behaviour = behaviour.name;
  data.observation_space = behaviour.observation_space;
  data.action_space = behaviour.action_space;
  data.network = network.spec();
  data.heads = head.specs();
  if (normaliser.active()) data.normaliser = normaliser;
  data.training_json = std::move(training_json);
  return data;
}

/// True when both are alike but for what only fresh parameters are made by, which no model file says.
inline bool SameNetwork(nn::NetworkSpec a, nn::NetworkSpec b) {
  for (nn::NetworkSpec* spec : {&a, &b}) {
    for (nn::Block& block : spec->blocks) {
      block.init = nn::Init();
      block.gain = 1.0f;
    }
  }
  return a == b;
}

}  // namespace consac::learn
