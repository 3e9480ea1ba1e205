#include "algo/on_policy.h"

#include <algorithm>
#include <cmath>

#include "algo/progress.h"
#include "consac/base/text.h"
#include "consac/learn/grad/backpropagation.h"

namespace consac::learn {
namespace {

/// The heads where Box actions explore by their state; with `features` numbers of the policy's last hidden layer.
std::vector<HeadSpec> HeadsOf(const Layout& action, const OnPolicyOptions& own, std::int64_t features) {
  std::vector<HeadSpec> heads = DefaultHeads(action);
  for (std::size_t i = 0; i < heads.size(); ++i) {
    if (!own.sde.use_sde || action.leaves[i].space.kind() != SpaceKind::kBox) continue;
    heads[i].type = own.squash_output ? "squashed_sde_gaussian" : "sde_gaussian";
    heads[i].noise = own.sde.noise;
    heads[i].noise.features = features;
  }
  return heads;
}

Status CheckSde(const BehaviourSpec& behaviour, const OnPolicyOptions& own) {
  if (own.squash_output && !own.sde.use_sde)
    return {StatusCode::kInvalidArgument, "squash_output goes with use_sde; set use_sde, or leave squash_output out"};
  if (!own.sde.use_sde) return Status::Ok();
  const std::vector<Leaf>& leaves = behaviour.action_layout.leaves;
  const auto numbers = [](const Leaf& leaf) { return leaf.space.kind() == SpaceKind::kBox; };
  if (std::none_of(leaves.begin(), leaves.end(), numbers))
    return {StatusCode::kInvalidArgument, "use_sde is for Box actions, and those of " + Quote(behaviour.name) +
                                              " are " + behaviour.action_space.ToString() + "; leave it out"};
  for (const Leaf& leaf : leaves) {
    if (!own.squash_output || !numbers(leaf) || FindDistribution("squashed_sde_gaussian")->fits(leaf)) continue;
    return {StatusCode::kInvalidArgument, "squash_output brings actions between finite bounds, and those of " +
                                              Quote(behaviour.name) + " are " + leaf.space.ToString() +
                                              "; leave it out"};
  }
  return Status::Ok();
}

}  // namespace

Result<OnPolicyModel> MakeOnPolicyModel(const LearnerOptions& options, const OnPolicyOptions& own,
                                        std::int64_t minibatch_rows) {
  const BehaviourSpec& behaviour = options.behaviour;
  Result<ActionHead> head = ActionHead::Create(behaviour.action_layout);
  if (!head.ok()) return head.status();
  const std::int64_t rows = own.rollout.n_steps * behaviour.slots;
  if (rows > (std::int64_t{1} << 30)) {
    return Status{StatusCode::kInvalidArgument, "n_steps " + std::to_string(own.rollout.n_steps) + " times " +
                                                    std::to_string(behaviour.slots) +
                                                    " agents is more than 2^30 transitions; lower n_steps"};
  }
  const std::int64_t bytes = rows * RolloutCollector::BytesOfTransition(behaviour, own.rollout, head->raw_size());
  if (bytes > options.max_bytes) {
    return Status{StatusCode::kResourceExhausted,
                  "a rollout of " + std::to_string(rows) + " steps (n_steps times agents) takes " +
                      std::to_string(bytes >> 20) + " MiB, more than the " + std::to_string(options.max_bytes >> 20) +
                      " that are allowed here; lower n_steps"};
  }
  const std::int64_t state = rows * RolloutCollector::StateBytesOfTransition(behaviour, own.rollout, head->raw_size());
  if (state > options.max_state_bytes) {
    return Status{StatusCode::kInvalidArgument,
                  "a checkpoint would have " + std::to_string(state >> 20) + " MiB for a rollout of " +
                      std::to_string(rows) + " steps (n_steps times agents), of which at most " +
                      std::to_string(options.max_state_bytes >> 20) + " are read again; lower n_steps or --envs"};
  }
  CONSAC_RETURN_IF_ERROR(CheckSde(behaviour, own));
  nn::ActorCriticOptions layers = own.network;
  layers.action_size = head->size();
  layers.with_features = own.sde.use_sde;
  Result<ObservationEntry> entry = EntryOf(own.policy, behaviour, own.rollout.normalise.norm_obs);
  if (!entry.ok()) return entry.status();
  layers.arch = own.net_arch.value_or(entry->hidden_layers ? nn::NetArch{} : nn::NetArch{{}, {}, {}});
  if (layers.orthogonal_init) {
    entry->features.init = nn::Init::kOrthogonal;
    entry->features.gain = layers.hidden_gain;
  }
  Result<nn::NetworkSpec> spec = nn::ActorCritic(behaviour.observation_layout, layers, entry->features);
  if (!spec.ok()) return spec.status();
  Result<nn::Network> network = nn::Network::Create(std::move(*spec));
  if (!network.ok()) return network.status();
  if (const Status acts = CheckActivations(*network); !acts.ok())  // or what was learned could not be loaded
    return Status{StatusCode::kInvalidArgument, acts.message()};
  if (own.sde.use_sde) {
    head = ActionHead::Create(behaviour.action_layout,
                              HeadsOf(behaviour.action_layout, own, network->output_size(0) - head->size()));
    if (!head.ok()) return head.status();
  }
  // The parameters and packed forms of them to act and to learn, the optimiser's two columns, the initialisation in
  // double precision, the snapshot; and gradients.
  constexpr std::int64_t kBesides = 9;
  const std::int64_t copies = kBesides + Backpropagation::GradientCopies(*network, minibatch_rows);
  const std::int64_t exploration =
      static_cast<std::int64_t>(SlotExploration::Floats(*head, behaviour.slots) * sizeof(float));
  const std::int64_t parameters = network->parameter_count() + head->log_std_size();
  const std::int64_t learning = exploration + parameters * copies * static_cast<std::int64_t>(sizeof(float)) +
                                Backpropagation::ActivationBytes(*network, minibatch_rows) +
                                HeadGradient::Bytes(*head) * Backpropagation::GradientCopies(*network, minibatch_rows);
  if (learning > options.max_bytes - bytes) {
    return Status{StatusCode::kResourceExhausted,
                  "net_arch makes " + std::to_string(parameters) +
                      " parameters, and learning them takes more memory than is allowed here; choose smaller layers"};
  }
  // Last: its work space is as wide as the head, which the engine chooses; what is too wide has been refused by now.
  Result<HeadGradient> gradient = HeadGradient::Create(*head, behaviour.action_layout.mask_bytes);
  if (!gradient.ok()) return gradient.status();
  return OnPolicyModel{std::move(*network), std::move(*head), std::move(*gradient)};
}

double MeanDeviation(std::span<const float> log_std) {
  double sum = 0.0;
  for (const float value : log_std) sum += std::exp(value);
  return sum / static_cast<double>(log_std.size());
}

double TrainingProgress::Remaining(Generation generation) const {
  if (generation == Generation::kStableBaselines3) return RemainingShare(steps, total_steps);
  const auto total = static_cast<double>(std::max(total_steps, std::int64_t{1}));
  const double planned = std::max(1.0, std::floor(total / static_cast<double>(steps_per_update)));
  return std::max(0.0, 1.0 - static_cast<double>(updates) / planned);
}

}  // namespace consac::learn
