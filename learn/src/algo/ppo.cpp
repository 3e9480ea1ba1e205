// Proximal policy optimisation: `ppo2` as in Stable Baselines 2.10.2, the thesis' algorithm, and `ppo` as in Stable
// Baselines3. From top to bottom: hyperparameters, collecting, one update (advantages, epochs of minibatches, the
// clipped loss, one optimiser step each), what it tells and keeps. docs/algorithms/ppo.md has the equations, ppo_loss.h
// the loss of a row. Source: Schulman et al. 2017, arXiv:1707.06347, eq. 7 and 9; Stable Baselines 2.10.2 ppo2.py and
// Stable Baselines3 ppo.py for everything that the paper leaves open.
#include <algorithm>

#include "algo/algorithms.h"
#include "algo/on_policy.h"
#include "algo/ppo_loss.h"
#include "buffer/moments.h"
#include "collect/rollout_minibatch.h"
#include "collect/shuffled_passes.h"
#include "collect/sums.h"
#include "consac/nn/kernels.h"
#include "optim/gradient_step.h"

namespace consac::learn {
namespace {

struct PpoOptions : OnPolicyOptions {
  std::int64_t n_minibatches;             // pieces per epoch; 0: by batch_size
  std::int64_t batch_size;                // rows per minibatch; used where n_minibatches is 0
  std::int64_t n_epochs;                  // passes over the rollout
  double target_kl;                       // stop the epochs past 1.5 times this; 0: never
  Schedule clip_range, clip_range_vf;     // of the ratio; of the value
  RolloutMinibatch::Deviation deviation;  // of advantages: n (SB2) or n - 1 (SB3)
  Generation value_loss;                  // 1/2 mean max(...) (SB2), or mean (...) of the clipped value (SB3)
  AdamOptions adam;                       // optimiser
};

using P = PpoOptions;
namespace rows = on_policy_rows;
using enum ParameterSource;

constexpr rows::Row kPpoOnPolicy[] = {rows::kLearningRate, rows::kNSteps, rows::kGamma,       rows::kGaeLambda,
                                      rows::kEntCoef,      rows::kVfCoef, rows::kMaxGradNorm, rows::kNormalizeAdvantage,
                                      rows::kTruncation};
constexpr ParameterRow<P> kPpoOwn[] = {
    {"nminibatches", "nminibatches", Into<P, &P::n_minibatches>, "4", "none", 1, 1e9, "",
     "minibatches per epoch; must divide the rollout; in ppo instead of batch_size", kSb2},
    {"batch_size", "batch_size", Into<P, &P::batch_size>, "none", "64", 1, 1e9, "",
     "rows per minibatch; in ppo2 instead of nminibatches", kSb3},
    {"noptepochs", "n_epochs", Into<P, &P::n_epochs>, "4", "10", 1, 1e6, "", "passes over the rollout per update",
     kBoth},
    {"cliprange", "clip_range", Into<P, &P::clip_range>, "0.2", "0.2", 0, kUnlimited, "",
     "how far the probability ratio may move", kBoth},
    {"cliprange_vf", "clip_range_vf", Into<P, &P::clip_range_vf>, "none", "none", -kUnlimited, kUnlimited, "none",
     "how far the value may move; none: as cliprange (ppo2), no clipping (ppo); negative: no clipping", kBoth},
    {"target_kl", "target_kl", Into<P, &P::target_kl>, "none", "none", 0, kUnlimited, "none",
     "stop an update's epochs past 1.5 times this divergence", kSb3},
    {"advantage_std", "advantage_std", Into<P, &P::deviation>, "population", "sample", 0, 0, "population|sample",
     "deviation by n (SB2) or n - 1 (SB3)", kConsac},
    {"value_loss", "value_loss", Into<P, &P::value_loss>, "sb2", "sb3", 0, 0, "sb2|sb3",
     "half the mean of the larger of both errors, or the mean of one", kConsac},
    {"optimizer", "optimizer", Into<P, &P::adam, &AdamOptions::form>, "tensorflow", "pytorch", 0, 0,
     "tensorflow|pytorch", "whose form of Adam and of the gradient clip", kConsac},
    {"adam_epsilon", "adam_epsilon", Into<P, &P::adam, &AdamOptions::epsilon>, "1e-5", "1e-5", 0, 1, "",
     "Adam's epsilon", kBoth},
};
constexpr auto kPpoRows = std::tie(kPpoOnPolicy, kPpoOwn, rows::kNetwork, rows::kSde, rows::kSquash, rows::kNormalise);

constexpr const char* kPpoTerms[] = {"policy", "value", "entropy", "kl", "clipped"};
enum PpoTerm { kPolicy, kValue, kEntropy, kKl, kClipped };
using PpoSums = Sums<kPpoTerms>;

std::int64_t LargestMinibatch(const PpoOptions& ppo, std::int64_t slots) {
  const std::int64_t rollout = ppo.rollout.n_steps * slots;
  return ppo.n_minibatches > 0 ? (rollout + ppo.n_minibatches - 1) / ppo.n_minibatches
                               : std::min(ppo.batch_size, rollout);
}

/// See learner.h. An update may be learned in pieces and saved between them.
class Ppo final : public Learner, private BlockLoss {
 public:
  Ppo(const LearnerOptions& options, const PpoOptions& ppo, OnPolicyModel model, std::string hyperparameters)
      : behaviour_(options.behaviour),
        ppo_(ppo),
        hyperparameters_(std::move(hyperparameters)),
        executor_(options.executor),
        total_steps_(options.total_steps),
        model_(std::move(model.network), std::move(model.head), behaviour_, options.seed, ppo.log_std_init,
               options.ranks),
        collector_(behaviour_, ppo.rollout, model_, options.seed, options.ranks),
        backpropagation_(model_.network(), model_.action_head().log_std_size(),
                         LargestMinibatch(ppo, behaviour_.slots)),
        step_(Optimiser(Adam(static_cast<std::int64_t>(model_.parameters().size()), ppo.adam)), ppo.max_grad_norm,
              options.ranks),
        passes_(steps_per_update(), options.seed),
        minibatch_(behaviour_, model.gradient, LargestMinibatch(ppo, behaviour_.slots), options.ranks),
        losses_(LargestMinibatch(ppo, behaviour_.slots), options.ranks) {
    metrics_.reserve(32);
  }

