// Advantage actor-critic, synchronous: `a2c` as in Stable Baselines3, and with `--preset sb2` as in Stable Baselines
// 2.10.2. From top to bottom: hyperparameters, collecting, one update (returns, the loss, one optimiser step over all
// that was collected), what it tells and keeps. docs/algorithms/a2c.md has the equations. Source: Mnih et al. 2016,
// arXiv:1602.01783, algorithm S3; Stable Baselines 2.10.2 a2c.py and Stable Baselines3 a2c.py for the rest.
#include <algorithm>

#include "algo/algorithms.h"
#include "algo/on_policy.h"
#include "algo/progress.h"
#include "buffer/moments.h"
#include "collect/rollout_minibatch.h"
#include "collect/sums.h"
#include "optim/gradient_step.h"

namespace consac::learn {
namespace {

/// Stable Baselines 2's named schedules, in the order of the row's choices.
enum class LrSchedule : std::uint8_t { kConstant, kLinear, kDoubleLinearCon, kMiddleDrop, kDoubleMiddleDrop };

struct A2cOptions : OnPolicyOptions {
  LrSchedule lr_schedule;  // multiplies learning_rate
  bool use_rms_prop;       // RMSProp, or Adam
  RmsPropOptions rms_prop;
  AdamOptions adam;     // its form is RMSProp's
  Generation log_keys;  // whose names the metrics have
};

using A = A2cOptions;
using enum ParameterSource;

constexpr on_policy_rows::Row kA2cOnPolicy[] = {on_policy_rows::kLearningRate.WithDefaults("7e-4", "7e-4"),
                                                on_policy_rows::kNSteps.WithDefaults("5", "5"),
                                                on_policy_rows::kGamma,
                                                on_policy_rows::kGaeLambda.WithDefaults("1", "1"),
                                                on_policy_rows::kEntCoef,
                                                on_policy_rows::kVfCoef.WithDefaults("0.25", "0.5"),
                                                on_policy_rows::kMaxGradNorm,
                                                on_policy_rows::kNormalizeAdvantage.WithDefaults("false", "false"),
                                                on_policy_rows::kTruncation};
constexpr ParameterRow<A> kA2cOwn[] = {
    {"lr_schedule", "lr_schedule", Into<A, &A::lr_schedule>, "constant", "constant", 0, 0,
     "constant|linear|double_linear_con|middle_drop|double_middle_drop", "multiplies learning_rate as time passes",
     kSb2},
    {"use_rms_prop", "use_rms_prop", Into<A, &A::use_rms_prop>, "true", "true", 0, 0, "", "RMSProp; false: Adam", kSb3},
    {"optimizer", "optimizer", Into<A, &A::rms_prop, &RmsPropOptions::form>, "tensorflow", "pytorch", 0, 0,
     "tensorflow|pytorch", "whose form of RMSProp or Adam and of the gradient clip", kConsac},
    {"alpha", "alpha", Into<A, &A::rms_prop, &RmsPropOptions::decay>, "0.99", "0.99", 0, 1, "",
     "decay of RMSProp's mean square", kSb2},
    {"momentum", "momentum", Into<A, &A::rms_prop, &RmsPropOptions::momentum>, "0", "0", 0, 1, "", "RMSProp's momentum",
     kSb2},
    {"epsilon", "rms_prop_eps", Into<A, &A::rms_prop, &RmsPropOptions::epsilon>, "1e-5", "1e-5", 0, 1, "",
     "RMSProp's epsilon", kBoth},
    {"adam_epsilon", "adam_epsilon", Into<A, &A::adam, &AdamOptions::epsilon>, "1e-5", "1e-5", 0, 1, "",
     "Adam's epsilon", kSb3},
    {"log_keys", "log_keys", Into<A, &A::log_keys>, "sb2", "sb3", 0, 0, "sb2|sb3", "whose names the logs have",
     kConsac},
};
constexpr auto kA2cRows = std::tie(kA2cOnPolicy, kA2cOwn, on_policy_rows::kNetwork, on_policy_rows::kSde,
                                   on_policy_rows::kSquash, on_policy_rows::kNormalise);

constexpr const char* kA2cTerms[] = {"policy", "value", "entropy"};
enum A2cTerm { kA2cPolicy, kA2cValue, kA2cEntropy };
using A2cSums = Sums<kA2cTerms>;

constexpr std::int64_t kUpdatesPerReport = 100;  // Stable Baselines' log_interval, both generations

/// Of the elapsed share `q`. Source: Stable Baselines 2.10.2, common/schedules.py, as coded.
double LrMultiplier(LrSchedule schedule, double q) {
  const double left = std::max(0.0, 1.0 - q);
  switch (schedule) {
    case LrSchedule::kConstant:
      break;
    case LrSchedule::kLinear:
      return left;
    case LrSchedule::kDoubleLinearCon:
      return std::max(0.125, 1.0 - 2.0 * q);
    case LrSchedule::kMiddleDrop:
      return left >= 0.75 ? left : 0.075;
    case LrSchedule::kDoubleMiddleDrop:
      return left >= 0.75 ? left : left >= 0.25 ? 0.075 : 0.125;
  }
  return 1.0;
}

Optimiser MakeOptimiser(const A2cOptions& a2c, std::int64_t parameters) {
  AdamOptions adam = a2c.adam;
  adam.form = a2c.rms_prop.form;
  return a2c.use_rms_prop ? Optimiser(RmsProp(parameters, a2c.rms_prop)) : Optimiser(Adam(parameters, adam));
}

/// See learner.h. An update is one gradient step.
class A2c final : public Learner, private BlockLoss {
 public:
  A2c(const LearnerOptions& options, const A2cOptions& a2c, OnPolicyModel model, std::string hyperparameters)
      : behaviour_(options.behaviour),
        a2c_(a2c),
        hyperparameters_(std::move(hyperparameters)),
        executor_(options.executor),
        total_steps_(options.total_steps),
        model_(std::move(model.network), std::move(model.head), behaviour_, options.seed, a2c.log_std_init,
               options.ranks),
        collector_(behaviour_, a2c.rollout, model_, options.seed, options.ranks),
        backpropagation_(model_.network(), model_.action_head().log_std_size(), steps_per_update()),
        step_(MakeOptimiser(a2c, static_cast<std::int64_t>(model_.parameters().size())), a2c.max_grad_norm,
              options.ranks),
        minibatch_(behaviour_, model.gradient, steps_per_update(), options.ranks),
        losses_(steps_per_update(), options.ranks) {
    metrics_.reserve(16);
  }

