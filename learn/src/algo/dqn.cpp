// Deep Q-learning: `dqn` as in Stable Baselines3, and with `--preset sb2` as in Stable Baselines 2.10.2 (double,
// prioritised, parameter noise). From top to bottom: hyperparameters, choosing actions, one gradient step (what is
// drawn, its targets, the loss), what it tells and keeps. docs/algorithms/dqn.md has the equations. Source: Mnih et al.
// 2015, Nature 518; van Hasselt et al. 2016, arXiv:1509.06461 (double); Stable Baselines 2.10.2 deepq/dqn.py and Stable
// Baselines3 dqn.py for the rest.
#include <algorithm>
#include <cmath>
#include <optional>

#include "algo/algorithms.h"
#include "algo/progress.h"
#include "algo/q_options.h"
#include "collect/parameter_noise.h"
#include "collect/replay_minibatch.h"
#include "collect/sums.h"

namespace consac::learn {
namespace {

enum class GradientClip : std::uint8_t { kVariable, kGlobal };
enum class WarmUp : std::uint8_t { kRandom, kEpsilonGreedy };

struct DqnOptions : QOptions {
  WarmUp warm_up;              // before learning_starts
  double max_grad_norm;        // 0: none
  GradientClip clip;           // of what the norm is taken
  AdamOptions adam;            // its form too
  bool double_q, param_noise;  // 2.10.2's
};

using D = DqnOptions;
using enum ParameterSource;

constexpr off_policy_rows::Row kDqnSteps[] = {off_policy_rows::kGamma, off_policy_rows::kLearningRate};
constexpr off_policy_rows::Row kDqnRounds[] = {off_policy_rows::kTrainFreq, off_policy_rows::kTau,
                                               off_policy_rows::kLogKeys, off_policy_rows::kTruncation};
constexpr ParameterRow<D> kDqnOwn[] = {
    {"warm_up", "warm_up", Into<D, &D::warm_up>, "epsilon_greedy", "random", 0, 0, "random|epsilon_greedy",
     "how it acts before learning_starts", kConsac},
    {"target_network_update_freq", "target_update_interval", Into<D, &D::target_update_interval>, "500", "10000", 1,
     1e9, "", "agent steps between updates of the target network", kBoth},
    {"max_grad_norm", "max_grad_norm", Into<D, &D::max_grad_norm>, "10", "10", 0, kUnlimited, "none",
     "gradient norms are clipped to this", kSb3},
    {"grad_clip", "grad_clip", Into<D, &D::clip>, "variable", "global", 0, 0, "variable|global",
     "the norm of each tensor's gradient (SB2), or of the whole (SB3)", kConsac},
    {"optimizer", "optimizer", Into<D, &D::adam, &AdamOptions::form>, "tensorflow", "pytorch", 0, 0,
     "tensorflow|pytorch", "whose form of Adam and of the global clip", kConsac},
    {"adam_epsilon", "adam_epsilon", Into<D, &D::adam, &AdamOptions::epsilon>, "1e-8", "1e-8", 0, 1, "",
     "Adam's epsilon", kConsac},
    {"double_q", "double_q", Into<D, &D::double_q>, "true", "false", 0, 0, "", "the network chooses, its target judges",
     kSb2},
    {"param_noise", "param_noise", Into<D, &D::param_noise>, "false", "false", 0, 0, "",
     "explore by noise in the parameters, as strong as epsilon would be", kSb2},
};
constexpr auto kDqnRows = std::tie(kDqnSteps, q_rows::kExploration, off_policy_rows::kReplay, kDqnRounds,
                                   off_policy_rows::kRounds, off_policy_rows::kPrioritized, kDqnOwn, q_rows::kNetwork,
                                   off_policy_rows::kHer, off_policy_rows::kNormalise);

constexpr const char* kDqnTerms[] = {"td_error", "loss", "reward", "weight"};
enum DqnTerm { kDqnError, kDqnLoss, kDqnReward, kDqnWeight };
using DqnSums = Sums<kDqnTerms>;

/// See learner.h. An update is one gradient step.
class Dqn final : public Learner, private BlockLoss {
 public:
  Dqn(const LearnerOptions& options, const DqnOptions& dqn, QModel model, std::string hyperparameters)
      : dqn_(dqn),
        hyperparameters_(std::move(hyperparameters)),
        total_steps_(options.total_steps),
        collector_(options.behaviour, std::move(model.head), dqn.collect, options.seed, options.ranks),
        choices_(collector_.action_head().size()),
        q_(std::move(model.network), Rng(options.seed, StreamId("network_initialisation")),
           {.run_rows = std::max<std::int64_t>(options.behaviour.slots, dqn.batch_size),
            .batch_rows = dqn.batch_size,
            .adam = dqn.adam,
            .max_grad_norm = dqn.max_grad_norm,
            .clip_each = dqn.clip == GradientClip::kVariable,
            .executor = options.executor},
           options.ranks),
        explorer_(choices_, options.seed),
        minibatch_(options.behaviour, dqn.batch_size, dqn.n_steps, options.ranks),
        targets_(static_cast<std::size_t>(dqn.batch_size)),
        losses_(dqn.batch_size, options.ranks) {
    metrics_.reserve(16);
    if (!dqn.param_noise) return;
    noise_.emplace(q_.network(), options.seed, options.behaviour.slots);
    noise_->Perturb(q_.parameters());
  }

