#pragma once
// Policies with random weights, for tests of models.

#include "consac/nn/net_arch.h"
#include "graphs.h"

namespace consac::testing {

/// One that sees `seen` numbers as `observation` and whose head gives `done` numbers for `action`, with `hidden` units
/// in the layers of each side; its parameters as a training begins with them, drawn from `rng`, times `scale`.
inline PolicyData RandomPolicyData(Space observation, Space action, int seen, int done, std::vector<int> hidden,
                                   Rng& rng, float scale = 1.0f) {
  PolicyData data;
  data.observation_space = std::move(observation);
  data.action_space = std::move(action);
  nn::ActorCriticOptions options;
  options.arch = {{}, {hidden.begin(), hidden.end()}, {hidden.begin(), hidden.end()}};
  options.observation_size = seen;
  options.action_size = done;
  data.network = nn::ActorCritic(options);
  const auto network = nn::Network::Create(data.network);
  data.parameters.resize(static_cast<std::size_t>(network->parameter_count()));
  network->Initialise(rng, data.parameters);
  for (float& parameter : data.parameters) parameter *= scale;
  return data;
}

}  // namespace consac::testing
