// Deep deterministic policy gradient: `ddpg` as in Stable Baselines3, and with `--preset sb2` as in Stable
// Baselines 2.10.2 (two step sizes, the action behind the critic's first layer, adaptive parameter noise, a penalty on
// the critic's weights). From top to bottom: hyperparameters, acting, one gradient step (what is drawn, targets,
// critic, actor), what it tells and keeps. docs/algorithms/ddpg.md has the equations. Source: Lillicrap et al. 2016,
// arXiv:1509.02971; Plappert et al. 2018, arXiv:1706.01905 (parameter noise); Stable Baselines 2.10.2 ddpg/ddpg.py and
// Stable Baselines3 ddpg.py for the rest.
#include <algorithm>
#include <cmath>

#include "algo/adaptive_noise_rows.h"
#include "algo/algorithms.h"
#include "algo/continuous_options.h"
#include "collect/action_minibatch.h"
#include "collect/pop_art.h"
#include "collect/sums.h"
#include "grad/action_gradient.h"
#include "optim/weight_penalty.h"

namespace consac::learn {
namespace {

/// Which critic an actor learns by: that of before the critic's step (2.10.2), or of after (Stable Baselines3).
enum class ActorStep : std::uint8_t { kBeforeCritic, kAfterCritic };

struct DdpgOptions : ContinuousOptions {
  Schedule actor_lr;                   // absent: the critic's
  double clip_norm;                    // of each tensor's gradient; 0: none
  double critic_l2_reg, reward_scale;  // 2.10.2's
  bool normalize_returns, enable_popart;
  ActorStep actor_step;
  std::int64_t action_layer;          // hidden layers of the critic that read the observation alone
  double output_bound, return_range;  // of initial outputs; of what the critic says and learns; 0: as they are
  AdaptiveNoiseOptions noise;         // 2.10.2's
};

using G = DdpgOptions;
using enum ParameterSource;

constexpr auto kDdpgCollecting = continuous_rows::CollectingRows("0", "0.001");
constexpr off_policy_rows::Row kDdpgBatch[] = {off_policy_rows::kReplay[2].WithDefaults("128", "256")};
constexpr ParameterRow<G> kDdpgOwn[] = {
    {"critic_lr", "learning_rate", Into<G, &G::learning_rate>, "1e-3", "1e-3", 0, kUnlimited, "",
     "step size of the critic", kBoth},
    {"actor_lr", "actor_lr", Into<G, &G::actor_lr>, "1e-4", "none", 0, kUnlimited, "none",
     "step size of the actor; none: the critic's", kSb2},
    {"nb_rollout_steps", "train_freq", Into<G, &G::collect, &ReplayCollectorOptions::train_freq>, "100", "1", 1, 1e9,
     "", "steps of each agent, or episodes, between rounds of learning", kBoth},
    {"nb_train_steps", "gradient_steps", Into<G, &G::collect, &ReplayCollectorOptions::gradient_steps>, "50", "1", -1,
     1e9, "", "of each round; -1: one for every transition since the last", kBoth},
    {"clip_norm", "clip_norm", Into<G, &G::clip_norm>, "none", "none", 0, kUnlimited, "none",
     "the norm of each tensor's gradient is clipped to this", kSb2},
    {"critic_l2_reg", "critic_l2_reg", Into<G, &G::critic_l2_reg>, "0", "0", 0, kUnlimited, "",
     "weight of half the squares of the critic's hidden weights", kSb2},
    {"reward_scale", "reward_scale", Into<G, &G::reward_scale>, "1", "1", 0, kUnlimited, "", "factor of rewards", kSb2},
    {"normalize_returns", "normalize_returns", Into<G, &G::normalize_returns>, "false", "false", 0, 0, "",
     "the critic learns values by their running moments; with enable_popart", kSb2},
    {"enable_popart", "enable_popart", Into<G, &G::enable_popart>, "false", "false", 0, 0, "",
     "those are followed, and the critic's last layer with them", kSb2},
    {"return_range", "return_range", Into<G, &G::return_range>, "none", "none", 0, kUnlimited, "none",
     "what the critic says and learns is clipped to plus and minus this", kSb2},
    {"actor_step", "actor_step", Into<G, &G::actor_step>, "before_critic", "after_critic", 0, 0,
     "before_critic|after_critic", "the actor learns by the critic of before its step (SB2), or of after (SB3)",
     kConsac},
    {"action_layer", "action_layer", Into<G, &G::action_layer>, "1", "0", 0, 64, "",
     "hidden layers of the critic that read the observation alone", kConsac},
    {"output_bound", "output_bound", Into<G, &G::output_bound>, "3e-3", "none", 0, 1e6, "none",
     "initial outputs have weights within this; none: as the rest", kConsac},
};
constexpr auto& kDdpgVecNormalise = off_policy_rows::kNormalise;
constexpr off_policy_rows::Row kDdpgNormalise[] = {
    kDdpgVecNormalise[0].WithSb2Name("normalize_observations"), kDdpgVecNormalise[1],
    kDdpgVecNormalise[2].WithSb2Name("observation_range").WithDefaults("5", "10"), kDdpgVecNormalise[3],
    kDdpgVecNormalise[4]};
constexpr auto kDdpgNetwork = continuous_rows::NetworkRows("[64, 64]", "[400, 300]", "1");
constexpr auto kDdpgRows =
    std::tie(kDdpgCollecting, kDdpgBatch, kDdpgOwn, kAdaptiveNoiseRows<G, &G::noise>, continuous_rows::kExploration,
             continuous_rows::kOptimiser, kDdpgNetwork, off_policy_rows::kHer, kDdpgNormalise);

constexpr const char* kDdpgTerms[] = {"critic_loss", "actor_loss"};
enum DdpgTerm { kDdpgCritic, kDdpgActor };
constexpr const char* kDdpgCriticHead = "/head";  // the layer of each critic that says Q

/// See learner.h. An update is one gradient step of actor and critic.
class Ddpg final : public Learner {
 public:
  Ddpg(const LearnerOptions& options, const DdpgOptions& ddpg, ContinuousModel model, std::string hyperparameters)
      : ddpg_(ddpg),
        hyperparameters_(std::move(hyperparameters)),
        total_steps_(options.total_steps),
        collector_(options.behaviour, std::move(model.head), ddpg.collect, ddpg.exploration, options.seed,
                   options.ranks),
        actions_(collector_.action_head().raw_size()),
        return_range_(ddpg.return_range > 0.0 ? static_cast<float>(ddpg.return_range) : HUGE_VALF),
        actor_(std::move(model.actor), Rng(options.seed, StreamId("actor")),
               Learned(options, ddpg, std::max<std::int64_t>(options.behaviour.slots, ddpg.batch_size)), options.ranks),
        critic_(std::move(model.critics), Rng(options.seed, StreamId("critics")),
                Learned(options, ddpg, ddpg.batch_size), options.ranks),
        noise_(ddpg.noise, &actor_, options.seed, options.ranks),
        action_gradient_(*nn::Network::Create(nn::FirstOutputOf(critic_.network().spec())), actions_, ddpg.batch_size,
                         ddpg.n_critics == 1 ? critic_.packed() : nullptr),
        minibatch_(options.behaviour, {ddpg.batch_size, ddpg.n_steps, actions_}, options.ranks),
        penalty_(critic_.network(), kDdpgCriticHead, ddpg.critic_l2_reg / static_cast<double>(options.ranks.size)),
        pop_art_(&critic_, kDdpgCriticHead, options.ranks),
        targets_(static_cast<std::size_t>(ddpg.batch_size)),
        losses_(ddpg.batch_size, options.ranks) {
    metrics_.reserve(16);
  }

