// Making a PPO learner: what must hold between its options, and the memory it takes.
#include "algo/ppo.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "algo/ppo_learner.h"

namespace consac::learn {

std::int64_t LargestMinibatch(const PpoOptions& ppo, std::int64_t slots) {
  const std::int64_t rows = ppo.n_steps * slots;
  return ppo.n_minibatches > 0 ? (rows + ppo.n_minibatches - 1) / ppo.n_minibatches : std::min(ppo.batch_size, rows);
}

Ppo::Ppo(const LearnerOptions& options, const PpoOptions& ppo, nn::Network network, std::string hyperparameters)
    : behaviour_(options.behaviour),
      ppo_(ppo),
      network_(std::move(network)),
      hyperparameters_(std::move(hyperparameters)),
      executor_(options.executor),
      features_(behaviour_.observation_layout.feature_count),
      raw_size_(RawActionSize(behaviour_.action_layout)),
      mask_bytes_(behaviour_.masks_actions ? behaviour_.action_layout.mask_bytes : 0),
      total_steps_(options.total_steps),
      parameters_(static_cast<std::size_t>(network_.parameter_count() + LogStdSize(behaviour_.action_layout)),
                  ppo.log_std_init),
      evaluator_(network_, behaviour_.slots),
      backpropagation_(network_, LogStdSize(behaviour_.action_layout), LargestMinibatch(ppo, behaviour_.slots)),
      adam_(static_cast<std::int64_t>(parameters_.size()), ppo.adam),
      rollout_(behaviour_, ppo.n_steps, raw_size_),
      action_rng_(options.seed, StreamId("action_sampling")),
      shuffle_rng_(options.seed, StreamId("minibatch_shuffle")),
      observation_moments_(ppo.norm_obs ? features_ : 0),
      return_moments_(1) {
  const auto slots = static_cast<std::size_t>(behaviour_.slots), features = static_cast<std::size_t>(features_);
  const auto raw = static_cast<std::size_t>(raw_size_), rollout_rows = slots * static_cast<std::size_t>(ppo.n_steps);
  const auto rows = static_cast<std::size_t>(LargestMinibatch(ppo, behaviour_.slots));
  Rng init_rng(options.seed, StreamId("network_initialisation"));
  network_.Initialise(init_rng, std::span(parameters_).first(static_cast<std::size_t>(network_.parameter_count())));
  evaluator_.Load(std::span(parameters_).first(static_cast<std::size_t>(network_.parameter_count())));
  discounted_.resize(slots);
  step_features_.resize(slots * features);
  work_features_.resize(slots * features);
  step_raw_.resize(slots * raw);
  part_raw_.resize(slots * raw);
  for (std::vector<float>* column : {&step_values_, &step_neglogp_, &part_neglogp_, &step_rewards_, &last_values_})
    column->resize(slots);
  slab_features_.resize(rollout_rows * features);
  order_.resize(rollout_rows);
  for (std::vector<float>* column : {&mb_advantages_, &mb_returns_, &mb_values_, &mb_neglogp_}) column->resize(rows);
  mb_raw_.resize(rows * raw);
  mb_masks_.resize(rows * static_cast<std::size_t>(mask_bytes_));
  heads_.assign((rows + kBlockRows - 1) / kBlockRows, HeadGradient(behaviour_.action_layout));
  block_sums_.resize(heads_.size());
  metrics_.reserve(32);
  if (ppo_.norm_obs) RefreshNormaliser();
}

namespace {

std::string HyperparametersJson(const HyperparameterSet& values) {
  nlohmann::json json = nlohmann::json::object();
  for (const Hyperparameter& row : values.table()) json[row.name] = values.Text(row.name);
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// What the rollout and the learner's own rows keep of one step of one agent.
std::int64_t BytesOfTransition(const BehaviourSpec& behaviour) {
  const Layout &seen = behaviour.observation_layout, &done = behaviour.action_layout;
  constexpr std::int64_t kNumbers = 8;  // reward, value, advantage, place in the order, ...
  return static_cast<std::int64_t>(seen.row_bytes) + done.mask_bytes +
         (seen.feature_count + RawActionSize(done) + kNumbers) * static_cast<std::int64_t>(sizeof(float));
}

Result<std::unique_ptr<Learner>> CreateEither(const LearnerOptions& options, const HyperparameterSet& values,
                                              Generation generation) {
  Result<PpoOptions> ppo = PpoOptions::From(values, generation);
  if (!ppo.ok()) return ppo.status();
  CONSAC_RETURN_IF_ERROR(CheckHead(options.behaviour.action_layout));
  const std::int64_t rows = ppo->n_steps * options.behaviour.slots;
  if (rows > (std::int64_t{1} << 30)) {
    return Status{StatusCode::kInvalidArgument, "n_steps " + std::to_string(ppo->n_steps) + " times " +
                                                    std::to_string(options.behaviour.slots) +
                                                    " agents is more than 2^30 transitions; lower n_steps"};
  }
  if (ppo->n_minibatches > 0 && rows % ppo->n_minibatches != 0) {
    return Status{StatusCode::kInvalidArgument, "nminibatches " + std::to_string(ppo->n_minibatches) +
                                                    " does not divide the rollout of " + std::to_string(rows) +
                                                    " steps (n_steps times agents); choose one that does"};
  }
  const std::int64_t bytes = rows * BytesOfTransition(options.behaviour);
  if (bytes > options.max_bytes) {
    return Status{StatusCode::kResourceExhausted,
                  "a rollout of " + std::to_string(rows) + " steps (n_steps times agents) takes " +
                      std::to_string(bytes >> 20) + " MiB, more than the " + std::to_string(options.max_bytes >> 20) +
                      " that are allowed here; lower n_steps"};
  }
  ppo->network.observation_size = options.behaviour.observation_layout.feature_count;
  ppo->network.action_size = HeadSize(options.behaviour.action_layout);
  Result<nn::Network> network = nn::Network::Create(nn::ActorCritic(ppo->network));
  if (!network.ok()) return network.status();
  constexpr std::int64_t kCopies = 8;  // gradient, Adam's moments, the initialisation in double precision, the snapshot
  if (network->parameter_count() * kCopies * static_cast<std::int64_t>(sizeof(float)) > options.max_bytes - bytes) {
    return Status{StatusCode::kResourceExhausted,
                  "net_arch makes " + std::to_string(network->parameter_count()) +
                      " parameters, and learning them takes more memory than is allowed here; choose smaller layers"};
  }
  return std::unique_ptr<Learner>(
      std::make_unique<Ppo>(options, *ppo, std::move(*network), HyperparametersJson(values)));
}

}  // namespace

Result<std::unique_ptr<Learner>> CreatePpo2(const LearnerOptions& options, const HyperparameterSet& values) {
  return CreateEither(options, values, Generation::kStableBaselines2);
}

Result<std::unique_ptr<Learner>> CreatePpo(const LearnerOptions& options, const HyperparameterSet& values) {
  return CreateEither(options, values, Generation::kStableBaselines3);
}

}  // namespace consac::learn
