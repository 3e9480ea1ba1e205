#pragma once
// What algorithms of action values share besides off_policy.h: how they explore, and the network of one value per
// choice of a Discrete action. Private to learn.

#include "algo/off_policy.h"
#include "algo/policy_kind.h"
#include "collect/epsilon_greedy.h"
#include "consac/nn/net_arch.h"

namespace consac::learn {

/// Options of every algorithm of action values.
struct QOptions : OffPolicyOptions {
  ExplorationSchedule exploration;
  PolicyKind policy = PolicyKind::kAuto;
  std::optional<nn::NetArch> net_arch;  ///< shared widths alone; absent: as the policy has them
  nn::QNetworkOptions network;          ///< the rest; layers and sizes still unset
};

/// The rows of QOptions. Defaults are DQN's.
namespace q_rows {
using Q = QOptions;
using N = nn::QNetworkOptions;
using E = ExplorationSchedule;
using enum ParameterSource;
using Row = ParameterRow<QOptions>;

inline constexpr Row kExploration[] = {
    {"exploration_fraction", "exploration_fraction", Into<Q, &Q::exploration, &E::fraction>, "0.1", "0.1", 0, 1, "",
     "share of the training over which epsilon falls", kBoth},
    {"exploration_initial_eps", "exploration_initial_eps", Into<Q, &Q::exploration, &E::initial>, "1", "1", 0, 1, "",
     "epsilon at the start", kBoth},
    {"exploration_final_eps", "exploration_final_eps", Into<Q, &Q::exploration, &E::final>, "0.02", "0.05", 0, 1, "",
     "epsilon from then on", kBoth},
};
inline constexpr Row kNetwork[] = {
    {"policy", "policy", Into<Q, &Q::policy>, "auto", "auto", 0, 0,
     "auto|MlpPolicy|CnnPolicy|MultiInputPolicy|LnMlpPolicy|LnCnnPolicy",
     "kind of network: dense layers, convolutions for images, both; Ln: layer_norm; auto: what the observation needs",
     kBoth},
    {"layers", "net_arch", Into<Q, &Q::net_arch>, "auto", "auto", 0, 0, "",
     "widths of hidden layers; auto: [64, 64], behind CnnPolicy none but in the value's tower; with dueling they are "
     "that "
     "tower's there",
     kBoth},
    {"act_fun", "activation_fn", Into<Q, &Q::network, &N::activation>, "relu", "relu", 0, 0, kActivationNames,
     "activation of hidden layers", kBoth},
    {"dueling", "dueling", Into<Q, &Q::network, &N::duelling>, "true", "false", 0, 0, "",
     "Q = V + A - mean A, from a tower of these widths for each", kSb2},
    {"layer_norm", "layer_norm", Into<Q, &Q::network, &N::layer_norm>, "false", "false", 0, 0, "",
     "hidden layers are normalised before their activation", kSb2},
    {"init", "init", Into<Q, &Q::network, &N::init>, "xavier", "pytorch", 0, 0, "orthogonal|xavier|pytorch",
     "how weights start", kConsac},
};
}  // namespace q_rows

/// What a learner of action values is made of.
struct QModel {
  nn::Network network;  ///< output "q"
  ActionHead head;      ///< how actions follow from it
};
/// The model for what `options` asks for; the error says what of it, or of the actions, does not fit. `algorithm` is
/// whom it tells of.
Result<QModel> MakeQModel(const LearnerOptions& options, const QOptions& own, const char* algorithm);

}  // namespace consac::learn