  // Collecting: collect/continuous_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  // The actor's own actions, or those of a disturbed copy, with noise.
  void Act(Batch& batch) override {
    collector_.Act(batch, [&](const ReplayCollector::Acting& acting) {
      std::copy_n(noise_.Output(acting.features, batch.rows()), batch.rows() * actions_, acting.raw);
    });
  }
  // Parameter noise lasts as long as an episode of each agent.
  void Record(const Batch& batch) override {
    const std::int64_t noises = collector_.episodes_each();
    if (collector_.Record(batch)) WriteMetrics();
    if (collector_.episodes_each() != noises) noise_.Perturb();
  }

  // Learning: one minibatch after another, as many as the collector says.
  bool LearningDue() const override { return collector_.due() > 0; }
  bool Learn(const LearnBudget& budget) override {
    return collector_.Learn(
        budget.gradient_steps, losses_, [this] { return GradientStepOnDraws(); },
        [this] {
          critic_.FinishRound(updates_);
          actor_.FinishRound(updates_);
        });
  }

  std::int64_t steps() const override { return collector_.steps(); }
  std::int64_t updates() const override { return updates_; }
  std::int64_t reports() const override { return collector_.reports(); }
  std::int64_t steps_per_update() const override { return 0; }
  std::int64_t memory_bytes() const override { return collector_.memory_bytes(); }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  Status StartFrom(const PolicyData& model) override {
    CONSAC_RETURN_IF_ERROR(collector_.StartFrom(model, &actor_));
    noise_.Perturb();
    return Status::Ok();
  }
  Status health() const override {
    CONSAC_RETURN_IF_ERROR(collector_.health());
    return critic_.health().ok() ? actor_.health() : critic_.health();
  }
  PolicyData Snapshot() const override {
    return collector_.Snapshot(actor_, TrainingJson(hyperparameters_, steps(), updates_));
  }
  void Visit(Archive& archive) override {
    collector_.Visit(archive);
    archive("learning_rate", learning_rate_);
    archive("updates", updates_);
    archive("actor", actor_);
    archive("critic", critic_);
    noise_.Visit(archive);
    losses_.Visit(archive);
    archive("pop_art", pop_art_);
  }

