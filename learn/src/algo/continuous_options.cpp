#include "algo/continuous_options.h"

#include <algorithm>

#include "consac/base/text.h"

namespace consac::learn {
namespace {

// Stable Baselines 2.10.2: convolutions that start orthogonal where the rest is Glorot's.
constexpr float kOrthogonalGain = 1.41421356f;

Status CheckActions(const BehaviourSpec& behaviour, const ContinuousWants& wants) {
  for (const Leaf& leaf : behaviour.action_layout.leaves) {
    if (FindDistribution(wants.head)->fits(leaf)) continue;
    return Status{
        StatusCode::kInvalidArgument,
        std::string(wants.algorithm) +
            " learns numbers between finite bounds (a one-dimensional float32 Box), and the actions of " +
            Quote(behaviour.name) + " are " + leaf.space.ToString() +
            (leaf.name.empty() ? "" : " at " + Quote(leaf.name)) + "; choose " +
            (leaf.space.kind() == SpaceKind::kBox ? "ppo, or give it float32 and bounds" : "dqn, ppo or a2c")};
  }
  return Status::Ok();
}

/// With `features` numbers of the actor's last hidden layer, where the distribution follows the state.
Result<ActionHead> HeadOf(const BehaviourSpec& behaviour, const ContinuousWants& wants, std::int64_t features) {
  std::vector<HeadSpec> heads;
  for (const Leaf& leaf : behaviour.action_layout.leaves) {
    heads.push_back({leaf.name, wants.head, wants.noise});
    heads.back().noise.features = features;
  }
  return ActionHead::Create(behaviour.action_layout, heads);
}

/// Each step leaves (1 - theta dt) of what was there.
Status CheckNoise(const ActionNoiseOptions& noise) {
  const double drawn_back = noise.theta * noise.dt;
  if (noise.kind != ActionNoiseKind::kOrnsteinUhlenbeck || drawn_back < 2.0) return Status::Ok();
  return {StatusCode::kInvalidArgument, "noise_theta " + NumberText(noise.theta) + " times noise_dt " +
                                            NumberText(noise.dt) + " is " + NumberText(drawn_back) +
                                            ", and from 2 on Ornstein-Uhlenbeck noise grows without bound; lower one"};
}

Result<nn::Network> Checked(Result<nn::NetworkSpec> spec) {
  if (!spec.ok()) return spec.status();
  Result<nn::Network> network = nn::Network::Create(std::move(*spec));
  if (!network.ok()) return network.status();
  if (const Status acts = CheckActivations(*network); !acts.ok())  // or what was learned could not be loaded
    return Status{StatusCode::kInvalidArgument, acts.message()};
  return network;
}

}  // namespace

Result<ContinuousModel> MakeContinuousModel(const LearnerOptions& options, const ContinuousOptions& own,
                                            const ContinuousWants& wants) {
  const BehaviourSpec& behaviour = options.behaviour;
  CONSAC_RETURN_IF_ERROR(CheckNoise(own.exploration.noise));
  CONSAC_RETURN_IF_ERROR(CheckActions(behaviour, wants));
  const bool follows_state = FindDistribution(wants.head)->follows_state;
  std::int64_t outputs = 0, elements = 0;
  for (const Leaf& leaf : behaviour.action_layout.leaves) {
    outputs += FindDistribution(wants.head)->head_size(leaf);
    elements += leaf.count;
  }
  const nn::NetArch arch = own.net_arch.value_or(nn::NetArch{{256, 256}, {}, {}});
  const bool towers = !arch.pi.empty() || !arch.vf.empty();
  if (towers && !arch.shared.empty()) {
    return Status{StatusCode::kInvalidArgument, "net_arch " + nn::ToString(arch) +
                                                    " has shared layers, and actor and critics share none; give a "
                                                    "list of widths, as [256, 256], or dict(pi=[...], qf=[...])"};
  }
  Result<ObservationEntry> entry = EntryOf(own.policy, behaviour, own.collect.normalise.norm_obs);
  if (!entry.ok()) return entry.status();
  if (own.tower.init == nn::Init::kXavierUniform) {
    entry->features.init = nn::Init::kOrthogonal;
    entry->features.gain = kOrthogonalGain;
  }
  nn::TowerOptions tower = own.tower;
  tower.layer_norm = tower.layer_norm || own.policy == PolicyKind::kLnMlp || own.policy == PolicyKind::kLnCnn;
  tower.output_bound = wants.output_bound;
  nn::ActorOptions actor{.tower = tower, .outputs = outputs};
  actor.tower.layers = towers ? arch.pi : arch.shared;
  actor.groups = outputs / elements;
  actor.with_features = follows_state;
  if (std::string_view(wants.head) == "deterministic") actor.output = nn::Activation::kTanh;
  Result<nn::Network> acts = Checked(nn::Actor(behaviour.observation_layout, actor, entry->features));
  if (!acts.ok()) return acts.status();
  Result<ActionHead> head = HeadOf(behaviour, wants, acts->output_size(0) - outputs);
  if (!head.ok()) return head.status();
  nn::CriticsOptions critics{.tower = tower, .action_size = elements, .count = own.n_critics};
  critics.tower.layers = towers ? arch.vf : arch.shared;
  critics.action_layer = wants.action_layer;
  critics.state_value = wants.state_value;
  Result<nn::Network> values = Checked(nn::Critics(behaviour.observation_layout, critics, entry->features));
  if (!values.ok()) return values.status();
  // Parameters and targets, each packed, packed forms to learn by (the critics' twice), the optimiser's two columns,
  // initialisation in double precision, the snapshot; with noise two more, each packed; and gradients, twice those of
  // the critics.
  const std::int64_t copies =
      14 + (wants.parameter_noise ? 4 : 0) + 2 * Backpropagation::GradientCopies(*values, own.batch_size);
  const std::int64_t parameters = acts->parameter_count() + values->parameter_count();
  const std::int64_t exploration =
      static_cast<std::int64_t>(SlotExploration::Floats(*head, behaviour.slots) * sizeof(float));
  const std::int64_t activations = Backpropagation::ActivationBytes(*acts, own.batch_size) +
                                   2 * Backpropagation::ActivationBytes(*values, own.batch_size) + exploration;
  CONSAC_RETURN_IF_ERROR(CheckOffPolicyMemory(options, own, {head->raw_size(), parameters, copies, activations}));
  return ContinuousModel{std::move(*head), std::move(*acts), std::move(*values)};
}

// Source: Stable Baselines 2.10.2, sac/sac.py and td3/td3.py, and Stable Baselines3, off_policy_algorithm.py.
void BeginMetrics(const ContinuousOptions& own, const EpisodeWindow& episodes, const ContinuousReport& report,
                  std::vector<Metric>* metrics) {
  const auto count = static_cast<double>(episodes.count());
  if (own.log_keys == Generation::kStableBaselines2) {
    *metrics = {{"episodes", "", count}, {"mean 100 episode reward", "", episodes.mean()}};
    if (report.updates > 0) metrics->push_back({"current_lr", "loss/learning_rate", report.learning_rate});
    return;
  }
  *metrics = {{"time/episodes", "time/episodes", count}};
  if (report.updates == 0) return;
  metrics->push_back({"train/learning_rate", "train/learning_rate", report.learning_rate});
  metrics->push_back({"train/n_updates", "train/n_updates", static_cast<double>(report.updates)});
}

Metric LossMetric(std::string_view tag, double value) {
  return {tag.substr(std::string_view("loss/").size()), tag, value};
}

}  // namespace consac::learn
