#pragma once
// Stable Baselines' `net_arch` grammar and the actor-critic networks it describes.
// [<int>*, dict(pi=[...], vf=[...])?]: leading integers are shared layers, the dict gives the separate towers.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "consac/nn/features.h"
#include "consac/nn/network.h"

namespace consac::nn {

/// A parsed net_arch.
struct NetArch {
  std::vector<std::int64_t> shared;         ///< widths of the layers that actor and critic share
  std::vector<std::int64_t> pi = {64, 64};  ///< widths of the actor's own layers
  std::vector<std::int64_t> vf = {64, 64};  ///< widths of the critic's own layers
};

/// Parses "[128, dict(pi=[64], vf=[256,256])]", "[{pi: [64], vf: [64]}]", "[64, 64]" (all shared) or
/// "dict(pi=[..], vf=[..])" (SB3's form); qf, as SB3's algorithms of continuous actions have it, is vf. The error
/// quotes where it went wrong.
Result<NetArch> ParseNetArch(std::string_view text);
/// The canonical text of a NetArch.
std::string ToString(const NetArch& arch);

/// What an actor-critic network is built from.
struct ActorCriticOptions {
  NetArch arch;                               ///< layers
  Activation activation = Activation::kTanh;  ///< of hidden layers
  std::int64_t observation_size = 0;          ///< network inputs
  std::int64_t action_size = 0;               ///< numbers the action head needs
  bool orthogonal_init = true;                ///< false: PyTorch's uniform fan-in
  float hidden_gain = 1.41421356f;            ///< sqrt(2), Stable Baselines
  float policy_gain = 0.01f;                  ///< of the action head
  float value_gain = 1.0f;                    ///< of the value head
  bool with_features = false;  ///< "pi" has the numbers of the policy's last hidden layer behind the head's
};

/// One input "obs", outputs "pi" [action_size] and "vf" [1]; blocks "shared/i", "pi/i", "vf/i", "pi/head", "vf/head".
NetworkSpec ActorCritic(const ActorCriticOptions& options);
/// The same behind AddFeatures, whose values both towers read; observation_size is not looked at.
Result<NetworkSpec> ActorCritic(const Layout& observation, const ActorCriticOptions& options,
                                const FeatureOptions& features);

/// What a network of action values is built from. Defaults: Stable Baselines3's DQN; Stable Baselines 2 has `duelling`
/// and Init::kXavierUniform.
struct QNetworkOptions {
  std::vector<std::int64_t> layers = {64, 64};  ///< widths of the hidden layers
  Activation activation = Activation::kRelu;    ///< of hidden layers
  Init init = Init::kUniformFanIn;              ///< of all weights
  bool layer_norm = false;                      ///< hidden layers are normalised before their activation
  double layer_norm_epsilon = 1e-5;             ///< added to their variance
  bool duelling = false;                        ///< separate towers for the state's value and the advantages
  std::optional<std::vector<std::int64_t>> value_layers = {};  ///< widths of the value's tower; absent: `layers`
  std::int64_t observation_size = 0;                           ///< network inputs
  std::int64_t action_count = 0;                               ///< choices
};

/// One input "obs", one output "q" [action_count]; blocks "q/i", "q/head", or "advantage/i", "value/i", their heads and
/// the duelling block "q". It goes with the head "q_values".
NetworkSpec QNetwork(const QNetworkOptions& options);
/// The same behind AddFeatures; observation_size is not looked at.
Result<NetworkSpec> QNetwork(const Layout& observation, const QNetworkOptions& options, const FeatureOptions& features);

}  // namespace consac::nn