  // Collecting: collect/rollout_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  void Act(Batch& batch) override { collector_.Act(batch); }
  void Record(const Batch& batch) override { collector_.Record(batch); }

  // Learning.
  bool LearningDue() const override { return collector_.full(); }
  bool Learn(const LearnBudget& budget) override {
    if (!LearningDue()) return false;
    if (!updating_) BeginUpdate();
    for (std::int64_t step = 0; step < budget.gradient_steps; ++step) {
      BeginMinibatch();
      backpropagation_.Run(model_.parameters(), minibatch_.size(), executor_, *this);
      if (OptimiserStep() && passes_.finished() < ppo_.n_epochs) continue;
      FinishUpdate();
      return false;
    }
    return true;
  }
  std::int64_t steps() const override { return collector_.steps(); }
  std::int64_t updates() const override { return updates_; }
  std::int64_t steps_per_update() const override { return ppo_.rollout.n_steps * behaviour_.slots; }
  Status StartFrom(const PolicyData& model) override { return collector_.StartFrom(model); }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  Status health() const override { return step_.health(); }
  PolicyData Snapshot() const override {
    return model_.Snapshot(behaviour_, collector_.normaliser(), TrainingJson(hyperparameters_, steps(), updates_));
  }
  void Visit(Archive& archive) override {
    model_.Visit(archive);
    step_.Visit(archive);
    collector_.Visit(archive);
    passes_.Visit(archive);
    archive.CheckWithin("epoch", passes_.finished(), 0, ppo_.n_epochs);
    losses_.Visit(archive);
    archive("updating", updating_);
    archive.Check("updating", !updating_ || (collector_.full() && !passes_.rows().empty()));
    archive("learning_rate", learning_rate_);
    archive("clip_range", clip_range_);
    archive("clip_range_vf", clip_range_vf_);
    archive("updates", updates_);
  }

 private:
  // Advantages, and the schedules' values of this update.
  void BeginUpdate() {
    passes_.Begin(collector_.Finish());
    const double remaining =
        TrainingProgress{total_steps_, steps(), updates_, steps_per_update()}.Remaining(ppo_.generation);
    learning_rate_ = static_cast<float>(ppo_.learning_rate.At(remaining));
    clip_range_ = static_cast<float>(ppo_.clip_range.At(remaining));
    const bool follows = ppo_.clip_range_vf.absent && ppo_.generation == Generation::kStableBaselines2;
    clip_range_vf_ = follows                     ? clip_range_
                     : ppo_.clip_range_vf.absent ? -1.0f
                                                 : static_cast<float>(ppo_.clip_range_vf.At(remaining));
    updating_ = true;
    losses_.BeginUpdate();
    step_.Begin();
  }

