// Proximal policy optimisation, from top to bottom: act, record, then per update advantages, epochs of minibatches,
// the clipped loss, one optimiser step each. docs/algorithms/ppo.md has the equations.
// Source: Schulman et al. 2017, arXiv:1707.06347, eq. 7 and 9; Stable Baselines 2.10.2 ppo2.py and Stable Baselines3
// ppo.py for everything that the paper leaves open (see ppo_tables.cpp for the switches).

#include "algo/ppo.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "algo/head_gradient.h"
#include "algo/ppo_loss.h"
#include "consac/base/text.h"
#include "consac/learn/buffer/rollout.h"
#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/kernels.h"

namespace consac::learn {
namespace {

/// Sums over the rows of one block, and over the minibatches of an update.
struct LossSums {
  double policy = 0, value = 0, entropy = 0, kl = 0, clipped = 0;
  void Add(const LossSums& other, double weight) {
    policy += weight * other.policy;
    value += weight * other.value;
    entropy += weight * other.entropy;
    kl += weight * other.kl;
    clipped += weight * other.clipped;
  }
  void Visit(Archive& archive) {
    archive("policy", policy);
    archive("value", value);
    archive("entropy", entropy);
    archive("kl", kl);
    archive("clipped", clipped);
  }
};

/// Mean and variance of the numbers at `rows`, population form, in float64.
struct Moments {
  double mean = 0, variance = 0;
  template <class Read>
  Moments(std::span<const std::int32_t> rows, Read&& read) {
    const auto n = static_cast<double>(rows.size());
    for (const std::int32_t row : rows) mean += read(static_cast<std::size_t>(row));
    mean /= n;
    for (const std::int32_t row : rows) {
      const double deviation = read(static_cast<std::size_t>(row)) - mean;
      variance += deviation * deviation;
    }
    variance /= n;
  }
};

class Ppo final : public Learner, private BlockLoss {
 public:
  Ppo(const LearnerOptions& options, const PpoOptions& ppo, nn::Network network, std::string hyperparameters);

  Batch Stage(std::span<const std::int32_t> slots) override;
  void Begin(const Batch& batch) override;
  void Act(Batch& batch) override;
  void Record(const Batch& batch) override;
  bool LearningDue() const override { return rollout_.full(); }
  bool Learn(const LearnBudget& budget) override;
  std::int64_t steps() const override { return steps_; }
  std::int64_t updates() const override { return updates_; }
  std::int64_t steps_per_update() const override { return ppo_.n_steps * behaviour_.slots; }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  PolicyData Snapshot() const override;
  void Visit(Archive& archive) override;

 private:
  // Acting and collecting.
  void Encode(const std::byte* observations, std::int64_t rows, float* features);
  void EncodeNormalised(const std::byte* observations, std::int64_t rows, float* features);
  void RefreshNormaliser();
  void NormaliseRewards(const Batch& batch);
  void BootstrapTruncated(const Batch& batch);
  void ValuesOf(const float* features, std::int64_t rows, float* values);

  // Learning.
  void BeginUpdate();
  void BeginMinibatch();
  bool OptimiserStep();
  void FinishUpdate();
  void Gather(const LossBlock& block) override;
  void Loss(const LossBlock& block) override;
  double Remaining() const;
  void WriteMetrics();

  std::span<const std::int32_t> minibatch() const {
    return std::span(order_).subspan(static_cast<std::size_t>(minibatch_begin_),
                                     static_cast<std::size_t>(minibatch_rows_));
  }
  std::span<float> log_std() {
    return std::span(parameters_).subspan(static_cast<std::size_t>(network_.parameter_count()));
  }

  const BehaviourSpec behaviour_;
  const PpoOptions ppo_;
  const nn::Network network_;
  const std::string hyperparameters_;  // JSON, for the model file
  const Executor executor_;
  const std::int64_t features_, raw_size_, mask_bytes_;
  std::int64_t total_steps_;

  std::vector<float> parameters_;  // network, then log_std
  nn::Evaluator evaluator_;        // packed copy that acts
  Backpropagation backpropagation_;
  Adam adam_;
  Rollout rollout_;
  Rng action_rng_, shuffle_rng_;

  RunningMoments observation_moments_, return_moments_;
  ObservationNormaliser normaliser_;
  std::vector<float> discounted_;  // [N] running discounted return per slot, for reward scaling

