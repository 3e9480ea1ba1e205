// Soft actor-critic: `sac` as in Stable Baselines3, and with `--preset sb2` as in Stable Baselines 2.10.2 (a network of
// the state's value in place of target critics). From top to bottom: hyperparameters, acting, one gradient step (what
// is drawn, the entropy coefficient, targets, critics, actor), what it tells and keeps. docs/algorithms/sac.md has the
// equations. Source: Haarnoja et al. 2018, arXiv:1801.01290 and 1812.05905; Stable Baselines 2.10.2 sac/sac.py and
// Stable Baselines3 sac.py for the rest.
#include <algorithm>

#include "algo/algorithms.h"
#include "algo/continuous_options.h"
#include "algo/entropy_coefficient.h"
#include "algo/sde_rows.h"
#include "collect/action_minibatch.h"
#include "collect/sums.h"
#include "grad/action_gradient.h"
#include "grad/squashed_samples.h"

namespace consac::learn {
namespace {

struct SacOptions : ContinuousOptions {
  EntropyCoefficientOptions ent_coef;
  TargetEntropy target_entropy;
  bool value_network;  // 2.10.2's
  SdeOptions sde;
  float log_std_init;  // of gSDE
};

using S = SacOptions;
using enum ParameterSource;

constexpr off_policy_rows::Row kSacRounds[] = {
    off_policy_rows::kLearningRate.WithDefaults("3e-4", "3e-4"), off_policy_rows::kReplay[2].WithDefaults("64", "256"),
    off_policy_rows::kTrainFreq.WithDefaults("1", "1"), off_policy_rows::kRounds[1]};
constexpr ParameterRow<S> kSacOwn[] = {
    {"ent_coef", "ent_coef", Into<S, &S::ent_coef>, "auto", "auto", 0, 0, "",
     "weight of the entropy; auto learns it from 1, auto_0.1 from 0.1", kBoth},
    {"target_entropy", "target_entropy", Into<S, &S::target_entropy>, "auto", "auto", 0, 0, "",
     "the entropy that a learned ent_coef aims at; auto: minus the action's elements", kBoth},
    {"target_update_interval", "target_update_interval", Into<S, &S::target_update_interval>, "1", "1", 1, 1e9, "",
     "gradient steps between updates of the target network", kBoth},
    {"value_network", "value_network", Into<S, &S::value_network>, "true", "false", 0, 0, "",
     "targets from a network of the state's value (SB2), or from target critics (SB3)", kConsac},
};
constexpr ParameterRow<S> kSacSde[] = {
    {"use_sde_at_warmup", "use_sde_at_warmup", Into<S, &S::exploration, &ContinuousExplorationOptions::policy_warms_up>,
     "false", "false", 0, 0, "", "with gSDE: the policy acts before learning_starts, too, in place of uniform actions",
     kSb3},
    {"log_std_init", "log_std_init", Into<S, &S::log_std_init>, "-3", "-3", -20, 20, "",
     "with gSDE: starting log standard deviation", kSb3},
    {"clip_mean", "clip_mean", Into<S, &S::sde, &SdeOptions::noise, &StateNoise::clip_mean>, "2", "2", 0, 1e6, "",
     "with gSDE: means are brought within plus and minus this, before tanh; 0: as they are", kSb3},
};
constexpr auto kSacRows = std::tie(kSacRounds, continuous_rows::kCollecting, kSacOwn, kSdeRows<S, &S::sde>, kSacSde,
                                   continuous_rows::kExploration, continuous_rows::kOptimiser,
                                   continuous_rows::kNetwork, off_policy_rows::kHer, off_policy_rows::kNormalise);

constexpr const char* kSacOwnTerms[] = {"loss/policy_loss", "loss/qf1_loss",      "loss/qf2_loss", "loss/value_loss",
                                        "loss/entropy",     "loss/ent_coef_loss", "loss/ent_coef"};
enum SacTerm : std::size_t {
  kSacActor,
  kSacQ1,
  kSacQ2,
  kSacValue,
  kSacEntropy,
  kSacEntCoefLoss,
  kSacEntCoef,
  kSacTermCount
};
constexpr auto kSacTerms = WithFurtherCritics(kSacOwnTerms);

/// See learner.h. An update is one gradient step of everything.
class Sac final : public Learner {
 public:
  Sac(const LearnerOptions& options, const SacOptions& sac, ContinuousModel model, std::string hyperparameters)
      : sac_(sac),
        hyperparameters_(std::move(hyperparameters)),
        total_steps_(options.total_steps),
        collector_(options.behaviour, std::move(model.head), sac.collect, sac.exploration, options.seed, options.ranks),
        target_entropy_(sac.target_entropy.Of(head().raw_size())),  // auto: minus the action's elements
        ent_coef_(sac.ent_coef, sac.adam, options.ranks),
        acting_rng_(options.seed, StreamId("action_sampling")),
        learning_rng_(options.seed, StreamId("sac_samples")),
        actor_(std::move(model.actor), Rng(options.seed, StreamId("actor")), ActorLearnedBy(options, sac, head()),
               options.ranks),
        critics_(std::move(model.critics), Rng(options.seed, StreamId("critics")),
                 LearnedBy(options, sac, sac.batch_size), options.ranks),
        action_gradient_(critics_.network(), head().raw_size(), sac.batch_size, critics_.packed()),
        minibatch_(options.behaviour, {sac.batch_size, sac.n_steps, head().raw_size()}, options.ranks),
        matrices_(head()),
        now_(head(), sac.batch_size, &matrices_),
        next_(head(), sac.batch_size, &matrices_),
        targets_(static_cast<std::size_t>(sac.batch_size)),
        value_targets_(targets_.size()),
        losses_(sac.batch_size, options.ranks, TermsInUse(kSacTermCount, sac.n_critics)) {
    metrics_.reserve(16);
  }

