#include "algo/q_options.h"

#include "consac/base/text.h"

namespace consac::learn {

Result<nn::Network> MakeQNetwork(const LearnerOptions& options, const QOptions& own, const char* algorithm) {
  const Layout& actions = options.behaviour.action_layout;
  if (actions.leaves.size() != 1 || actions.leaves[0].space.kind() != SpaceKind::kDiscrete) {
    return Status{StatusCode::kInvalidArgument,
                  std::string(algorithm) +
                      " learns the value of each of a Discrete space's actions, and the actions of " +
                      Quote(options.behaviour.name) + " are none such; choose ppo or a2c"};
  }
  if (!own.net_arch.pi.empty() || !own.net_arch.vf.empty()) {
    return Status{StatusCode::kInvalidArgument, "net_arch " + nn::ToString(own.net_arch) +
                                                    " names towers that action values do not have; give a list of "
                                                    "widths, as [64, 64]"};
  }
  nn::QNetworkOptions layers = own.network;
  layers.layers = own.net_arch.shared;
  layers.observation_size = options.behaviour.observation_layout.feature_count;
  layers.action_count = actions.leaves[0].space.n();
  Result<nn::Network> network = nn::Network::Create(nn::QNetwork(layers));
  if (!network.ok()) return network.status();
  if (const Status acts = CheckActivations(*network); !acts.ok())  // or what was learned could not be loaded
    return Status{StatusCode::kInvalidArgument, acts.message()};
  return network;
}

}  // namespace consac::learn