  // The staged step, until Record.
  std::vector<float> step_features_;                              // [N, F] network inputs
  std::vector<float> step_raw_;                                   // [N, raw]
  std::vector<float> step_values_, step_neglogp_, step_rewards_;  // [N]
  std::vector<float> work_features_;                              // [N, F] of next and final observations

  std::vector<float> slab_features_;  // [T * N, F] network inputs as they were acted upon

  // The update under way.
  bool updating_ = false, stopped_ = false, skipped_ = false;
  std::int64_t epoch_ = 0, minibatch_begin_ = 0, minibatch_rows_ = 0, rows_ = 0, gradient_steps_ = 0;
  float learning_rate_ = 0, clip_range_ = 0, clip_range_vf_ = 0;  // of this update; negative clip_range_vf: off
  std::vector<std::int32_t> order_;                               // [T * N] slab rows, shuffled each epoch
  LossSums update_sums_;

  // The minibatch under way, gathered.
  std::vector<float> mb_advantages_, mb_returns_, mb_values_, mb_neglogp_;  // [B]
  std::vector<float> mb_raw_;                                               // [B, raw]
  std::vector<std::uint8_t> mb_masks_;                                      // [B, mask_bytes]
  std::vector<HeadGradient> heads_;                                         // [blocks]
  std::vector<LossSums> block_sums_;                                        // [blocks]

  std::int64_t steps_ = 0, updates_ = 0, total_gradient_steps_ = 0;
  std::vector<Metric> metrics_;
};

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
  for (std::vector<float>* column : {&step_values_, &step_neglogp_, &step_rewards_}) column->resize(slots);
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

// ---- acting and collecting

Batch Ppo::Stage(std::span<const std::int32_t> slots) {
  CONSAC_ASSERT(!LearningDue());
  return rollout_.Stage(slots);
}

void Ppo::Encode(const std::byte* observations, std::int64_t rows, float* features) {
  EncodeFeatures(behaviour_.observation_layout, observations, rows, features);
}

void Ppo::EncodeNormalised(const std::byte* observations, std::int64_t rows, float* features) {
  Encode(observations, rows, features);
  if (ppo_.norm_obs) normaliser_.Apply(features, rows);
}

// In place, so that a step never allocates once the vectors have their size.
void Ppo::RefreshNormaliser() {
  normaliser_.clip = static_cast<float>(ppo_.clip_obs);
  normaliser_.mean.resize(observation_moments_.mean.size());
  normaliser_.scale.resize(observation_moments_.mean.size());
  for (std::size_t d = 0; d < normaliser_.mean.size(); ++d) {
    normaliser_.mean[d] = static_cast<float>(observation_moments_.mean[d]);
    normaliser_.scale[d] = static_cast<float>(1.0 / std::sqrt(observation_moments_.variance[d] + ppo_.norm_epsilon));
  }
}

void Ppo::ValuesOf(const float* features, std::int64_t rows, float* values) {
  evaluator_.ForwardTo(1, std::span<const float* const>(&features, 1), rows);
  std::copy_n(evaluator_.output(1), rows, values);
}

void Ppo::Begin(const Batch& batch) {
  // A slot that begins again in the middle of a rollout has lost its episode: what it had is cut there.
  for (const std::int32_t slot : batch.slots) {
    discounted_[static_cast<std::size_t>(slot)] = 0.0f;
    if (rollout_.length(slot) == 0) continue;
    const auto last = static_cast<std::size_t>(rollout_.RowOf(slot) - behaviour_.slots);
    if (rollout_.ended[last] != 0) continue;
    float value = 0.0f;
    EncodeNormalised(rollout_.observations(rollout_.RowOf(slot)), 1, work_features_.data());
    ValuesOf(work_features_.data(), 1, &value);
    rollout_.rewards[last] += static_cast<float>(ppo_.gamma) * value;
    rollout_.ended[last] = 1;
  }
  rollout_.Begin(batch);
  if (!ppo_.norm_obs) return;
  Encode(batch.next_observations, batch.rows(), work_features_.data());
  observation_moments_.Update(work_features_.data(), batch.rows());
  RefreshNormaliser();
}

void Ppo::Act(Batch& batch) {
  const std::int64_t rows = batch.rows();
  EncodeNormalised(batch.observations, rows, step_features_.data());
  const float* input = step_features_.data();
  evaluator_.Forward(std::span<const float* const>(&input, 1), rows);
  const float* head = evaluator_.output(0);
  std::copy_n(evaluator_.output(1), rows, step_values_.data());
  SelectActions(behaviour_.action_layout, head, log_std().data(), batch.action_masks, rows, ActionMode::kSample,
                action_rng_, step_raw_.data(), step_neglogp_.data());
  for (std::int64_t i = 0; i < rows; ++i) step_neglogp_[static_cast<std::size_t>(i)] *= -1.0f;
  WriteActions(behaviour_.action_layout, step_raw_.data(), rows, batch.actions);
}

// VecNormalize: rewards are divided by the deviation of the running discounted return; no mean is taken off.
void Ppo::NormaliseRewards(const Batch& batch) {
  const auto gamma = static_cast<float>(ppo_.gamma);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    float& discounted = discounted_[static_cast<std::size_t>(batch.slots[i])];
    discounted = discounted * gamma + batch.rewards[i];
    step_rewards_[i] = discounted;
  }
  return_moments_.Update(step_rewards_.data(), batch.rows());
  const double scale = 1.0 / std::sqrt(return_moments_.variance[0] + ppo_.norm_epsilon);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    step_rewards_[i] = static_cast<float>(std::clamp(batch.rewards[i] * scale, -ppo_.clip_reward, ppo_.clip_reward));
    if ((batch.terminated[i] | batch.truncated[i]) != 0) discounted_[static_cast<std::size_t>(batch.slots[i])] = 0.0f;
  }
}

