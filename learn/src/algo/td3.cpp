// Twin delayed deep deterministic policy gradient: `td3` as in Stable Baselines3, and with `--preset sb2` as in Stable
// Baselines 2.10.2. From top to bottom: hyperparameters, acting, one gradient step (what is drawn, targets, critics,
// actor), what it tells and keeps. docs/algorithms/td3.md has the equations. Source: Fujimoto et al. 2018,
// arXiv:1802.09477; Stable Baselines 2.10.2 td3/td3.py and Stable Baselines3 td3.py for the rest.
#include <algorithm>

#include "algo/algorithms.h"
#include "algo/continuous_options.h"
#include "collect/action_minibatch.h"
#include "collect/sums.h"
#include "grad/action_gradient.h"

namespace consac::learn {
namespace {

struct Td3Options : ContinuousOptions {
  std::int64_t policy_delay;                      // gradient steps of the critics for one of the actor
  double target_policy_noise, target_noise_clip;  // on the target's actions
};

using W = Td3Options;
using enum ParameterSource;

constexpr off_policy_rows::Row kTd3Rounds[] = {
    off_policy_rows::kLearningRate.WithDefaults("3e-4", "1e-3"), off_policy_rows::kReplay[2].WithDefaults("128", "256"),
    off_policy_rows::kTrainFreq.WithDefaults("100", "1"), off_policy_rows::kRounds[1].WithDefaults("100", "1")};
constexpr ParameterRow<W> kTd3Own[] = {
    {"policy_delay", "policy_delay", Into<W, &W::policy_delay>, "2", "2", 1, 1e9, "",
     "gradient steps of the critics for one of the actor and the targets", kBoth},
    {"target_policy_noise", "target_policy_noise", Into<W, &W::target_policy_noise>, "0.2", "0.2", 0, 1e6, "",
     "deviation of the noise on the target's actions, which go from -1 to 1", kBoth},
    {"target_noise_clip", "target_noise_clip", Into<W, &W::target_noise_clip>, "0.5", "0.5", 0, 1e6, "",
     "that noise is clipped to this", kBoth},
};
constexpr auto kTd3Network = continuous_rows::NetworkRows("[64, 64]", "[400, 300]");
constexpr auto kTd3Rows =
    std::tie(kTd3Rounds, continuous_rows::kCollecting, kTd3Own, continuous_rows::kExploration,
             continuous_rows::kOptimiser, kTd3Network, off_policy_rows::kHer, off_policy_rows::kNormalise);

constexpr const char* kTd3OwnTerms[] = {"loss/qf1_loss", "loss/qf2_loss"};
constexpr auto kTd3Terms = WithFurtherCritics(kTd3OwnTerms);  // critic after critic
constexpr const char* kTd3ActorTerms[] = {"loss/policy_loss"};

/// See learner.h. An update is one gradient step of the critics.
class Td3 final : public Learner {
 public:
  Td3(const LearnerOptions& options, const Td3Options& td3, ContinuousModel model, std::string hyperparameters)
      : td3_(td3),
        hyperparameters_(std::move(hyperparameters)),
        total_steps_(options.total_steps),
        collector_(options.behaviour, std::move(model.head), td3.collect, td3.exploration, options.seed, options.ranks),
        actions_(collector_.action_head().raw_size()),
        learning_rng_(options.seed, StreamId("target_policy_noise")),
        actor_(std::move(model.actor), Rng(options.seed, StreamId("actor")),
               LearnedBy(options, td3, std::max<std::int64_t>(options.behaviour.slots, td3.batch_size)), options.ranks),
        critics_(std::move(model.critics), Rng(options.seed, StreamId("critics")),
                 LearnedBy(options, td3, td3.batch_size), options.ranks),
        action_gradient_(*nn::Network::Create(nn::FirstOutputOf(critics_.network().spec())), actions_, td3.batch_size),
        minibatch_(options.behaviour, {td3.batch_size, td3.n_steps, actions_}, options.ranks),
        next_actions_(static_cast<std::size_t>(td3.batch_size * actions_)),
        targets_(static_cast<std::size_t>(td3.batch_size)),
        losses_(td3.batch_size, options.ranks, TermsInUse(kTwoCritics, td3.n_critics)),
        actor_losses_(td3.batch_size, options.ranks) {
    metrics_.reserve(16);
  }

