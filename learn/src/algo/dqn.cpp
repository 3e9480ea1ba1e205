// Deep Q-learning: `dqn` as in Stable Baselines3, and with `--preset sb2` as in Stable Baselines 2.10.2 (double,
// prioritised, parameter noise). From top to bottom: hyperparameters, choosing actions, one gradient step (what is
// drawn, its targets, the loss), what it tells and keeps. docs/algorithms/dqn.md has the equations. Source: Mnih et al.
// 2015, Nature 518; van Hasselt et al. 2016, arXiv:1509.06461 (double); Stable Baselines 2.10.2 deepq/dqn.py and Stable
// Baselines3 dqn.py for the rest.
#include <algorithm>
#include <cmath>
#include <optional>

#include "algo/algorithms.h"
#include "algo/q_options.h"
#include "collect/parameter_noise.h"
#include "collect/q_network.h"
#include "collect/replay_minibatch.h"
#include "collect/sums.h"
#include "optim/gradient_step.h"

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
constexpr auto kDqnRows =
    std::tie(kDqnSteps, q_rows::kExploration, off_policy_rows::kReplay, kDqnRounds, off_policy_rows::kRounds,
             off_policy_rows::kPrioritized, kDqnOwn, q_rows::kNetwork, off_policy_rows::kNormalise);

constexpr const char* kDqnTerms[] = {"td_error", "loss", "reward", "weight"};
enum DqnTerm { kDqnError, kDqnLoss, kDqnReward, kDqnWeight };
using DqnSums = Sums<kDqnTerms>;

/// See learner.h. An update is one gradient step.
class Dqn final : public Learner, private BlockLoss {
 public:
  Dqn(const LearnerOptions& options, const DqnOptions& dqn, QModel model, std::string hyperparameters)
      : behaviour_(options.behaviour),
        dqn_(dqn),
        hyperparameters_(std::move(hyperparameters)),
        executor_(options.executor),
        choices_(model.head.size()),
        total_steps_(options.total_steps),
        collector_(behaviour_, std::move(model.head), dqn.collect, options.seed, options.ranks),
        q_(std::move(model.network), options.seed, std::max<std::int64_t>(behaviour_.slots, dqn.batch_size),
           options.ranks),
        explorer_(choices_, options.seed),
        backpropagation_(q_.network(), 0, dqn.batch_size),
        step_(Optimiser(Adam(q_.network().parameter_count(), dqn.adam)), dqn.max_grad_norm, options.ranks),
        minibatch_(behaviour_, dqn.batch_size, dqn.n_steps, options.ranks),
        targets_(static_cast<std::size_t>(dqn.batch_size)),
        losses_(dqn.batch_size, options.ranks) {
    if (dqn.clip == GradientClip::kVariable) step_.ClipEach(q_.network().parameters());
    if (dqn.param_noise) {
      noise_.emplace(q_.network(), options.seed, behaviour_.slots);
      noise_->Perturb(q_.parameters());
    }
    metrics_.reserve(16);
  }

  // Collecting: collect/replay_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }

  void Act(Batch& batch) override {
    const ReplayCollector::Acting acting = collector_.BeginAct(batch);
    const std::int64_t rows = batch.rows();
    const bool random = collector_.warming_up() && dqn_.warm_up == WarmUp::kRandom;
    const float* values = q_.Values(acting.features, rows);
    if (noise_) {
      noise_->Adapt(q_.parameters(), acting.features, values, rows, Epsilon());
      values = noise_->Values(acting.features, rows);
    }
    explorer_.Choose(values, batch.action_masks, rows, random ? 1.0 : noise_ ? 0.0 : Epsilon(), acting.raw);
    collector_.FinishAct(batch);
  }

  // The target network follows the steps of all agents; noise lasts as long as an episode of each.
  void Record(const Batch& batch) override {
    const std::int64_t targets = collector_.steps() / dqn_.target_update_interval;
    const std::int64_t reports = ReportsOf(collector_.episodes().count());
    const std::int64_t noises = collector_.episodes().count() / behaviour_.slots;
    collector_.Record(batch);
    if (collector_.steps() / dqn_.target_update_interval != targets) q_.UpdateTarget(dqn_.tau);
    if (noise_ && collector_.episodes().count() / behaviour_.slots != noises) noise_->Perturb(q_.parameters());
    if (ReportsOf(collector_.episodes().count()) != reports) WriteMetrics();
  }

  // Learning: one minibatch after another, as many as the collector says.
  bool LearningDue() const override { return collector_.due() > 0; }
  bool Learn(const LearnBudget& budget) override {
    for (std::int64_t i = 0; i < budget.gradient_steps && LearningDue(); ++i) {
      if (round_ == 0) {
        round_ = collector_.due();
        collector_.BeginRound();
        losses_.BeginUpdate();
        step_.Begin();
      }
      GradientStepOnDraws();
      collector_.StepDone();
      if (--round_ == 0) step_.Finish(updates_, losses_.minibatches());
    }
    return LearningDue();
  }