// An episode that was cut goes on in the value estimate: r += gamma V(final observation).
void Ppo::BootstrapTruncated(const Batch& batch) {
  const std::size_t row_bytes = behaviour_.observation_layout.row_bytes;
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    if (batch.truncated[i] == 0 || batch.terminated[i] != 0) continue;
    float value = 0.0f;
    EncodeNormalised(batch.final_observations + i * row_bytes, 1, work_features_.data());
    ValuesOf(work_features_.data(), 1, &value);
    step_rewards_[i] += static_cast<float>(ppo_.gamma) * value;
  }
}

void Ppo::Record(const Batch& batch) {
  const std::int64_t rows = batch.rows();
  if (ppo_.norm_obs) {
    Encode(batch.next_observations, rows, work_features_.data());
    observation_moments_.Update(work_features_.data(), rows);
    RefreshNormaliser();
  }
  if (ppo_.norm_reward)
    NormaliseRewards(batch);
  else
    std::copy_n(batch.rewards, rows, step_rewards_.data());
  if (ppo_.bootstrap_truncation) BootstrapTruncated(batch);

  const auto features = static_cast<std::size_t>(features_), raw = static_cast<std::size_t>(raw_size_);
  for (std::size_t i = 0; i < batch.slots.size(); ++i) {
    const auto row = static_cast<std::size_t>(rollout_.RowOf(batch.slots[i]));
    std::copy_n(step_features_.data() + i * features, features, slab_features_.data() + row * features);
    std::copy_n(step_raw_.data() + i * raw, raw, rollout_.raw_actions.data() + row * raw);
    rollout_.values[row] = step_values_[i];
    rollout_.neglogp[row] = step_neglogp_[i];
    rollout_.rewards[row] = step_rewards_[i];
    rollout_.ended[row] = batch.terminated[i] | batch.truncated[i];
  }
  rollout_.Commit(batch);
  steps_ += rows;
}

// ---- learning

bool Ppo::Learn(const LearnBudget& budget) {
  if (!LearningDue()) return false;
  if (!updating_) BeginUpdate();
  for (std::int64_t step = 0; step < budget.gradient_steps; ++step) {
    if (minibatch_begin_ == 0) shuffle_rng_.Shuffle(std::span(order_).first(static_cast<std::size_t>(rows_)));
    BeginMinibatch();
    backpropagation_.Run(parameters_, minibatch_rows_, executor_, *this);
    stopped_ = !OptimiserStep();
    minibatch_begin_ += minibatch_rows_;
    if (minibatch_begin_ >= rows_) {
      minibatch_begin_ = 0;
      ++epoch_;
    }
    if (stopped_ || epoch_ == ppo_.n_epochs) {
      FinishUpdate();
      return false;
    }
  }
  return true;
}

