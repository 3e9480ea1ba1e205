#pragma once
// What algorithms that learn continuous actions by their value share besides off_policy.h: how they explore, and the
// networks of actor and critics for Box actions with finite bounds. Private to learn.

#include <array>
#include <optional>

#include "algo/critic_terms.h"
#include "algo/off_policy.h"
#include "algo/policy_kind.h"
#include "collect/continuous_collector.h"
#include "collect/learned_network.h"
#include "consac/nn/action_networks.h"

namespace consac::learn {

/// Options of every such algorithm.
struct ContinuousOptions : OffPolicyOptions {
  ContinuousExplorationOptions exploration;  ///< besides what the policy draws
  PolicyKind policy = PolicyKind::kAuto;     ///< how observations enter
  std::optional<nn::NetArch> net_arch;       ///< shared widths alone: both have them; or pi and qf
  nn::TowerOptions tower;                    ///< the rest of the layers
  std::int64_t n_critics = 2;                ///< networks of the value, each with a tower of its own
  AdamOptions adam;                          ///< of all optimisers; its form too
};

/// How the networks of such an algorithm are learned and run, with at most `run_rows` rows at once.
inline LearnedNetworkOptions LearnedBy(const LearnerOptions& options, const ContinuousOptions& own,
                                       std::int64_t run_rows) {
  return {.run_rows = run_rows, .batch_rows = own.batch_size, .adam = own.adam, .executor = options.executor};
}

/// The rows of ContinuousOptions.
namespace continuous_rows {
using O = ContinuousOptions;
using E = ContinuousExplorationOptions;
using A = ActionNoiseOptions;
using T = nn::TowerOptions;
using enum ParameterSource;
using Row = ParameterRow<ContinuousOptions>;

/// What both generations have alike but for these defaults of 2.10.2's.
constexpr std::array<off_policy_rows::Row, 8> CollectingRows(const char* learning_starts, const char* tau) {
  using namespace off_policy_rows;
  return {kGamma,
          kReplay[0],
          kReplay[1].WithDefaults(learning_starts, "100"),
          kReplay[3],
          kRounds[0],
          kTruncation,
          kTau.WithDefaults(tau, "0.005"),
          kLogKeys};
}
inline constexpr auto kCollecting = CollectingRows("100", "0.005");
inline constexpr Row kExploration[] = {
    {"action_noise", "action_noise", Into<O, &O::exploration, &E::noise, &A::kind>, "none", "none", 0, 0,
     "none|normal|ornstein_uhlenbeck", "noise that is added to actions while learning", kBoth},
    {"noise_std", "noise_std", Into<O, &O::exploration, &E::noise, &A::sigma>, "0.1", "0.1", 0, 1e6, "",
     "its deviation, where actions go from -1 to 1", kBoth},
    {"noise_mean", "noise_mean", Into<O, &O::exploration, &E::noise, &A::mean>, "0", "0", -1e6, 1e6, "",
     "its mean, or what it is drawn back to", kBoth},
    {"noise_theta", "noise_theta", Into<O, &O::exploration, &E::noise, &A::theta>, "0.15", "0.15", 0, 1e6, "",
     "ornstein_uhlenbeck: how strongly it is drawn back", kBoth},
    {"noise_dt", "noise_dt", Into<O, &O::exploration, &E::noise, &A::dt>, "0.01", "0.01", 0, 1e6, "",
     "ornstein_uhlenbeck: time of a step", kBoth},
    {"random_exploration", "random_exploration", Into<O, &O::exploration, &E::random_exploration>, "0", "0", 0, 1, "",
     "probability of a uniform action", kSb2},
};
inline constexpr Row kNetwork[] = {
    {"policy", "policy", Into<O, &O::policy>, "auto", "auto", 0, 0,
     "auto|MlpPolicy|CnnPolicy|MultiInputPolicy|LnMlpPolicy|LnCnnPolicy",
     "kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the observation needs",
     kBoth},
    {"layers", "net_arch", Into<O, &O::net_arch>, "[64, 64]", "[256, 256]", 0, 0, "",
     "widths of hidden layers of actor and critics, or dict(pi=[...], qf=[...])", kBoth},
    {"act_fun", "activation_fn", Into<O, &O::tower, &T::activation>, "relu", "relu", 0, 0, kActivationNames,
     "activation of hidden layers", kBoth},
    {"layer_norm", "layer_norm", Into<O, &O::tower, &T::layer_norm>, "false", "false", 0, 0, "",
     "hidden layers are normalised before their activation", kSb2},
    {"init", "init", Into<O, &O::tower, &T::init>, "xavier", "pytorch", 0, 0, "orthogonal|xavier|pytorch",
     "how weights start", kConsac},
    {"n_critics", "n_critics", Into<O, &O::n_critics>, "2", "2", 1, static_cast<double>(kMostCritics), "",
     "critics; targets take the least of what theirs say", kSb3},
};
/// The same with other widths, and so many critics.
constexpr std::array<Row, 6> NetworkRows(const char* sb2_layers, const char* sb3_layers, const char* n_critics = "2") {
  return {kNetwork[0], kNetwork[1].WithDefaults(sb2_layers, sb3_layers), kNetwork[2], kNetwork[3],
          kNetwork[4], kNetwork[5].WithDefaults(n_critics, n_critics)};
}
inline constexpr Row kOptimiser[] = {
    {"optimizer", "optimizer", Into<O, &O::adam, &AdamOptions::form>, "tensorflow", "pytorch", 0, 0,
     "tensorflow|pytorch", "whose form of Adam", kConsac},
    {"adam_epsilon", "adam_epsilon", Into<O, &O::adam, &AdamOptions::epsilon>, "1e-8", "1e-8", 0, 1, "",
     "Adam's epsilon", kConsac},
};
}  // namespace continuous_rows

/// What a learner of continuous actions is made of.
struct ContinuousModel {
  ActionHead head;      ///< how actions follow from "pi"
  nn::Network actor;    ///< output "pi"
  nn::Network critics;  ///< outputs "qf0", ..., and "vf" where asked for
};
/// What an algorithm wants of it.
struct ContinuousWants {
  const char* algorithm = "";          ///< whom errors tell of
  const char* head = "deterministic";  ///< distribution of the actions
  std::int64_t action_layer = 0;       ///< hidden layers of a critic that read the observation alone
  bool state_value = false;            ///< also a network of the state's value
  double output_bound = 0.0;           ///< of initial outputs; 0: as the rest
  bool parameter_noise = false;        ///< the actor has disturbed copies
  StateNoise noise = {};               ///< where the distribution follows the state: how; features are found out
};
/// The model for what `own` asks for; the error says what of it, or of the actions, does not fit, or that there is not
/// memory enough.
Result<ContinuousModel> MakeContinuousModel(const LearnerOptions& options, const ContinuousOptions& own,
                                            const ContinuousWants& wants);

/// What a report says besides losses.
struct ContinuousReport {
  float learning_rate = 0.0f;  ///< of the latest update
  std::int64_t updates = 0;    ///< so far
};
/// Replaces the metrics by what all such algorithms report, under the keys that were asked for.
void BeginMetrics(const ContinuousOptions& own, const EpisodeWindow& episodes, const ContinuousReport& report,
                  std::vector<Metric>* metrics);
/// A loss as Stable Baselines 2 names it: "loss/qf1_loss" in TensorBoard files, "qf1_loss" in its table.
Metric LossMetric(std::string_view tag, double value);

}  // namespace consac::learn