  std::int64_t steps() const override { return collector_.steps(); }
  std::int64_t updates() const override { return updates_; }
  std::int64_t reports() const override { return ReportsOf(collector_.episodes().count()); }
  std::int64_t steps_per_update() const override { return 0; }
  std::int64_t memory_bytes() const override {
    return Replay::Bytes(behaviour_, collector_.action_head().raw_size(), dqn_.collect.replay);
  }
  Status StartFrom(const PolicyData& model) override {
    CONSAC_RETURN_IF_ERROR(collector_.StartFrom(model.normaliser));
    CONSAC_RETURN_IF_ERROR(q_.StartFrom(model));
    if (noise_) noise_->Perturb(q_.parameters());
    return Status::Ok();
  }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  Status health() const override { return step_.health(); }
  PolicyData Snapshot() const override {
    PolicyData data =
        q_.Snapshot(behaviour_, collector_.normaliser(), TrainingJson(hyperparameters_, steps(), updates_));
    data.heads = collector_.action_head().specs();
    return data;
  }
  void Visit(Archive& archive) override {
    q_.Visit(archive);
    step_.Visit(archive);
    collector_.Visit(archive);
    explorer_.Visit(archive);
    if (noise_) archive("parameter_noise", *noise_);
    losses_.Visit(archive);
    archive("round", round_);
    archive.Check("round", round_ >= 0 && round_ <= collector_.due());
    archive("learning_rate", learning_rate_);
    archive("updates", updates_);
  }

 private:
  double Elapsed() const {
    return static_cast<double>(steps()) / static_cast<double>(std::max(total_steps_, std::int64_t{1}));
  }
  double Epsilon() const { return dqn_.exploration.At(Elapsed()); }

  void GradientStepOnDraws() {
    minibatch_.Draw(collector_, dqn_.BetaAt(steps(), total_steps_));
    SetTargets();
    learning_rate_ = static_cast<float>(dqn_.learning_rate.At(std::max(0.0, 1.0 - Elapsed())));
    backpropagation_.Run(q_.parameters(), minibatch_.size(), executor_, *this);
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    step_.Apply(q_.parameters(), backpropagation_.gradient(), learning_rate_);
    q_.Publish();
    minibatch_.SetPriorities();
    ++updates_;
  }

  // y = r_0 + ... + gamma^(n-1) r_(n-1) + gamma^n Q'(s_n, a*), with a* = argmax Q' or, double, argmax Q: the best of
  // what is legal there. Nothing follows a terminal state.
  void SetTargets() {
    const float* judges = q_.TargetValues(minibatch_.next_features.data(), minibatch_.size());
    const float* chooses = dqn_.double_q ? q_.Values(minibatch_.next_features.data(), minibatch_.size()) : judges;
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

  // Stable Baselines' log_interval counts episodes here.
  std::int64_t ReportsOf(std::int64_t episodes) const {
    return episodes / (dqn_.log_keys == Generation::kStableBaselines2 ? 100 : 4);
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

  const BehaviourSpec behaviour_;
  const DqnOptions dqn_;
  const std::string hyperparameters_;  // JSON, for the model file
  const Executor executor_;
  const std::int64_t choices_;
  std::int64_t total_steps_;
  ReplayCollector collector_;
  QNetwork q_;
  EpsilonGreedy explorer_;
  std::optional<ParameterNoise> noise_;
  Backpropagation backpropagation_;
  GradientStep step_;
  ReplayMinibatch minibatch_;
  std::vector<float> targets_;  // [B] y
  LossLog<kDqnTerms> losses_;   // of the round under way, or the latest
  std::int64_t round_ = 0;      // gradient steps that are left of the round under way
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
  CONSAC_RETURN_IF_ERROR(ReadRows(kDqnRows, values, &dqn));
  Result<QModel> model = MakeQModel(options, dqn, "dqn");
  if (!model.ok()) return model.status();
  // Two networks' parameters, each packed, a packed form to learn, the optimiser's two columns, initialisation in
  // double precision, the snapshot; with noise four more; and gradients.
  const std::int64_t copies = 10 + (dqn.param_noise ? 4 : 0) + Backpropagation::GradientCopies(dqn.batch_size);
  CONSAC_RETURN_IF_ERROR(CheckOffPolicyMemory(options, dqn,
                                              {model->head.raw_size(), model->network.parameter_count(), copies,
                                               Backpropagation::ActivationBytes(model->network, dqn.batch_size)}));
  return std::unique_ptr<Learner>(std::make_unique<Dqn>(options, dqn, std::move(*model), HyperparametersJson(values)));
}

}  // namespace consac::learn