  // Collecting: collect/rollout_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  void Act(Batch& batch) override { collector_.Act(batch); }
  void Record(const Batch& batch) override { collector_.Record(batch); }

  // Learning: once over everything that was collected.
  bool LearningDue() const override { return collector_.full(); }
  bool Learn(const LearnBudget& budget) override {
    if (!LearningDue() || budget.gradient_steps < 1) return LearningDue();
    const std::span<const std::int32_t> rows = collector_.Finish();
    minibatch_.Begin(collector_, rows);
    if (a2c_.normalize_advantage) minibatch_.StandardiseAdvantages(RolloutMinibatch::Deviation::kSample);
    learning_rate_ = LearningRate();
    losses_.BeginUpdate();
    step_.Begin();
    backpropagation_.Run(model_.parameters(), minibatch_.size(), executor_, *this);
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    step_.Apply(model_.parameters(), backpropagation_.gradient(), learning_rate_);
    ++updates_;
    step_.Finish(updates_, losses_.minibatches());
    if (updates_ == 1 || updates_ % kUpdatesPerReport == 0) WriteMetrics(rows);
    collector_.Restart();  // by the parameters that acted
    model_.Publish();
    return false;
  }

  std::int64_t steps() const override { return collector_.steps(); }
  std::int64_t updates() const override { return updates_; }
  std::int64_t reports() const override { return updates_ == 0 ? 0 : 1 + updates_ / kUpdatesPerReport; }
  std::int64_t steps_per_update() const override { return a2c_.rollout.n_steps * behaviour_.slots; }
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
    archive("updates", updates_);
  }

 private:
  // The named schedule is read at the last sample of what was collected, as Stable Baselines 2 does.
  float LearningRate() const {
    return static_cast<float>(a2c_.learning_rate.At(RemainingShare(steps(), total_steps_)) *
                              LrMultiplier(a2c_.lr_schedule, ElapsedShare(steps() - 1, total_steps_)));
  }

  void Gather(const LossBlock& block) override { minibatch_.Gather(block); }