  void BeginMinibatch() {
    if (passes_.at_begin()) losses_.BeginPass();
    const auto rows = static_cast<std::int64_t>(passes_.rows().size());
    const std::int64_t pieces = ppo_.n_minibatches;
    minibatch_.Begin(collector_, passes_.Next(pieces > 0 ? std::max<std::int64_t>(1, rows / pieces) : ppo_.batch_size));
    if (ppo_.normalize_advantage) minibatch_.StandardiseAdvantages(ppo_.deviation);
  }

  void Gather(const LossBlock& block) override { minibatch_.Gather(block); }
  // L = mean max(-A rho, -A clip(rho)) - ent_coef mean H + vf_coef L_V, row by row (ppo_loss.h) and through the head.
  void Loss(const LossBlock& block) override {
    const auto first = static_cast<std::size_t>(block.first_row), rows = static_cast<std::size_t>(block.rows);
    HeadGradient& head = minibatch_.Head(block, model_.log_std().data());
    float ratio[kBlockRows], d_neglogp[kBlockRows], d_entropy[kBlockRows];
    for (std::size_t r = 0; r < rows; ++r) ratio[r] = minibatch_.neglogp[first + r] - head.neglogp()[r];
    nn::Exp(std::span<const float>(ratio, rows), std::span<float>(ratio, rows));
    const PpoLossForm form{clip_range_, clip_range_vf_, ppo_.vf_coef, ppo_.value_loss == Generation::kStableBaselines2,
                           ppo_.generation == Generation::kStableBaselines2};
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    PpoSums& sums = losses_.block(block.index) = {};
    for (std::size_t r = 0; r < rows; ++r) {
      const std::size_t i = first + r;
      const PpoLossTerms terms =
          PpoLossOf(form, {minibatch_.advantages[i], minibatch_.returns[i], minibatch_.values[i], minibatch_.neglogp[i],
                           block.outputs[1][r], head.neglogp()[r], ratio[r]});
      sums[kPolicy] += terms.policy;
      sums[kValue] += terms.value;
      sums[kEntropy] += head.entropy()[r];
      sums[kKl] += terms.kl;
      sums[kClipped] += terms.clipped;
      d_neglogp[r] = terms.d_neglogp * inverse;
      d_entropy[r] = -ppo_.ent_coef * inverse;
      block.output_gradients[1][r] = terms.d_value * inverse;
    }
    head.Backward(std::span<const float>(d_neglogp, rows), std::span<const float>(d_entropy, rows),
                  block.output_gradients[0], block.extra_gradient.data());
  }

  // One clipped Adam step; false when target_kl ends the update before it.
  bool OptimiserStep() {
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    if (ppo_.target_kl > 0.0 && losses_.last()[kKl] > 1.5 * ppo_.target_kl) return false;
    step_.Apply(model_.parameters(), backpropagation_.gradient(), learning_rate_);
    return true;
  }

  void FinishUpdate() {
    ++updates_;
    metrics_.clear();
    ppo_.generation == Generation::kStableBaselines2 ? WriteMetrics2(losses_.UpdateMeans())
                                                     : WriteMetrics3(losses_.UpdateMeans());
    step_.Finish(updates_, losses_.minibatches());
    collector_.Restart();  // by the parameters that acted
    model_.Publish();
    updating_ = false;
  }

  // Source: Stable Baselines 2.10.2, ppo2.py, learn and setup_model.
  void WriteMetrics2(const PpoSums& means) {
    const auto mean_of = [this](const std::vector<float>& column) {
      return Moments(passes_.rows(), [&](std::size_t row) { return column[row]; }).mean;
    };
    const Rollout& rollout = collector_.rollout();
    metrics_ = {{"policy_loss", "loss/policy_gradient_loss", means[kPolicy], true},
                {"value_loss", "loss/value_function_loss", means[kValue], true},
                {"policy_entropy", "loss/entropy_loss", means[kEntropy], true},
                {"approxkl", "loss/approximate_kullback-leibler", means[kKl], true},
                {"clipfrac", "loss/clip_factor", means[kClipped], true},
                {"", "loss/loss", Total(means)},
                {"explained_variance", "", collector_.ExplainedVariance(passes_.rows())},
                {"", "input_info/discounted_rewards", mean_of(rollout.returns)},
                {"", "input_info/learning_rate", learning_rate_},
                {"", "input_info/advantage", mean_of(rollout.advantages)},
                {"", "input_info/clip_range", clip_range_}};
    if (clip_range_vf_ >= 0.0f) metrics_.push_back({"", "input_info/clip_range_vf", clip_range_vf_});
    metrics_.push_back({"", "input_info/old_neglog_action_probability", mean_of(rollout.neglogp)});
    metrics_.push_back({"", "input_info/old_value_pred", mean_of(rollout.values)});
  }

