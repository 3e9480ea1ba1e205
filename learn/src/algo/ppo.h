#pragma once
// Proximal policy optimisation's settings and tables, shared by its two rows in the table of algorithms: `ppo2`
// (Stable Baselines 2.10.2) and `ppo` (Stable Baselines3). The algorithm is ppo.cpp. Private to learn.

#include <span>

#include "consac/learn/algo/learner.h"
#include "consac/learn/optim/optimiser.h"
#include "consac/nn/net_arch.h"

namespace consac::learn {

/// Whose definition is meant where the two generations differ.
enum class Generation : std::uint8_t { kStableBaselines2, kStableBaselines3 };

/// Settings of one PPO learner, from either table.
struct PpoOptions {
  Generation generation;       ///< whose log keys and progress formula
  std::int64_t n_steps;        ///< transitions per slot and update, T
  std::int64_t n_minibatches;  ///< pieces per epoch; 0: by batch_size
  std::int64_t batch_size;     ///< rows per minibatch; used where n_minibatches is 0
  std::int64_t n_epochs;       ///< passes over the rollout
  double gamma, gae_lambda;    ///< discount; decay of generalised advantages
  float ent_coef, vf_coef;     ///< weights of entropy and value loss
  double max_grad_norm;        ///< global norm clip; 0: none
  double target_kl;            ///< stop the epochs past 1.5 times this; 0: never
  Schedule learning_rate, clip_range, clip_range_vf;
  bool value_clip_follows;                     ///< clip_range_vf "none" means clip_range (SB2), not off (SB3)
  bool normalize_advantage;                    ///< per minibatch
  bool sample_std;                             ///< n - 1 in the advantages' deviation (SB3), not n (SB2)
  bool halved_value_loss;                      ///< 1/2 mean max(...) (SB2), not mean (...) of the clipped value (SB3)
  bool squared_kl;                             ///< 1/2 mean d^2 (SB2), not mean(e^d - 1 - d) (SB3)
  bool bootstrap_truncation;                   ///< add gamma V(final observation) where an episode was cut
  AdamOptions adam;                            ///< optimiser
  nn::ActorCriticOptions network;              ///< layers; sizes still unset
  float log_std_init;                          ///< starting log standard deviation of Box actions
  bool norm_obs, norm_reward;                  ///< VecNormalize
  double clip_obs, clip_reward, norm_epsilon;  ///< VecNormalize

  /// Reads values of either table; the error names the parameter.
  static Result<PpoOptions> From(const HyperparameterSet& values, Generation generation);
};

/// The table of `ppo2`.
std::span<const Hyperparameter> Ppo2Table();
/// The table of `ppo`.
std::span<const Hyperparameter> PpoTable();
/// Makes a learner of either kind.
Result<std::unique_ptr<Learner>> CreatePpo2(const LearnerOptions& options, const HyperparameterSet& values);
Result<std::unique_ptr<Learner>> CreatePpo(const LearnerOptions& options, const HyperparameterSet& values);

}  // namespace consac::learn