  // Collecting: collect/replay_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  void Act(Batch& batch) override {
    const ReplayCollector::Acting acting = collector_.BeginAct(batch);
    const std::int64_t rows = batch.rows();
    const bool random = collector_.warming_up() && dqn_.warm_up == WarmUp::kRandom;
    const float* values = q_.Output(acting.features, rows);
    if (noise_) {
      noise_->Adapt(q_.parameters(), acting.features, values, rows, Epsilon());
      values = noise_->Values(acting.features, rows);
    }
    explorer_.Choose(values, batch.action_masks, rows, random ? 1.0 : noise_ ? 0.0 : Epsilon(), acting.raw);
    collector_.FinishAct(batch);
  }

  // The target network follows the steps of all agents; noise lasts as long as an episode of each.
  void Record(const Batch& batch) override {
    const std::int64_t targets = steps() / dqn_.target_update_interval, noises = collector_.episodes_each();
    if (collector_.Record(batch)) WriteMetrics();
    if (steps() / dqn_.target_update_interval != targets) q_.UpdateTarget(dqn_.tau);
    if (noise_ && collector_.episodes_each() != noises) noise_->Perturb(q_.parameters());
  }

  // Learning: one minibatch after another, as many as the collector says.
  bool LearningDue() const override { return collector_.due() > 0; }
  bool Learn(const LearnBudget& budget) override {
    return collector_.Learn(
        budget.gradient_steps, losses_, [this] { return GradientStepOnDraws(); }, [this] { q_.FinishRound(updates_); });
  }

  std::int64_t steps() const override { return collector_.steps(); }
  std::int64_t updates() const override { return updates_; }
  std::int64_t reports() const override { return collector_.reports(); }
  std::int64_t steps_per_update() const override { return 0; }
  std::int64_t memory_bytes() const override { return collector_.memory_bytes(); }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  Status StartFrom(const PolicyData& model) override {
    CONSAC_RETURN_IF_ERROR(collector_.StartFrom(model, &q_));
    if (noise_) noise_->Perturb(q_.parameters());
    return Status::Ok();
  }
  Status health() const override { return q_.health().ok() ? collector_.health() : q_.health(); }
  PolicyData Snapshot() const override {
    return collector_.Snapshot(q_, TrainingJson(hyperparameters_, steps(), updates_));
  }
  void Visit(Archive& archive) override {
    collector_.Visit(archive);
    archive("learning_rate", learning_rate_);
    archive("updates", updates_);
    q_.Visit(archive);
    explorer_.Visit(archive);
    if (noise_) archive("parameter_noise", *noise_);
    losses_.Visit(archive);
  }

 private:
  double Epsilon() const { return dqn_.exploration.At(ElapsedShare(steps(), total_steps_)); }

  bool GradientStepOnDraws() {
    if (!minibatch_.Draw(collector_, dqn_.BetaAt(steps(), total_steps_))) return false;
    SetTargets();
    learning_rate_ = dqn_.LearningRateAt(steps(), total_steps_);
    q_.Step(q_.Gradient(minibatch_.size(), *this), learning_rate_);
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    minibatch_.SetPriorities();
    ++updates_;
    return true;
  }

  // y = r_0 + ... + gamma^(n-1) r_(n-1) + gamma^n Q'(s_n, a*), with a* = argmax Q' or, double, argmax Q: the best of
  // what is legal there. Nothing follows a terminal state.
  void SetTargets() {
    const float* judges = q_.TargetOutput(minibatch_.next_features.data(), minibatch_.size());
    const float* chooses = dqn_.double_q ? q_.Output(minibatch_.next_features.data(), minibatch_.size()) : judges;
    for (std::size_t i = 0; i < targets_.size(); ++i) {
      const std::size_t row = i * static_cast<std::size_t>(choices_);
      const auto best = static_cast<std::size_t>(explorer_.BestOf(chooses + row, minibatch_.next_masks[i]));
      targets_[i] = minibatch_.rewards[i] + static_cast<float>(minibatch_.discounts[i]) * judges[row + best];
    }
  }

  void Gather(const LossBlock& block) override { minibatch_.Gather(block); }