// Share of the training that is left. SB2 counts updates from the start of each, SB3 counts steps after collecting.
double Ppo::Remaining() const {
  const auto total = static_cast<double>(std::max(total_steps_, std::int64_t{1}));
  if (ppo_.generation == Generation::kStableBaselines3) return std::max(0.0, 1.0 - static_cast<double>(steps_) / total);
  const double planned = std::max(1.0, std::floor(total / static_cast<double>(steps_per_update())));
  return std::max(0.0, 1.0 - static_cast<double>(updates_) / planned);
}

void Ppo::BeginUpdate() {
  for (std::int32_t slot = 0; slot < behaviour_.slots; ++slot) {
    Encode(rollout_.observations(rollout_.RowOf(slot)), 1, work_features_.data() + slot * features_);
  }
  if (ppo_.norm_obs) normaliser_.Apply(work_features_.data(), behaviour_.slots);
  ValuesOf(work_features_.data(), behaviour_.slots, step_values_.data());
  EstimateAdvantages(rollout_, step_values_, ppo_.gamma, ppo_.gae_lambda);

  rows_ = rollout_.ListRows(order_);
  const double remaining = Remaining();
  learning_rate_ = static_cast<float>(ppo_.learning_rate.At(remaining));
  clip_range_ = static_cast<float>(ppo_.clip_range.At(remaining));
  const bool follows = ppo_.clip_range_vf.absent && ppo_.value_clip_follows;
  clip_range_vf_ = follows                     ? clip_range_
                   : ppo_.clip_range_vf.absent ? -1.0f
                                               : static_cast<float>(ppo_.clip_range_vf.At(remaining));
  updating_ = true;
  stopped_ = skipped_ = false;
  epoch_ = minibatch_begin_ = gradient_steps_ = 0;
  update_sums_ = {};
}

// Cuts the next minibatch and standardises its advantages.
void Ppo::BeginMinibatch() {
  const std::int64_t size =
      ppo_.n_minibatches > 0 ? std::max<std::int64_t>(1, rows_ / ppo_.n_minibatches) : ppo_.batch_size;
  minibatch_rows_ = std::min(size, rows_ - minibatch_begin_);
  double mean = 0.0, inverse = 1.0;
  if (ppo_.normalize_advantage && minibatch_rows_ > 1) {
    const Moments moments(minibatch(), [this](std::size_t row) { return rollout_.advantages[row]; });
    const auto n = static_cast<double>(minibatch_rows_);
    mean = moments.mean;
    inverse = 1.0 / (std::sqrt(moments.variance * (ppo_.sample_std ? n / (n - 1.0) : 1.0)) + 1e-8);
  }
  std::size_t i = 0;
  for (const std::int32_t row : minibatch()) {
    mb_advantages_[i++] = static_cast<float>((rollout_.advantages[static_cast<std::size_t>(row)] - mean) * inverse);
  }
}

void Ppo::Gather(const LossBlock& block) {
  const auto features = static_cast<std::size_t>(features_), raw = static_cast<std::size_t>(raw_size_);
  const auto masks = static_cast<std::size_t>(mask_bytes_);
  for (std::int64_t r = 0; r < block.rows; ++r) {
    const auto to = static_cast<std::size_t>(block.first_row + r);
    const auto row = static_cast<std::size_t>(order_[static_cast<std::size_t>(minibatch_begin_) + to]);
    std::copy_n(slab_features_.data() + row * features, features,
                block.inputs[0] + static_cast<std::size_t>(r) * features);
    std::copy_n(rollout_.raw_actions.data() + row * raw, raw, mb_raw_.data() + to * raw);
    if (masks > 0) std::memcpy(mb_masks_.data() + to * masks, rollout_.masks(static_cast<std::int64_t>(row)), masks);
    mb_returns_[to] = rollout_.returns[row];
    mb_values_[to] = rollout_.values[row];
    mb_neglogp_[to] = rollout_.neglogp[row];
  }
}

