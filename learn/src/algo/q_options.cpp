#include "algo/q_options.h"

#include <utility>

#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr std::int64_t kHiddenLayers[] = {64, 64};  // both generations'
// Stable Baselines 2.10.2: TensorFlow's layer norm, and convolutions that start orthogonal where the rest is Xavier's.
constexpr double kLayerNormEpsilon = 1e-12;
constexpr float kConvolutionGain = 1.41421356f;

}  // namespace

// Behind a CNN Stable Baselines 2 has its hidden layers in the value's tower alone, Stable Baselines3 nowhere.
Result<QModel> MakeQModel(const LearnerOptions& options, const QOptions& own, const char* algorithm) {
  const Layout& actions = options.behaviour.action_layout;
  if (actions.leaves.size() != 1 || actions.leaves[0].space.kind() != SpaceKind::kDiscrete) {
    return Status{StatusCode::kInvalidArgument,
                  std::string(algorithm) +
                      " learns the value of each of a Discrete space's actions, and the actions of " +
                      Quote(options.behaviour.name) + " are none such; choose ppo or a2c"};
  }
  if (own.net_arch.has_value() && (!own.net_arch->pi.empty() || !own.net_arch->vf.empty())) {
    return Status{StatusCode::kInvalidArgument, "net_arch " + nn::ToString(*own.net_arch) +
                                                    " names towers that action values do not have; give a list of "
                                                    "widths, as [64, 64]"};
  }
  Result<ObservationEntry> entry = EntryOf(own.policy, options.behaviour, own.collect.normalise.norm_obs);
  if (!entry.ok()) return entry.status();
  nn::QNetworkOptions layers = own.network;
  if (own.policy == PolicyKind::kLnMlp || own.policy == PolicyKind::kLnCnn) layers.layer_norm = true;
  layers.layer_norm_epsilon = kLayerNormEpsilon;
  layers.layers = own.net_arch.has_value()
                      ? own.net_arch->shared
                      : std::vector<std::int64_t>(std::begin(kHiddenLayers), std::end(kHiddenLayers));
  layers.action_count = actions.leaves[0].space.n();
  if (!entry->hidden_layers && layers.duelling) layers.value_layers = std::exchange(layers.layers, {});
  if (!entry->hidden_layers && !own.net_arch.has_value()) layers.layers.clear();
  if (layers.init == nn::Init::kXavierUniform) {
    entry->features.init = nn::Init::kOrthogonal;
    entry->features.gain = kConvolutionGain;
  }
  const Result<nn::NetworkSpec> spec = nn::QNetwork(options.behaviour.observation_layout, layers, entry->features);
  if (!spec.ok()) return spec.status();
  Result<nn::Network> network = nn::Network::Create(*spec);
  if (!network.ok()) return network.status();
  if (const Status acts = CheckActivations(*network); !acts.ok())  // or what was learned could not be loaded
    return Status{StatusCode::kInvalidArgument, acts.message()};
  const HeadSpec values{actions.leaves[0].name, "q_values"};
  Result<ActionHead> head = ActionHead::Create(actions, std::span(&values, 1));
  if (!head.ok()) return head.status();
  return QModel{std::move(*network), std::move(*head)};
}

}  // namespace consac::learn