  // Collecting: collect/continuous_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  // The actor's own actions, with noise.
  void Act(Batch& batch) override {
    collector_.Act(batch, [&](const ReplayCollector::Acting& acting) {
      std::copy_n(actor_.Output(acting.features, batch.rows()), batch.rows() * actions_, acting.raw);
    });
  }
  void Record(const Batch& batch) override {
    if (collector_.Record(batch)) WriteMetrics();
  }

  // Learning: one minibatch after another, as many as the collector says.
  bool LearningDue() const override { return collector_.due() > 0; }
  bool Learn(const LearnBudget& budget) override {
    return collector_.Learn(
        budget.gradient_steps, losses_, [this] { return GradientStepOnDraws(); },
        [this] {
          critics_.FinishRound(updates_);
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
  Status StartFrom(const PolicyData& model) override { return collector_.StartFrom(model, &actor_); }
  Status health() const override {
    CONSAC_RETURN_IF_ERROR(collector_.health());
    return critics_.health().ok() ? actor_.health() : critics_.health();
  }
  PolicyData Snapshot() const override {
    return collector_.Snapshot(actor_, TrainingJson(hyperparameters_, steps(), updates_));
  }
  void Visit(Archive& archive) override {
    collector_.Visit(archive);
    archive("learning_rate", learning_rate_);
    archive("updates", updates_);
    archive("actor", actor_);
    archive("critics", critics_);
    archive("learning_rng", learning_rng_);
    archive("losses", losses_);
    archive("actor_losses", actor_losses_);
  }

 private:
  bool GradientStepOnDraws() {
    if (!minibatch_.Draw(collector_)) return false;
    learning_rate_ = td3_.LearningRateAt(steps(), total_steps_);
    SetTargets();
    StepCritics();
    if (++updates_ % td3_.policy_delay == 0) {
      StepActor();
      actor_.UpdateTarget(td3_.tau);
      critics_.UpdateTarget(td3_.tau);
    }
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    return true;
  }

  // y = r_0 + ... + gamma^(n-1) r_(n-1) + gamma^n min_k Q'_k(s_n, a'), where a' is the target actor's action with
  // clipped noise, within -1 and 1. Nothing follows a terminal state.
  void SetTargets() {
    const float* inputs[] = {minibatch_.next_features().data(), next_actions_.data()};
    const float* chosen = actor_.TargetOutput(inputs[0], minibatch_.size());
    const auto clip = static_cast<float>(td3_.target_noise_clip),
               deviation = static_cast<float>(td3_.target_policy_noise);
    for (std::size_t i = 0; i < next_actions_.size(); ++i) {
      const float noise = deviation > 0.0f ? std::clamp(deviation * learning_rng_.Normal(), -clip, clip) : 0.0f;
      next_actions_[i] = std::clamp(chosen[i] + noise, -1.0f, 1.0f);
    }
    critics_.Target().Forward(inputs, minibatch_.size());
    for (std::size_t i = 0; i < targets_.size(); ++i)
      targets_[i] = minibatch_.rewards()[i] +
                    static_cast<float>(minibatch_.discounts()[i]) * LeastValue(critics_.Target(), td3_.n_critics, i);
  }

  // L = sum_k mean (Q_k(s, a) - y)^2.
  void StepCritics() {
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    LossOf loss([this](const LossBlock& block) { minibatch_.Gather(block, minibatch_.actions()); },
                [this, inverse](const LossBlock& block) {
                  Sums<kTd3Terms>& sums = losses_.block(block.index) = {};
                  for (std::size_t k = 0; k < block.outputs.size(); ++k) {
                    for (std::int64_t r = 0; r < block.rows; ++r) {
                      const float error = block.outputs[k][r] - targets_[static_cast<std::size_t>(block.first_row + r)];
                      sums[k] += static_cast<double>(error) * static_cast<double>(error);
                      block.output_gradients[k][r] = 2.0f * error * inverse;
                    }
                  }
                });
    critics_.Step(critics_.Gradient(minibatch_.size(), loss), learning_rate_);
  }

  // L = -mean Q_1(s, mu(s)): first dL/da through the critic, held fast, then through the actor.
  void StepActor() {
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    const std::span<const float> chosen(actor_.Output(minibatch_.features().data(), minibatch_.size()),
                                        next_actions_.size());
    if (losses_.minibatches() < td3_.policy_delay) actor_losses_.BeginUpdate();  // the first of the round
    action_gradient_.Run(
        critics_.parameters(), minibatch_.size(), critics_.executor(),
        [this, chosen](const LossBlock& block) { minibatch_.Gather(block, chosen); },
        [this, inverse](const LossBlock& block) {
          Sums<kTd3ActorTerms>& sums = actor_losses_.block(block.index) = {};
          for (std::int64_t r = 0; r < block.rows; ++r) sums[0] -= static_cast<double>(block.outputs[0][r]);
          std::fill_n(block.output_gradients[0], block.rows, -inverse);
        });
    LossOf loss([this](const LossBlock& block) { minibatch_.Gather(block); },
                [this](const LossBlock& block) { action_gradient_.Backward(block); });
    actor_.Step(actor_.Gradient(minibatch_.size(), loss), learning_rate_);
    actor_losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
  }

  // Source: Stable Baselines 2.10.2, td3/td3.py, and Stable Baselines3, td3.py.
  void WriteMetrics() {
    BeginMetrics(td3_, collector_.episodes(), {learning_rate_, updates_}, &metrics_);
    if (updates_ == 0) return;
    const Sums<kTd3Terms> means = losses_.UpdateMeans();
    const bool sb2 = td3_.log_keys == Generation::kStableBaselines2;
    double critic_loss = 0.0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(td3_.n_critics); ++k) {
      critic_loss += means[k];
      if (sb2) metrics_.push_back(LossMetric(kTd3Terms[k], means[k]));
    }
    if (!sb2) metrics_.push_back({"train/critic_loss", "train/critic_loss", critic_loss});
    if (actor_losses_.minibatches() == 0) return;
    const double actor_loss = actor_losses_.UpdateMeans()[0];
    metrics_.push_back(sb2 ? Metric{"", kTd3ActorTerms[0], actor_loss}
                           : Metric{"train/actor_loss", "train/actor_loss", actor_loss});
  }

  const Td3Options td3_;
  const std::string hyperparameters_;  // JSON, for the model file
  std::int64_t total_steps_;
  ContinuousCollector collector_;
  const std::int64_t actions_;  // numbers of one
  Rng learning_rng_;
  LearnedNetwork actor_, critics_;
  ActionGradient action_gradient_;  // dL/da by the first critic
  ActionMinibatch minibatch_;
  std::vector<float> next_actions_;       // [B, actions] a'
  std::vector<float> targets_;            // [B] y
  LossLog<kTd3Terms> losses_;             // of the round under way, or the latest
  LossLog<kTd3ActorTerms> actor_losses_;  // of the latest round in which the actor learned
  float learning_rate_ = 0;               // of the latest update
  std::int64_t updates_ = 0;
  std::vector<Metric> metrics_;
};

}  // namespace

std::span<const Hyperparameter> Td3Table() {
  static const std::vector<Hyperparameter> table =
      TableOf(kTd3Rows, Generation::kStableBaselines3, {"Stable Baselines 2.10.2, TD3", "Stable Baselines3, TD3"});
  return table;
}

Result<std::unique_ptr<Learner>> CreateTd3(const LearnerOptions& options, const HyperparameterSet& values) {
  Td3Options td3{};
  CONSAC_RETURN_IF_ERROR(ReadOffPolicyRows(kTd3Rows, values, options, &td3));
  Result<ContinuousModel> model = MakeContinuousModel(options, td3, {.algorithm = "td3"});
  if (!model.ok()) return model.status();
  return std::unique_ptr<Learner>(std::make_unique<Td3>(options, td3, std::move(*model), HyperparametersJson(values)));
}

}  // namespace consac::learn