 private:
  static LearnedNetworkOptions Learned(const LearnerOptions& options, const DdpgOptions& ddpg, std::int64_t run_rows) {
    LearnedNetworkOptions learned = LearnedBy(options, ddpg, run_rows);
    learned.max_grad_norm = ddpg.clip_norm;
    learned.clip_each = true;
    return learned;
  }

  bool GradientStepOnDraws() {
    if (!minibatch_.Draw(collector_)) return false;
    losses_.BeginMinibatch();
    learning_rate_ = ddpg_.LearningRateAt(steps(), total_steps_);
    SetTargets();
    if (ddpg_.actor_step == ActorStep::kBeforeCritic) StepActor();
    StepCritic();
    if (ddpg_.actor_step == ActorStep::kAfterCritic) StepActor();
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    actor_.UpdateTarget(ddpg_.tau);
    critic_.UpdateTarget(ddpg_.tau);
    noise_.AfterStep(++updates_, minibatch_.features().data(), minibatch_.size());
    return true;
  }

  // y = r_0 + ... + gamma^(n-1) r_(n-1) + gamma^n min_k Q'_k(s_n, mu'(s_n)). Nothing follows a terminal state. With
  // Pop-Art both are values that the critics' outputs mean.
  void SetTargets() {
    const float* seen = minibatch_.next_features().data();
    const float* inputs[] = {seen, actor_.TargetOutput(seen, minibatch_.size())};
    critic_.Target().Forward(inputs, minibatch_.size());
    for (std::size_t i = 0; i < targets_.size(); ++i)
      targets_[i] = static_cast<float>(ddpg_.reward_scale * static_cast<double>(minibatch_.rewards()[i]) +
                                       minibatch_.discounts()[i] *
                                           pop_art_.Value(LeastValue(critic_.Target(), ddpg_.n_critics, i)));
    if (ddpg_.normalize_returns && ddpg_.enable_popart) pop_art_.Take(targets_);
    for (float& target : targets_)
      target = std::clamp(static_cast<float>(pop_art_.Output(target)), -return_range_, return_range_);
  }

  // L = sum_k mean (Q_k(s, a) - y)^2 + critic_l2_reg / 2 sum w^2, over the weights of hidden layers.
  void StepCritic() {
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    LossOf loss([this](const LossBlock& block) { minibatch_.Gather(block, minibatch_.actions()); },
                [this, inverse](const LossBlock& block) {
                  double& sum = losses_.block(block.index)[kDdpgCritic];
                  for (std::size_t k = 0; k < block.outputs.size(); ++k) {
                    for (std::int64_t r = 0; r < block.rows; ++r) {
                      const float error = block.outputs[k][r] - targets_[static_cast<std::size_t>(block.first_row + r)];
                      sum += static_cast<double>(error) * static_cast<double>(error);
                      block.output_gradients[k][r] = 2.0f * error * inverse;
                    }
                  }
                });
    const std::span<float> gradient = critic_.Gradient(minibatch_.size(), loss);
    penalty_.AddGradient(critic_.parameters(), gradient);
    critic_.Step(gradient, learning_rate_);
  }