  // Collecting: collect/continuous_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  // What the policy draws, with noise.
  void Act(Batch& batch) override {
    collector_.Act(batch, [&](const ReplayCollector::Acting& acting) {
      head().Select(actor_.Output(acting.features, batch.rows()), actor_.extra().data(), nullptr, batch.rows(),
                    ActionMode::kSample, acting_rng_, acting.raw, nullptr,
                    collector_.ExploreByState(batch.slots, actor_.extra().data()));
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
          ent_coef_.FinishRound(updates_);
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
    CONSAC_RETURN_IF_ERROR(critics_.health());
    return actor_.health().ok() ? ent_coef_.health() : actor_.health();
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
    archive("ent_coef", ent_coef_);
    archive("acting_rng", acting_rng_);
    archive("learning_rng", learning_rng_);
    losses_.Visit(archive);
  }

 private:
  const ActionHead& head() const { return collector_.action_head(); }
  /// Of the critics' network, behind the Q_k.
  std::size_t value_output() const { return static_cast<std::size_t>(sac_.n_critics); }
  static std::size_t QTerm(std::size_t k) { return CriticTerm(k, kSacQ1, kSacTermCount); }

  static LearnedNetworkOptions ActorLearnedBy(const LearnerOptions& options, const SacOptions& sac,
                                              const ActionHead& head) {
    LearnedNetworkOptions learned =
        LearnedBy(options, sac, std::max<std::int64_t>(options.behaviour.slots, sac.batch_size));
    learned.extra = head.log_std_size();
    learned.extra_initial = sac.log_std_init;
    return learned;
  }

  // a~ ~ pi(. | s), and a' ~ pi(. | s_n) of the same policy, by the same matrix where it follows the state. 2.10.2
  // steps the actor by the critics of before.
  bool GradientStepOnDraws() {
    if (!minibatch_.Draw(collector_)) return false;
    losses_.BeginMinibatch();
    learning_rate_ = sac_.LearningRateAt(steps(), total_steps_);
    matrices_.Draw(actor_.extra().data(), learning_rng_);
    Sample(minibatch_.features(), now_);
    const float ent_coef = StepEntropyCoefficient();
    SetTargets(ent_coef);
    if (sac_.value_network) StepActor(ent_coef);
    StepCritics();
    if (!sac_.value_network) StepActor(ent_coef);
    losses_.AddMinibatch(minibatch_.size(), minibatch_.total());
    if (++updates_ % sac_.target_update_interval == 0) critics_.UpdateTarget(sac_.tau);
    return true;
  }

  void Sample(std::span<const float> features, SquashedSamples& samples) {
    samples.Draw(actor_.Output(features.data(), minibatch_.size()), minibatch_.size(), learning_rng_);
  }

  // L = -log ent_coef mean (log pi(a~ | s) + target entropy); returns the coefficient of before the step.
  float StepEntropyCoefficient() {
    const float ent_coef = ent_coef_.coefficient();
    double surplus = 0.0;
    Sums<kSacTerms>& sums = losses_.block(0);
    for (std::int64_t i = 0; i < minibatch_.size(); ++i) {
      surplus += static_cast<double>(now_.log_probabilities()[static_cast<std::size_t>(i)]) + target_entropy_;
      sums[kSacEntropy] += now_.NormalEntropy(i);
    }
    sums[kSacEntCoef] = static_cast<double>(ent_coef) * static_cast<double>(minibatch_.size());
    sums[kSacEntCoefLoss] = ent_coef_.Loss(surplus);
    ent_coef_.Step(surplus / static_cast<double>(minibatch_.total()), learning_rate_);
    return ent_coef;
  }

  // y = r_0 + ... + gamma^(n-1) r_(n-1) + gamma^n (min_k Q'_k(s_n, a') - ent_coef log pi(a' | s_n)); with the value
  // network gamma^n V'(s_n). Nothing follows a terminal state.
  void SetTargets(float ent_coef) {
    SlicedEvaluator& target = critics_.Target();
    const float* inputs[] = {minibatch_.next_features().data(), next_.actions().data()};
    if (sac_.value_network) {
      target.ForwardTo(value_output(), inputs, minibatch_.size());
    } else {
      Sample(minibatch_.next_features(), next_);
      target.Forward(inputs, minibatch_.size());
    }
    for (std::size_t i = 0; i < targets_.size(); ++i) {
      const float value = sac_.value_network
                              ? target.output(value_output())[i]
                              : LeastValue(target, sac_.n_critics, i) - ent_coef * next_.log_probabilities()[i];
      targets_[i] = minibatch_.rewards()[i] + static_cast<float>(minibatch_.discounts()[i]) * value;
    }
  }

  // L = sum_k mean (Q_k(s, a) - y)^2 / 2, and mean (V(s) - min_k Q_k(s, a~) + ent_coef log pi(a~ | s))^2 / 2.
  void StepCritics() {
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    LossOf loss([this](const LossBlock& block) { minibatch_.Gather(block, minibatch_.actions()); },
                [this, inverse](const LossBlock& block) {
                  for (std::size_t k = 0; k < block.outputs.size(); ++k) {
                    const bool of_state = k == value_output();
                    const float* targets = (of_state ? value_targets_ : targets_).data() + block.first_row;
                    double& sum = losses_.block(block.index)[of_state ? kSacValue : QTerm(k)];
                    for (std::int64_t r = 0; r < block.rows; ++r) {
                      const float error = block.outputs[k][r] - targets[r];
                      sum += 0.5 * static_cast<double>(error) * static_cast<double>(error);
                      block.output_gradients[k][r] = error * inverse;
                    }
                  }
                });
    critics_.Step(critics_.Gradient(minibatch_.size(), loss), learning_rate_);
  }

  // L = mean (ent_coef log pi(a~ | s) - min_k Q_k(s, a~)), with Q_1 for the least where there is a value network: first
  // dL/da~ through the critics, held fast, then through the actor.
  void StepActor(float ent_coef) {
    const float inverse = 1.0f / static_cast<float>(minibatch_.total());
    const auto judge = [this, ent_coef, inverse](const LossBlock& block) {
      for (float* gradient : block.output_gradients) std::fill_n(gradient, block.rows, 0.0f);
      double& sum = losses_.block(block.index)[kSacActor];
      for (std::int64_t r = 0; r < block.rows; ++r) {
        const auto i = static_cast<std::size_t>(block.first_row + r);
        const float cost = ent_coef * now_.log_probabilities()[i];
        std::size_t least = 0;
        for (std::size_t k = 1; k < value_output(); ++k)
          if (block.outputs[k][r] < block.outputs[least][r]) least = k;
        const std::size_t judging = sac_.value_network ? 0 : least;
        value_targets_[i] = block.outputs[least][r] - cost;
        sum += static_cast<double>(cost - block.outputs[judging][r]);
        block.output_gradients[judging][r] = -inverse;
      }
    };
    action_gradient_.Run(
        critics_.Loaded(), minibatch_.size(), critics_.executor(),
        [this](const LossBlock& block) { minibatch_.Gather(block, now_.actions()); }, judge);
    LossOf loss([this](const LossBlock& block) { minibatch_.Gather(block); },
                [this, ent_coef, inverse](const LossBlock& block) {
                  for (std::int64_t r = 0; r < block.rows; ++r) {
                    const std::int64_t row = block.first_row + r;
                    now_.Backward(row, action_gradient_.row(row), ent_coef * inverse,
                                  block.output_gradients[0] + r * head().size(), block.extra_gradient.data());
                  }
                });
    actor_.Step(actor_.Gradient(minibatch_.size(), loss), learning_rate_);
  }

  // Source: Stable Baselines 2.10.2, sac/sac.py, and Stable Baselines3, off_policy_algorithm.py and sac.py.
  void WriteMetrics() {
    BeginMetrics(sac_, collector_.episodes(), {learning_rate_, updates_}, &metrics_);
    if (updates_ == 0) return;
    const Sums<kSacTerms> means = losses_.UpdateMeans();
    if (sac_.log_keys == Generation::kStableBaselines2) {
      for (std::size_t i = 0; i < TermsInUse(kSacTermCount, sac_.n_critics); ++i) {
        const bool absent = (i == kSacValue && !sac_.value_network) || (i == kSacQ2 && sac_.n_critics < 2);
        if (!absent) metrics_.push_back(LossMetric(kSacTerms[i], means[i]));
      }
      return;
    }
    const auto put = [this](std::string_view name, double number) { metrics_.push_back({name, name, number}); };
    put("train/actor_loss", means[kSacActor]);
    double critic_loss = 0.0;
    for (std::size_t k = 0; k < value_output(); ++k) critic_loss += means[QTerm(k)];
    put("train/critic_loss", critic_loss);
    put("train/ent_coef", means[kSacEntCoef]);
    if (sac_.sde.use_sde) put("train/std", matrices_.MeanDeviation());
    if (ent_coef_.learned()) put("train/ent_coef_loss", means[kSacEntCoefLoss]);
  }

  const SacOptions sac_;
  const std::string hyperparameters_;  // JSON, for the model file
  std::int64_t total_steps_;
  ContinuousCollector collector_;
  const double target_entropy_;
  EntropyCoefficient ent_coef_;
  Rng acting_rng_, learning_rng_;
  LearnedNetwork actor_, critics_;
  ActionGradient action_gradient_;  // dL/da~
  ActionMinibatch minibatch_;
  StateMatrices matrices_;                      // of the latest gradient step, where actions explore by their state
  SquashedSamples now_, next_;                  // a~ and a'
  std::vector<float> targets_, value_targets_;  // [B] of Q and of V
  LossLog<kSacTerms> losses_;                   // of the round under way, or the latest
  float learning_rate_ = 0;                     // of the latest update
  std::int64_t updates_ = 0;
  std::vector<Metric> metrics_;
};

}  // namespace

std::span<const Hyperparameter> SacTable() {
  static const std::vector<Hyperparameter> table =
      TableOf(kSacRows, Generation::kStableBaselines3, {"Stable Baselines 2.10.2, SAC", "Stable Baselines3, SAC"});
  return table;
}

Result<std::unique_ptr<Learner>> CreateSac(const LearnerOptions& options, const HyperparameterSet& values) {
  SacOptions sac{};
  CONSAC_RETURN_IF_ERROR(ReadOffPolicyRows(kSacRows, values, options, &sac));
  sac.exploration.policy_warms_up = sac.exploration.policy_warms_up && sac.sde.use_sde;
  const ContinuousWants wants{.algorithm = "sac",
                              .head = sac.sde.use_sde ? "squashed_sde_gaussian" : "squashed_gaussian",
                              .state_value = sac.value_network,
                              .noise = sac.sde.noise};
  Result<ContinuousModel> model = MakeContinuousModel(options, sac, wants);
  if (!model.ok()) return model.status();
  return std::unique_ptr<Learner>(std::make_unique<Sac>(options, sac, std::move(*model), HyperparametersJson(values)));
}

}  // namespace consac::learn
