#pragma once
// The networks of algorithms that learn continuous actions by their value: an actor, and critics of an observation and
// an action. Used by learn; what acts afterwards has the actor alone.

#include <cstdint>
#include <vector>

#include "consac/nn/features.h"
#include "consac/nn/network.h"

namespace consac::nn {

/// What both are built from. Defaults: Stable Baselines3's SAC; Stable Baselines 2 has Init::kXavierUniform.
struct TowerOptions {
  std::vector<std::int64_t> layers = {256, 256};  ///< widths of the hidden layers
  Activation activation = Activation::kRelu;      ///< of hidden layers
  Init init = Init::kUniformFanIn;                ///< of all weights
  bool layer_norm = false;                        ///< hidden layers are normalised before their activation
  double layer_norm_epsilon = 1e-12;              ///< TensorFlow's
  double output_bound = 0.0;  ///< 0: outputs start as the rest; else uniform within plus and minus this, biases 0
};

/// What an actor is built from.
struct ActorOptions {
  TowerOptions tower;                       ///< layers
  std::int64_t outputs = 1;                 ///< numbers that the action's head needs
  std::int64_t groups = 1;                  ///< the outputs start as if they were so many layers side by side
  Activation output = Activation::kLinear;  ///< of the outputs
  bool with_features = false;               ///< the output has the last hidden layer's numbers behind the outputs
};
/// One input "obs", one output "pi"; blocks "pi/i" and "pi/head" (and with_features the concatenation "pi") behind
/// AddFeatures, whose errors it returns.
Result<NetworkSpec> Actor(const Layout& observation, const ActorOptions& options, const FeatureOptions& features);

/// What critics are built from.
struct CriticsOptions {
  TowerOptions tower;             ///< layers of each
  std::int64_t action_size = 1;   ///< numbers of an action
  std::int64_t count = 2;         ///< critics, each with a tower of its own
  std::int64_t action_layer = 0;  ///< hidden layers that read the observation alone: 1 in Stable Baselines 2's DDPG
  bool state_value = false;       ///< also the value of the observation alone
};
/// Inputs "obs" and "action", outputs "qf0", "qf1", ..., [1] each, and "vf" where asked for; blocks "qf0/i", "vf/i" and
/// so on behind one AddFeatures that all read, whose errors it returns. Parameters of fewer critics are the first of
/// those of more.
Result<NetworkSpec> Critics(const Layout& observation, const CriticsOptions& options, const FeatureOptions& features);

/// The value that the last block writes, which is also an output, has those of the value `features` behind its numbers
/// from now on: for heads that follow the state (consac/policy/state_noise.h).
void AppendFeatures(NetworkSpec& spec, const std::string& features);

/// The part of a network that its first output needs. Its parameters are the first of the whole's where its blocks are,
/// as those of the first critic.
NetworkSpec FirstOutputOf(const NetworkSpec& spec);

}  // namespace consac::nn