  // L = -mean Q_1(s, mu(s)): first dL/da through the first critic, held fast, then through the actor.
  void StepActor() {
    const auto slope = static_cast<float>(-pop_art_.deviation() / static_cast<double>(minibatch_.total()));
    const std::span<const float> chosen(actor_.Output(minibatch_.features().data(), minibatch_.size()),
                                        minibatch_.actions().size());
    action_gradient_.Run(
        critic_.Loaded(), minibatch_.size(), critic_.executor(),
        [this, chosen](const LossBlock& block) { minibatch_.Gather(block, chosen); },
        [this, slope](const LossBlock& block) {
          double& sum = losses_.block(block.index)[kDdpgActor];
          for (std::int64_t r = 0; r < block.rows; ++r) {
            const float said = block.outputs[0][r];
            sum -= pop_art_.Value(std::clamp(said, -return_range_, return_range_));
            block.output_gradients[0][r] = std::fabs(said) > return_range_ ? 0.0f : slope;
          }
        });
    LossOf loss([this](const LossBlock& block) { minibatch_.Gather(block); },
                [this](const LossBlock& block) { action_gradient_.Backward(block); });
    const float rate = ddpg_.actor_lr.absent ? learning_rate_ : RateAt(ddpg_.actor_lr, steps(), total_steps_);
    actor_.Step(actor_.Gradient(minibatch_.size(), loss), rate);
  }

  // Source: Stable Baselines 2.10.2, ddpg/ddpg.py, and Stable Baselines3, td3.py.
  void WriteMetrics() {
    const auto put = [this](std::string_view key, std::string_view tag, double number) {
      metrics_.push_back({key, tag, number});
    };
    const Sums<kDdpgTerms> means = updates_ > 0 ? losses_.UpdateMeans() : Sums<kDdpgTerms>();
    if (ddpg_.log_keys == Generation::kStableBaselines3) {
      BeginMetrics(ddpg_, collector_.episodes(), {learning_rate_, updates_}, &metrics_);
      if (updates_ == 0) return;
      put("train/actor_loss", "train/actor_loss", means[kDdpgActor]);
      return put("train/critic_loss", "train/critic_loss", means[kDdpgCritic]);
    }
    metrics_.clear();
    put("rollout/episodes", "", static_cast<double>(collector_.episodes().count()));
    put("rollout/return_history", "", collector_.episodes().mean());
    if (updates_ == 0) return;
    put("train/loss_actor", "Adam_mpi/actor_loss", means[kDdpgActor]);
    put("train/loss_critic", "Adam_mpi/critic_loss", means[kDdpgCritic]);
    if (!noise_.on()) return;
    put("train/param_noise_distance", "", noise_.distance());
    put("param_noise_stddev", "input_info/param_noise_stddev", noise_.deviation());
  }

  const DdpgOptions ddpg_;
  const std::string hyperparameters_;  // JSON, for the model file
  std::int64_t total_steps_;
  ContinuousCollector collector_;
  const std::int64_t actions_;  // numbers of one
  const float return_range_;
  LearnedNetwork actor_, critic_;
  AdaptiveNoise noise_;
  ActionGradient action_gradient_;  // dL/da by the first critic
  ActionMinibatch minibatch_;
  WeightPenalty penalty_;
  PopArt pop_art_;
  std::vector<float> targets_;  // [B] y
  LossLog<kDdpgTerms> losses_;  // of the round under way, or the latest
  float learning_rate_ = 0;     // of the latest update
  std::int64_t updates_ = 0;
  std::vector<Metric> metrics_;
};

}  // namespace

std::span<const Hyperparameter> DdpgTable() {
  static const std::vector<Hyperparameter> table =
      TableOf(kDdpgRows, Generation::kStableBaselines3, {"Stable Baselines 2.10.2, DDPG", "Stable Baselines3, DDPG"});
  return table;
}

Result<std::unique_ptr<Learner>> CreateDdpg(const LearnerOptions& options, const HyperparameterSet& values) {
  DdpgOptions ddpg{};
  CONSAC_RETURN_IF_ERROR(ReadOffPolicyRows(kDdpgRows, values, options, &ddpg));
  const ContinuousWants wants = {.algorithm = "ddpg",
                                 .action_layer = ddpg.action_layer,
                                 .output_bound = ddpg.output_bound,
                                 .parameter_noise = ddpg.noise.on};
  Result<ContinuousModel> model = MakeContinuousModel(options, ddpg, wants);
  if (!model.ok()) return model.status();
  return std::unique_ptr<Learner>(
      std::make_unique<Ddpg>(options, ddpg, std::move(*model), HyperparametersJson(values)));
}

}  // namespace consac::learn