  // Source: Stable Baselines3, ppo.py, train: approx_kl is the last epoch's mean, loss the last minibatch's.
  void WriteMetrics3(const PpoSums& means) {
    const auto put = [this](std::string_view name, double number) { metrics_.push_back({name, name, number}); };
    put("train/approx_kl", losses_.PassMean(kKl));
    put("train/clip_fraction", means[kClipped]);
    put("train/clip_range", clip_range_);
    if (clip_range_vf_ >= 0.0f) put("train/clip_range_vf", clip_range_vf_);
    put("train/entropy_loss", -means[kEntropy]);
    put("train/explained_variance", collector_.ExplainedVariance(passes_.rows()));
    put("train/learning_rate", learning_rate_);
    put("train/loss", Total(losses_.last()));
    put("train/n_updates", static_cast<double>(passes_.begun()));
    put("train/policy_gradient_loss", means[kPolicy]);
    if (!model_.log_std().empty()) put("train/std", MeanDeviation(model_.log_std()));
    put("train/value_loss", means[kValue]);
  }

  double Total(const PpoSums& sums) const {
    return sums[kPolicy] - ppo_.ent_coef * sums[kEntropy] + ppo_.vf_coef * sums[kValue];
  }

  const BehaviourSpec behaviour_;
  const PpoOptions ppo_;
  const std::string hyperparameters_;  // JSON, for the model file
  const Executor executor_;
  std::int64_t total_steps_;
  ActorCritic model_;
  RolloutCollector collector_;
  Backpropagation backpropagation_;
  GradientStep step_;
  ShuffledPasses passes_;
  RolloutMinibatch minibatch_;
  LossLog<kPpoTerms> losses_;
  bool updating_ = false;                                         // an update is under way
  float learning_rate_ = 0, clip_range_ = 0, clip_range_vf_ = 0;  // of this update; negative clip_range_vf: off
  std::int64_t updates_ = 0;                                      // in all
  std::vector<Metric> metrics_;
};

}  // namespace

Result<std::unique_ptr<Learner>> CreatePpo(Generation generation, const LearnerOptions& options,
                                           const HyperparameterSet& values) {
  PpoOptions ppo{};
  CONSAC_RETURN_IF_ERROR(ReadRows(kPpoRows, values, &ppo));
  ppo.generation = generation;
  const bool sb2 = generation == Generation::kStableBaselines2;
  (sb2 ? ppo.batch_size > 0 : ppo.n_minibatches == 0) ? ppo.n_minibatches = 0 : ppo.batch_size = 0;
  const std::int64_t rows = ppo.rollout.n_steps * options.behaviour.slots;
  if (ppo.n_minibatches > 0 && rows % ppo.n_minibatches != 0) {
    return Status{StatusCode::kInvalidArgument, "nminibatches " + std::to_string(ppo.n_minibatches) +
                                                    " does not divide the rollout of " + std::to_string(rows) +
                                                    " steps (n_steps times agents); choose one that does"};
  }
  Result<OnPolicyModel> model = MakeOnPolicyModel(options, ppo, LargestMinibatch(ppo, options.behaviour.slots));
  if (!model.ok()) return model.status();
  return std::unique_ptr<Learner>(std::make_unique<Ppo>(options, ppo, std::move(*model), HyperparametersJson(values)));
}

std::span<const Hyperparameter> PpoTable(Generation generation) {
  constexpr SourceNames kNames = {"Stable Baselines 2.10.2, PPO2", "Stable Baselines3, PPO"};
  static const std::vector<Hyperparameter> tables[] = {TableOf(kPpoRows, Generation::kStableBaselines2, kNames),
                                                       TableOf(kPpoRows, Generation::kStableBaselines3, kNames)};
  return tables[static_cast<std::size_t>(generation)];
}

}  // namespace consac::learn