  // L = mean w huber(Q(s, a) - y), with huber(d) = d^2 / 2 where |d| <= 1, else |d| - 1/2.
  void Loss(const LossBlock& block) override {
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    std::fill_n(block.output_gradients[0], block.rows * choices_, 0.0f);
    DqnSums& sums = losses_.block(block.index) = {};
    for (std::int64_t r = 0; r < block.rows; ++r) {
      const auto i = static_cast<std::size_t>(block.first_row + r);
      const std::int64_t chosen = r * choices_ + static_cast<std::int64_t>(*minibatch_.raw_action(i));
      const float error = block.outputs[0][chosen] - targets_[i], size = std::fabs(error);
      const float weight = minibatch_.weights[i];
      minibatch_.errors[i] = error;
      sums[kDqnError] += error;
      sums[kDqnLoss] += weight * (size <= 1.0f ? 0.5f * size * size : size - 0.5f);
      sums[kDqnReward] += minibatch_.rewards[i];
      sums[kDqnWeight] += weight;
      block.output_gradients[0][chosen] = weight * std::clamp(error, -1.0f, 1.0f) * inverse;
    }
  }

  // Source: Stable Baselines 2.10.2, deepq/dqn.py, and Stable Baselines3, off_policy_algorithm.py and dqn.py.
  void WriteMetrics() {
    const auto episodes = static_cast<double>(collector_.episodes().count());
    metrics_.clear();
    const bool learned = losses_.minibatches() > 0;
    const DqnSums means = learned ? losses_.UpdateMeans() : DqnSums{};
    if (dqn_.log_keys == Generation::kStableBaselines2) {
      metrics_ = {{"steps", "", static_cast<double>(steps())},
                  {"episodes", "", episodes},
                  {"mean 100 episode reward", "", collector_.episodes().mean()},
                  {"% time spent exploring", "", std::floor(100.0 * Epsilon())}};
      if (!learned) return;
      for (const auto& [tag, term] :
           {std::pair("loss/td_error", kDqnError), std::pair("loss/loss", kDqnLoss),
            std::pair("input_info/rewards", kDqnReward), std::pair("input_info/importance_weights", kDqnWeight)})
        metrics_.push_back({"", tag, means[term]});
      return;
    }
    const auto put = [this](std::string_view name, double number) { metrics_.push_back({name, name, number}); };
    put("rollout/exploration_rate", Epsilon());
    put("time/episodes", episodes);
    if (!learned) return;
    put("train/learning_rate", learning_rate_);
    put("train/loss", means[kDqnLoss]);
    put("train/n_updates", static_cast<double>(updates_));
  }

  const DqnOptions dqn_;
  const std::string hyperparameters_;  // JSON, for the model file
  std::int64_t total_steps_;
  ReplayCollector collector_;
  const std::int64_t choices_;
  LearnedNetwork q_;
  EpsilonGreedy explorer_;
  std::optional<ParameterNoise> noise_;
  ReplayMinibatch minibatch_;
  std::vector<float> targets_;  // [B] y
  LossLog<kDqnTerms> losses_;   // of the round under way, or the latest
  float learning_rate_ = 0;     // of the latest update
  std::int64_t updates_ = 0;
  std::vector<Metric> metrics_;
};

}  // namespace

std::span<const Hyperparameter> DqnTable() {
  static const std::vector<Hyperparameter> table =
      TableOf(kDqnRows, Generation::kStableBaselines3, {"Stable Baselines 2.10.2, DQN", "Stable Baselines3, DQN"});
  return table;
}

Result<std::unique_ptr<Learner>> CreateDqn(const LearnerOptions& options, const HyperparameterSet& values) {
  DqnOptions dqn{};
  CONSAC_RETURN_IF_ERROR(ReadOffPolicyRows(kDqnRows, values, options, &dqn));
  if (dqn.log_keys == Generation::kStableBaselines2) dqn.collect.report_every = 100;  // its log_interval
  Result<QModel> model = MakeQModel(options, dqn, "dqn");
  if (!model.ok()) return model.status();
  // Two networks' parameters, each packed, a packed form to learn, the optimiser's two columns, initialisation in
  // double precision, the snapshot; with noise four more; and gradients.
  const std::int64_t copies =
      10 + (dqn.param_noise ? 4 : 0) + Backpropagation::GradientCopies(model->network, dqn.batch_size);
  CONSAC_RETURN_IF_ERROR(CheckOffPolicyMemory(options, dqn,
                                              {model->head.raw_size(), model->network.parameter_count(), copies,
                                               Backpropagation::ActivationBytes(model->network, dqn.batch_size)}));
  return std::unique_ptr<Learner>(std::make_unique<Dqn>(options, dqn, std::move(*model), HyperparametersJson(values)));
}

}  // namespace consac::learn