  // L = mean A (-log pi) - ent_coef mean H + vf_coef mean (V - R)^2, with d/dV = 2 vf_coef (V - R) / B.
  void Loss(const LossBlock& block) override {
    const auto first = static_cast<std::size_t>(block.first_row), rows = static_cast<std::size_t>(block.rows);
    HeadGradient& head = minibatch_.Head(block, model_.log_std().data());
    float d_neglogp[kBlockRows], d_entropy[kBlockRows];
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    A2cSums& sums = losses_.block(block.index) = {};
    for (std::size_t r = 0; r < rows; ++r) {
      const float advantage = minibatch_.advantages[first + r];
      const float error = block.outputs[1][r] - minibatch_.returns[first + r];
      sums[kA2cPolicy] += advantage * head.neglogp()[r];
      sums[kA2cValue] += error * error;
      sums[kA2cEntropy] += head.entropy()[r];
      d_neglogp[r] = advantage * inverse;
      d_entropy[r] = -a2c_.ent_coef * inverse;
      block.output_gradients[1][r] = a2c_.vf_coef * 2.0f * error * inverse;
    }
    head.Backward(std::span<const float>(d_neglogp, rows), std::span<const float>(d_entropy, rows),
                  block.output_gradients[0], block.extra_gradient.data());
  }

  // Source: Stable Baselines 2.10.2, a2c.py, and Stable Baselines3, a2c.py: the numbers of the update that reports.
  void WriteMetrics(std::span<const std::int32_t> rows) {
    const A2cSums means = losses_.UpdateMeans();
    const double explained = collector_.ExplainedVariance(rows);
    const auto mean_of = [&](const std::vector<float>& column) {
      return Moments(rows, [&](std::size_t row) { return column[row]; }).mean;
    };
    if (a2c_.log_keys == Generation::kStableBaselines2) {
      const double loss = means[kA2cPolicy] - a2c_.ent_coef * means[kA2cEntropy] + a2c_.vf_coef * means[kA2cValue];
      metrics_ = {{"nupdates", "", static_cast<double>(updates_)},
                  {"policy_entropy", "loss/entropy_loss", means[kA2cEntropy], true},
                  {"value_loss", "loss/value_function_loss", means[kA2cValue], true},
                  {"explained_variance", "", explained},
                  {"", "loss/policy_gradient_loss", means[kA2cPolicy]},
                  {"", "loss/loss", loss},
                  {"", "input_info/discounted_rewards", mean_of(collector_.rollout().returns)},
                  {"", "input_info/learning_rate", learning_rate_},
                  {"", "input_info/advantage", mean_of(collector_.rollout().advantages)}};
      return;
    }
    metrics_.clear();
    const auto put = [this](std::string_view name, double number) { metrics_.push_back({name, name, number}); };
    put("train/entropy_loss", -means[kA2cEntropy]);
    put("train/explained_variance", explained);
    put("train/learning_rate", learning_rate_);
    put("train/n_updates", static_cast<double>(updates_));
    put("train/policy_loss", means[kA2cPolicy]);
    if (!model_.log_std().empty()) put("train/std", MeanDeviation(model_.log_std()));
    put("train/value_loss", means[kA2cValue]);
  }

  const BehaviourSpec behaviour_;
  const A2cOptions a2c_;
  const std::string hyperparameters_;  // JSON, for the model file
  const Executor executor_;
  std::int64_t total_steps_;
  ActorCritic model_;
  RolloutCollector collector_;
  Backpropagation backpropagation_;
  GradientStep step_;
  RolloutMinibatch minibatch_;
  LossLog<kA2cTerms> losses_;
  float learning_rate_ = 0;  // of the latest update
  std::int64_t updates_ = 0;
  std::vector<Metric> metrics_;
};

}  // namespace

std::span<const Hyperparameter> A2cTable() {
  static const std::vector<Hyperparameter> table =
      TableOf(kA2cRows, Generation::kStableBaselines3, {"Stable Baselines 2.10.2, A2C", "Stable Baselines3, A2C"});
  return table;
}

Result<std::unique_ptr<Learner>> CreateA2c(const LearnerOptions& options, const HyperparameterSet& values) {
  A2cOptions a2c{};
  CONSAC_RETURN_IF_ERROR(ReadRows(kA2cRows, values, &a2c));
  Result<OnPolicyModel> model = MakeOnPolicyModel(options, a2c, a2c.rollout.n_steps * options.behaviour.slots);
  if (!model.ok()) return model.status();
  return std::unique_ptr<Learner>(std::make_unique<A2c>(options, a2c, std::move(*model), HyperparametersJson(values)));
}

}  // namespace consac::learn
