// The two tables of PPO and what their values mean.
#include <limits>
#include <vector>

#include "algo/ppo.h"

namespace consac::learn {
namespace {

using enum ParameterType;

constexpr const char* kActivations = "tanh|relu|sigmoid|elu|leaky_relu|silu|softplus|linear";

constexpr double kUnlimited = std::numeric_limits<double>::infinity();
constexpr const char* kSb2 = "Stable Baselines 2.10.2, PPO2";
constexpr const char* kSb3 = "Stable Baselines3, PPO";
constexpr const char* kOurs = "CONSAC; the two generations differ here";
constexpr const char* kNormalise = "Stable Baselines, VecNormalize";

constexpr Hyperparameter kPpo2Own[] = {
    {"gamma", "", kReal, "0.99", 0, 1, "", "discount per step", kSb2},
    {"n_steps", "", kInteger, "128", 1, 1e9, "", "steps per world and update; the rollout is n_steps times worlds",
     kSb2},
    {"ent_coef", "", kReal, "0.01", 0, kUnlimited, "", "weight of the entropy bonus", kSb2},
    {"learning_rate", "", kSchedule, "2.5e-4", 0, kUnlimited, "", "Adam's step size", kSb2},
    {"vf_coef", "", kReal, "0.5", 0, kUnlimited, "", "weight of the value loss", kSb2},
    {"max_grad_norm", "", kReal, "0.5", 0, kUnlimited, "none", "global gradient norm is clipped to this", kSb2},
    {"lam", "gae_lambda", kReal, "0.95", 0, 1, "", "decay of generalised advantages; 1 is Monte Carlo, 0 is one step",
     kSb2},
    {"nminibatches", "", kInteger, "4", 1, 1e9, "", "minibatches per epoch; must divide the rollout", kSb2},
    {"noptepochs", "n_epochs", kInteger, "4", 1, 1e6, "", "passes over the rollout per update", kSb2},
    {"cliprange", "clip_range", kSchedule, "0.2", 0, kUnlimited, "", "how far the probability ratio may move", kSb2},
    {"cliprange_vf", "clip_range_vf", kSchedule, "none", -kUnlimited, kUnlimited, "none",
     "how far the value may move; none: as cliprange, negative: no clipping", kSb2},
    {"batch_size", "", kInteger, "none", 1, 1e9, "none", "rows per minibatch, instead of nminibatches", kSb3},
    {"act_fun", "activation_fn", kChoice, "tanh", 0, 0, kActivations, "activation of hidden layers", kSb2},
    {"target_kl", "", kReal, "none", 0, kUnlimited, "none", "stop an update's epochs past 1.5 times this divergence",
     kSb3},
    {"normalize_advantage", "", kBoolean, "true", 0, 0, "", "standardise advantages per minibatch", kSb3},
    {"advantage_std", "", kChoice, "population", 0, 0, "population|sample", "deviation by n (SB2) or n - 1 (SB3)",
     kOurs},
    {"value_loss", "", kChoice, "sb2", 0, 0, "sb2|sb3",
     "half the mean of the larger of both errors, or the mean of one", kOurs},
    {"optimizer", "", kChoice, "tensorflow", 0, 0, "tensorflow|pytorch", "whose form of Adam and of the gradient clip",
     kOurs},
};

constexpr Hyperparameter kPpoOwn[] = {
    {"learning_rate", "", kSchedule, "3e-4", 0, kUnlimited, "", "Adam's step size", kSb3},
    {"n_steps", "", kInteger, "2048", 1, 1e9, "", "steps per world and update; the rollout is n_steps times worlds",
     kSb3},
    {"batch_size", "", kInteger, "64", 1, 1e9, "", "rows per minibatch", kSb3},
    {"n_epochs", "noptepochs", kInteger, "10", 1, 1e6, "", "passes over the rollout per update", kSb3},
    {"gamma", "", kReal, "0.99", 0, 1, "", "discount per step", kSb3},
    {"gae_lambda", "lam", kReal, "0.95", 0, 1, "", "decay of generalised advantages; 1 is Monte Carlo, 0 is one step",
     kSb3},
    {"clip_range", "cliprange", kSchedule, "0.2", 0, kUnlimited, "", "how far the probability ratio may move", kSb3},
    {"clip_range_vf", "cliprange_vf", kSchedule, "none", -kUnlimited, kUnlimited, "none",
     "how far the value may move; none: no clipping", kSb3},
    {"normalize_advantage", "", kBoolean, "true", 0, 0, "", "standardise advantages per minibatch", kSb3},
    {"ent_coef", "", kReal, "0", 0, kUnlimited, "", "weight of the entropy bonus", kSb3},
    {"vf_coef", "", kReal, "0.5", 0, kUnlimited, "", "weight of the value loss", kSb3},
    {"max_grad_norm", "", kReal, "0.5", 0, kUnlimited, "none", "global gradient norm is clipped to this", kSb3},
    {"target_kl", "", kReal, "none", 0, kUnlimited, "none", "stop an update's epochs past 1.5 times this divergence",
     kSb3},
    {"nminibatches", "", kInteger, "none", 1, 1e9, "none", "minibatches per epoch, instead of batch_size", kSb2},
    {"activation_fn", "act_fun", kChoice, "tanh", 0, 0, kActivations, "activation of hidden layers", kSb3},
    {"advantage_std", "", kChoice, "sample", 0, 0, "population|sample", "deviation by n (SB2) or n - 1 (SB3)", kOurs},
    {"value_loss", "", kChoice, "sb3", 0, 0, "sb2|sb3",
     "half the mean of the larger of both errors, or the mean of one", kOurs},
    {"optimizer", "", kChoice, "pytorch", 0, 0, "tensorflow|pytorch", "whose form of Adam and of the gradient clip",
     kOurs},
};

constexpr Hyperparameter kShared[] = {
    {"policy", "", kChoice, "MlpPolicy", 0, 0, "MlpPolicy", "kind of network: dense layers", kSb2},
    {"net_arch", "", kText, "[dict(pi=[64, 64], vf=[64, 64])]", 0, 0, "",
     "layers: shared widths, then dict(pi=[...], vf=[...])", kSb2},
    {"ortho_init", "", kBoolean, "true", 0, 0, "", "orthogonal initial weights; false: PyTorch's uniform", kSb3},
    {"log_std_init", "", kReal, "0", -20, 20, "", "starting log standard deviation of Box actions", kSb3},
    {"adam_epsilon", "", kReal, "1e-5", 0, 1, "", "Adam's epsilon", kSb2},
    {"truncation", "", kChoice, "bootstrap", 0, 0, "bootstrap|terminal",
     "a cut episode goes on in the value estimate (SB3), or counts as ended (SB2)", kOurs},
    {"norm_obs", "", kBoolean, "false", 0, 0, "", "normalise observations by their running moments", kNormalise},
    {"norm_reward", "", kBoolean, "false", 0, 0, "", "scale rewards by the running deviation of the return",
     kNormalise},
    {"clip_obs", "", kReal, "10", 0, kUnlimited, "", "largest normalised observation", kNormalise},
    {"clip_reward", "", kReal, "10", 0, kUnlimited, "", "largest scaled reward", kNormalise},
    {"norm_epsilon", "", kReal, "1e-8", 0, 1, "", "added to variances", kNormalise},
};

std::vector<Hyperparameter> JoinTables(std::span<const Hyperparameter> own) {
  std::vector<Hyperparameter> table(own.begin(), own.end());
  table.insert(table.end(), std::begin(kShared), std::end(kShared));
  return table;
}

/// A number, or `absent` where the value is "none".
double RealOr(const HyperparameterSet& values, std::string_view name, double absent) {
  return values.Absent(name) ? absent : values.Real(name);
}

}  // namespace

std::span<const Hyperparameter> Ppo2Table() {
  static const std::vector<Hyperparameter> table = JoinTables(kPpo2Own);
  return table;
}

std::span<const Hyperparameter> PpoTable() {
  static const std::vector<Hyperparameter> table = JoinTables(kPpoOwn);
  return table;
}

Result<PpoOptions> PpoOptions::From(const HyperparameterSet& values, Generation generation) {
  const bool sb2 = generation == Generation::kStableBaselines2;
  PpoOptions o{};
  o.generation = generation;
  o.n_steps = values.Integer("n_steps");
  // Each table has the other's way of cutting minibatches as a row that is absent unless set.
  const bool by_count = sb2 ? values.Absent("batch_size") : !values.Absent("nminibatches");
  o.n_minibatches = by_count ? values.Integer("nminibatches") : 0;
  o.batch_size = by_count ? 0 : values.Integer("batch_size");
  o.n_epochs = values.Integer("n_epochs");
  o.gamma = values.Real("gamma");
  o.gae_lambda = values.Real("gae_lambda");
  o.ent_coef = static_cast<float>(values.Real("ent_coef"));
  o.vf_coef = static_cast<float>(values.Real("vf_coef"));
  o.max_grad_norm = RealOr(values, "max_grad_norm", 0.0);
  o.target_kl = RealOr(values, "target_kl", 0.0);
  o.learning_rate = values.AsSchedule("learning_rate");
  o.clip_range = values.AsSchedule("clip_range");
  o.clip_range_vf = values.AsSchedule("clip_range_vf");
  o.value_clip_follows = sb2;
  o.normalize_advantage = values.Boolean("normalize_advantage");
  o.sample_std = values.Text("advantage_std") == "sample";
  o.halved_value_loss = values.Text("value_loss") == "sb2";
  o.squared_kl = sb2;
  o.bootstrap_truncation = values.Text("truncation") == "bootstrap";
  o.adam.form = values.Text("optimizer") == "tensorflow" ? OptimiserForm::kTensorFlow : OptimiserForm::kPyTorch;
  o.adam.epsilon = static_cast<float>(values.Real("adam_epsilon"));
  o.log_std_init = static_cast<float>(values.Real("log_std_init"));
  o.norm_obs = values.Boolean("norm_obs");
  o.norm_reward = values.Boolean("norm_reward");
  o.clip_obs = values.Real("clip_obs");
  o.clip_reward = values.Real("clip_reward");
  o.norm_epsilon = values.Real("norm_epsilon");
  const Result<nn::NetArch> arch = nn::ParseNetArch(values.Text("net_arch"));
  if (!arch.ok()) return arch.status();
  o.network.arch = *arch;
  const Result<nn::Activation> activation = nn::ParseActivation(values.Text("activation_fn"));
  if (!activation.ok()) return activation.status();
  o.network.activation = *activation;
  o.network.orthogonal_init = values.Boolean("ortho_init");
  return o;
}

}  // namespace consac::learn
