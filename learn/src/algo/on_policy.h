#pragma once
// What on-policy algorithms share besides their pieces: options with the rows that fill them, what must hold before a
// learner is made, and the progress of its schedules. Each algorithm lists the rows that it has, with its own defaults.
// Private to learn.

#include <string>

#include "algo/normalise_rows.h"
#include "algo/parameter_rows.h"
#include "algo/policy_kind.h"
#include "algo/sde_rows.h"
#include "algo/training_json.h"
#include "collect/rollout_collector.h"
#include "consac/learn/algo/learner.h"
#include "grad/head_gradient.h"

namespace consac::learn {

/// Options of every actor-critic algorithm that learns from rollouts.
struct OnPolicyOptions {
  Generation generation = Generation::kStableBaselines3;  ///< whose log keys and progress formula
  RolloutOptions rollout;                                 ///< how it collects
  Schedule learning_rate;                                 ///< of the optimiser
  float ent_coef = 0.0f, vf_coef = 0.5f;                  ///< weights of entropy and value loss
  double max_grad_norm = 0.5;                             ///< global norm clip; 0: none
  bool normalize_advantage = false;                       ///< per minibatch
  PolicyKind policy = PolicyKind::kAuto;                  ///< kind of network
  std::optional<nn::NetArch> net_arch;                    ///< layers; absent: as the policy has them
  nn::ActorCriticOptions network;                         ///< the rest; layers and sizes still unset
  float log_std_init = 0.0f;                              ///< starting log standard deviation of Box actions
  SdeOptions sde;                                         ///< how those explore
  bool squash_output = false;                             ///< with that: tanh brings them into their bounds
};

/// The rows of OnPolicyOptions. Defaults are PPO's unless an algorithm has others.
namespace on_policy_rows {
using O = OnPolicyOptions;
using R = RolloutOptions;
using N = nn::ActorCriticOptions;
using enum ParameterSource;
using Row = ParameterRow<OnPolicyOptions>;

inline constexpr Row kGamma = {
    "gamma", "gamma", Into<O, &O::rollout, &R::gamma>, "0.99", "0.99", 0, 1, "", "discount per step", kBoth};
inline constexpr Row kNSteps = {"n_steps", "n_steps", Into<O, &O::rollout, &R::n_steps>,
                                "128",     "2048",    1,
                                1e9,       "",        "steps per world and update; the rollout is n_steps times worlds",
                                kBoth};
inline constexpr Row kGaeLambda = {
    "lam",  "gae_lambda", Into<O, &O::rollout, &R::gae_lambda>,
    "0.95", "0.95",       0,
    1,      "",           "decay of generalised advantages; 1 is Monte Carlo, 0 is one step",
    kBoth};
inline constexpr Row kLearningRate = {"learning_rate",
                                      "learning_rate",
                                      Into<O, &O::learning_rate>,
                                      "2.5e-4",
                                      "3e-4",
                                      0,
                                      kUnlimited,
                                      "",
                                      "the optimiser's step size",
                                      kBoth};
inline constexpr Row kEntCoef = {"ent_coef", "ent_coef", Into<O, &O::ent_coef>,         "0.01", "0", 0,
                                 kUnlimited, "",         "weight of the entropy bonus", kBoth};
inline constexpr Row kVfCoef = {"vf_coef",  "vf_coef", Into<O, &O::vf_coef>,       "0.5", "0.5", 0,
                                kUnlimited, "",        "weight of the value loss", kBoth};
inline constexpr Row kMaxGradNorm = {"max_grad_norm",
                                     "max_grad_norm",
                                     Into<O, &O::max_grad_norm>,
                                     "0.5",
                                     "0.5",
                                     0,
                                     kUnlimited,
                                     "none",
                                     "global gradient norm is clipped to this",
                                     kBoth};
inline constexpr Row kNormalizeAdvantage = {"normalize_advantage",
                                            "normalize_advantage",
                                            Into<O, &O::normalize_advantage>,
                                            "true",
                                            "true",
                                            0,
                                            0,
                                            "",
                                            "standardise advantages per minibatch",
                                            kSb3};
inline constexpr Row kTruncation = {"truncation",
                                    "truncation",
                                    Into<O, &O::rollout, &R::truncation>,
                                    "bootstrap",
                                    "bootstrap",
                                    0,
                                    0,
                                    "bootstrap|terminal",
                                    "a cut episode goes on in the value estimate (SB3), or counts as ended (SB2)",
                                    kConsac};
inline constexpr Row kNetwork[] = {
    {"policy", "policy", Into<O, &O::policy>, "auto", "auto", 0, 0, "auto|MlpPolicy|CnnPolicy|MultiInputPolicy",
     "kind of network: dense layers, convolutions for images, both; auto: what the observation needs", kBoth},
    {"net_arch", "net_arch", Into<O, &O::net_arch>, "auto", "auto", 0, 0, "",
     "layers: shared widths, then dict(pi=[...], vf=[...]); auto: [dict(pi=[64, 64], vf=[64, 64])], none behind "
     "CnnPolicy",
     kBoth},
    {"act_fun", "activation_fn", Into<O, &O::network, &N::activation>, "tanh", "tanh", 0, 0, kActivationNames,
     "activation of hidden layers", kBoth},
    {"ortho_init", "ortho_init", Into<O, &O::network, &N::orthogonal_init>, "true", "true", 0, 0, "",
     "orthogonal initial weights; false: PyTorch's uniform", kSb3},
    {"log_std_init", "log_std_init", Into<O, &O::log_std_init>, "0", "0", -20, 20, "",
     "starting log standard deviation of Box actions", kSb3},
};
inline constexpr auto& kSde = kSdeRows<O, &O::sde>;
inline constexpr Row kSquash[] = {{"squash_output", "squash_output", Into<O, &O::squash_output>, "false", "false", 0, 0,
                                   "", "with gSDE: tanh brings actions into their bounds; false: they are clipped",
                                   kSb3}};
inline constexpr auto& kNormalise = kNormaliseRows<O, &O::rollout, &R::normalise>;
}  // namespace on_policy_rows

/// What an actor-critic learner is made of.
struct OnPolicyModel {
  nn::Network network;    ///< outputs "pi" and "vf"
  ActionHead head;        ///< how actions follow from "pi"
  HeadGradient gradient;  ///< and how they are learned by
};
/// Checks spaces, sizes and memory and makes the model of a learner whose minibatches have at most `minibatch_rows`
/// rows; the error says what does not fit and what would.
Result<OnPolicyModel> MakeOnPolicyModel(const LearnerOptions& options, const OnPolicyOptions& own,
                                        std::int64_t minibatch_rows);
/// How far a training has come.
struct TrainingProgress {
  std::int64_t total_steps, steps;         ///< planned and taken, of agents
  std::int64_t updates, steps_per_update;  ///< finished; steps of a rollout
  /// Share of the training that is left: SB2 counts updates from the start of each, SB3 steps after collecting.
  double Remaining(Generation generation) const;
};
/// Mean of the standard deviations, for logs.
double MeanDeviation(std::span<const float> log_std);

}  // namespace consac::learn
