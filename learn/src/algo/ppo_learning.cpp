// PPO's second half, from top to bottom: advantages, epochs of minibatches, the clipped loss, one optimiser step each.
// docs/algorithms/ppo.md has the equations.
// Source: Schulman et al. 2017, arXiv:1707.06347, eq. 7 and 9; Stable Baselines 2.10.2 ppo2.py and Stable Baselines3
// ppo.py for everything that the paper leaves open (see ppo_tables.cpp for the switches).
#include <algorithm>
#include <cmath>
#include <cstring>

#include "algo/moments.h"
#include "algo/ppo_learner.h"
#include "algo/ppo_loss.h"
#include "consac/nn/kernels.h"

namespace consac::learn {
namespace {

constexpr const char* kAdvice = "lower the learning rate, or check the world's rewards and observations";

}  // namespace

bool Ppo::Learn(const LearnBudget& budget) {
  if (!LearningDue()) return false;
  if (!updating_) BeginUpdate();
  for (std::int64_t step = 0; step < budget.gradient_steps; ++step) {
    if (minibatch_begin_ == 0) BeginEpoch();
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
  ValuesOf(work_features_.data(), behaviour_.slots, last_values_.data());
  EstimateAdvantages(rollout_, last_values_, ppo_.gamma, ppo_.gae_lambda);

  rows_ = rollout_.ListRows(order_);
  const double remaining = Remaining();
  learning_rate_ = static_cast<float>(ppo_.learning_rate.At(remaining));
  clip_range_ = static_cast<float>(ppo_.clip_range.At(remaining));
  const bool follows = ppo_.clip_range_vf.absent && ppo_.value_clip_follows;
  clip_range_vf_ = follows                     ? clip_range_
                   : ppo_.clip_range_vf.absent ? -1.0f
                                               : static_cast<float>(ppo_.clip_range_vf.At(remaining));
  updating_ = true;
  stopped_ = false;
  epoch_ = minibatch_begin_ = gradient_steps_ = skipped_steps_ = 0;
  update_sums_ = {};
}

void Ppo::BeginEpoch() {
  shuffle_rng_.Shuffle(std::span(order_).first(static_cast<std::size_t>(rows_)));
  epoch_sums_ = {};
  epoch_gradient_steps_ = 0;
  ++epochs_;
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
  epoch_sums_.Add(sums, 1.0);
  last_sums_ = sums;
  ++gradient_steps_;
  ++epoch_gradient_steps_;
  if (ppo_.target_kl > 0.0 && sums.kl > 1.5 * ppo_.target_kl) return false;

  const std::span<const float> gradient = backpropagation_.gradient();
  const double norm = GlobalNorm(gradient);
  if (!std::isfinite(norm)) {
    ++skipped_steps_;
    return true;
  }
  adam_.Step(parameters_, gradient, learning_rate_, ClipFactor(norm, ppo_.max_grad_norm, ppo_.adam.form));
  return true;
}

void Ppo::FinishUpdate() {
  ++updates_;
  WriteMetrics();
  if (skipped_steps_ == gradient_steps_) {
    health_ = {StatusCode::kNonFinite, "no gradient of update " + std::to_string(updates_) +
                                           " was finite, so nothing more can be learned; " + kAdvice};
  } else if (skipped_steps_ > 0) {
    Log(LogLevel::kWarning, std::to_string(skipped_steps_) + " of " + std::to_string(gradient_steps_) +
                                " gradients of update " + std::to_string(updates_) +
                                " were not finite and were skipped; " + kAdvice);
  }
  evaluator_.Load(std::span(parameters_).first(static_cast<std::size_t>(network_.parameter_count())));
  rollout_.Restart();
  updating_ = false;
}

}  // namespace consac::learn