// L = mean max(-A rho, -A clip(rho)) - ent_coef mean H + vf_coef L_V, row by row (ppo_loss.h) and through the head.
void Ppo::Loss(const LossBlock& block) {
  const auto first = static_cast<std::size_t>(block.first_row), rows = static_cast<std::size_t>(block.rows);
  HeadGradient& head = heads_[static_cast<std::size_t>(block.index)];
  const std::uint8_t* masks =
      mask_bytes_ > 0 ? mb_masks_.data() + first * static_cast<std::size_t>(mask_bytes_) : nullptr;
  head.Forward(block.rows, block.outputs[0], log_std().data(), masks,
               mb_raw_.data() + first * static_cast<std::size_t>(raw_size_));

  float ratio[kBlockRows], d_neglogp[kBlockRows], d_entropy[kBlockRows];
  for (std::size_t r = 0; r < rows; ++r) ratio[r] = mb_neglogp_[first + r] - head.neglogp()[r];
  nn::Exp(std::span<const float>(ratio, rows), std::span<float>(ratio, rows));

  const PpoLossForm form{clip_range_, clip_range_vf_, ppo_.vf_coef, ppo_.halved_value_loss, ppo_.squared_kl};
  const float inverse = 1.0f / static_cast<float>(minibatch_rows_);
  LossSums sums;
  for (std::size_t r = 0; r < rows; ++r) {
    const std::size_t i = first + r;
    const PpoLossTerms terms = PpoLossOf(form, {mb_advantages_[i], mb_returns_[i], mb_values_[i], mb_neglogp_[i],
                                                block.outputs[1][r], head.neglogp()[r], ratio[r]});
    sums.policy += terms.policy;
    sums.value += terms.value;
    sums.entropy += head.entropy()[r];
    sums.kl += terms.kl;
    sums.clipped += terms.clipped;
    d_neglogp[r] = terms.d_neglogp * inverse;
    d_entropy[r] = -ppo_.ent_coef * inverse;
    block.output_gradients[1][r] = terms.d_value * inverse;
  }
  head.Backward(std::span<const float>(d_neglogp, rows), std::span<const float>(d_entropy, rows),
                block.output_gradients[0], block.extra_gradient.data());
  block_sums_[static_cast<std::size_t>(block.index)] = sums;
}

// One clipped Adam step; false when target_kl ends the update before it.
bool Ppo::OptimiserStep() {
  LossSums sums;
  const std::int64_t blocks = (minibatch_rows_ + kBlockRows - 1) / kBlockRows;
  for (std::int64_t b = 0; b < blocks; ++b)
    sums.Add(block_sums_[static_cast<std::size_t>(b)], 1.0 / static_cast<double>(minibatch_rows_));
  update_sums_.Add(sums, 1.0);
  ++gradient_steps_;
  if (ppo_.target_kl > 0.0 && sums.kl > 1.5 * ppo_.target_kl) return false;

  const std::span<const float> gradient = backpropagation_.gradient();
  const double norm = GlobalNorm(gradient);
  if (!std::isfinite(norm)) {
    if (!skipped_)
      Log(LogLevel::kWarning,
          "a gradient is not finite; its optimiser step is skipped (lower the learning rate, or check rewards)");
    skipped_ = true;
    return true;
  }
  adam_.Step(parameters_, gradient, learning_rate_, ClipFactor(norm, ppo_.max_grad_norm, ppo_.adam.form));
  ++total_gradient_steps_;
  return true;
}

void Ppo::FinishUpdate() {
  ++updates_;
  WriteMetrics();
  evaluator_.Load(std::span(parameters_).first(static_cast<std::size_t>(network_.parameter_count())));
  rollout_.Restart();
  updating_ = false;
}

void Ppo::WriteMetrics() {
  const double n = static_cast<double>(gradient_steps_);
  const double policy = update_sums_.policy / n, value = update_sums_.value / n, entropy = update_sums_.entropy / n;
  const double kl = update_sums_.kl / n, clipped = update_sums_.clipped / n;
  const double loss = policy - ppo_.ent_coef * entropy + ppo_.vf_coef * value;
  const auto rows = std::span<const std::int32_t>(order_).first(static_cast<std::size_t>(rows_));
  const Moments returns(rows, [this](std::size_t row) { return rollout_.returns[row]; });
  const Moments errors(rows, [this](std::size_t row) { return rollout_.returns[row] - rollout_.values[row]; });
  const double explained =
      returns.variance == 0.0 ? std::numeric_limits<double>::quiet_NaN() : 1.0 - errors.variance / returns.variance;
  const Moments advantages(rows, [this](std::size_t row) { return rollout_.advantages[row]; });

  metrics_.clear();
  if (ppo_.generation == Generation::kStableBaselines2) {
    const Moments neglogp(rows, [this](std::size_t row) { return rollout_.neglogp[row]; });
    const Moments values(rows, [this](std::size_t row) { return rollout_.values[row]; });
    metrics_.push_back({"policy_loss", "loss/policy_gradient_loss", policy, true});
    metrics_.push_back({"value_loss", "loss/value_function_loss", value, true});
    metrics_.push_back({"policy_entropy", "loss/entropy_loss", entropy, true});
    metrics_.push_back({"approxkl", "loss/approximate_kullback-leibler", kl, true});
    metrics_.push_back({"clipfrac", "loss/clip_factor", clipped, true});
    metrics_.push_back({"", "loss/loss", loss});
    metrics_.push_back({"explained_variance", "", explained});
    metrics_.push_back({"", "input_info/discounted_rewards", returns.mean});
    metrics_.push_back({"", "input_info/learning_rate", learning_rate_});
    metrics_.push_back({"", "input_info/advantage", advantages.mean});
    metrics_.push_back({"", "input_info/clip_range", clip_range_});
    if (clip_range_vf_ >= 0.0f) metrics_.push_back({"", "input_info/clip_range_vf", clip_range_vf_});
    metrics_.push_back({"", "input_info/old_neglog_action_probability", neglogp.mean});
    metrics_.push_back({"", "input_info/old_value_pred", values.mean});
    return;
  }
  const auto put = [this](std::string_view name, double number) { metrics_.push_back({name, name, number}); };
  put("train/approx_kl", kl);
  put("train/clip_fraction", clipped);
  put("train/clip_range", clip_range_);
  if (clip_range_vf_ >= 0.0f) put("train/clip_range_vf", clip_range_vf_);
  put("train/entropy_loss", -entropy);
  put("train/explained_variance", explained);
  put("train/learning_rate", learning_rate_);
  put("train/loss", loss);
  put("train/n_updates", static_cast<double>(updates_ * ppo_.n_epochs));
  put("train/policy_gradient_loss", policy);
  if (!log_std().empty()) {
    double deviation = 0.0;
    for (const float value_of : log_std()) deviation += std::exp(value_of);
    put("train/std", deviation / static_cast<double>(log_std().size()));
  }
  put("train/value_loss", value);
}

PolicyData Ppo::Snapshot() const {
  PolicyData data;
  data.behaviour = behaviour_.name;
  data.observation_space = behaviour_.observation_space;
  data.action_space = behaviour_.action_space;
  data.network = network_.spec();
  const auto network_end = parameters_.begin() + static_cast<std::ptrdiff_t>(network_.parameter_count());
  data.parameters.assign(parameters_.begin(), network_end);
  data.log_std.assign(network_end, parameters_.end());
  if (ppo_.norm_obs) data.normaliser = normaliser_;
  data.training_json = "{\"hyperparameters\": " + hyperparameters_ + ", \"steps\": " + std::to_string(steps_) +
                       ", \"updates\": " + std::to_string(updates_) + "}";
  return data;
}

void Ppo::Visit(Archive& archive) {
  archive("parameters", std::span<float>(parameters_));
  archive("adam", adam_);
  archive("rollout", rollout_);
  archive("action_rng", action_rng_);
  archive("shuffle_rng", shuffle_rng_);
  archive("observation_moments", observation_moments_);
  archive("return_moments", return_moments_);
  archive("discounted", std::span<float>(discounted_));
  archive("slab_features", std::span<float>(slab_features_));
  archive("updating", updating_);
  archive("skipped", skipped_);
  archive("epoch", epoch_);
  archive("minibatch_begin", minibatch_begin_);
  archive("rows", rows_);
  archive("gradient_steps", gradient_steps_);
  archive("learning_rate", learning_rate_);
  archive("clip_range", clip_range_);
  archive("clip_range_vf", clip_range_vf_);
  archive("order", std::span<std::int32_t>(order_));
  archive("update_sums", update_sums_);
  archive("steps", steps_);
  archive("updates", updates_);
  archive("total_gradient_steps", total_gradient_steps_);
  if (!archive.loading()) return;
  if (ppo_.norm_obs) RefreshNormaliser();
  evaluator_.Load(std::span(parameters_).first(static_cast<std::size_t>(network_.parameter_count())));
}

std::string HyperparametersJson(const HyperparameterSet& values) {
  nlohmann::json json = nlohmann::json::object();
  for (const Hyperparameter& row : values.table()) json[row.name] = values.Text(row.name);
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
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
  ppo->network.observation_size = options.behaviour.observation_layout.feature_count;
  ppo->network.action_size = HeadSize(options.behaviour.action_layout);
  Result<nn::Network> network = nn::Network::Create(nn::ActorCritic(ppo->network));
  if (!network.ok()) return network.status();
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
