// What the learner tells and keeps: metrics under Stable Baselines' names, the acting model, its state.
#include <algorithm>
#include <cmath>
#include <limits>

#include "algo/moments.h"
#include "algo/ppo_learner.h"

namespace consac::learn {

void Ppo::WriteMetrics() {
  LossSums means;
  means.Add(update_sums_, 1.0 / static_cast<double>(gradient_steps_));
  const auto rows = std::span<const std::int32_t>(order_).first(static_cast<std::size_t>(rows_));
  const Moments returns(rows, [this](std::size_t row) { return rollout_.returns[row]; });
  const Moments errors(rows, [this](std::size_t row) { return rollout_.returns[row] - rollout_.values[row]; });
  const double explained =
      returns.variance == 0.0 ? std::numeric_limits<double>::quiet_NaN() : 1.0 - errors.variance / returns.variance;
  metrics_.clear();
  if (ppo_.generation == Generation::kStableBaselines2)
    WriteMetricsOf2(means, explained);
  else
    WriteMetricsOf3(means, explained);
}

// Source: Stable Baselines 2.10.2, ppo2.py, learn and setup_model.
void Ppo::WriteMetricsOf2(const LossSums& means, double explained_variance) {
  const auto rows = std::span<const std::int32_t>(order_).first(static_cast<std::size_t>(rows_));
  const auto mean_of = [&](const std::vector<float>& column) {
    return Moments(rows, [&](std::size_t row) { return column[row]; }).mean;
  };
  const double loss = means.policy - ppo_.ent_coef * means.entropy + ppo_.vf_coef * means.value;
  metrics_.push_back({"policy_loss", "loss/policy_gradient_loss", means.policy, true});
  metrics_.push_back({"value_loss", "loss/value_function_loss", means.value, true});
  metrics_.push_back({"policy_entropy", "loss/entropy_loss", means.entropy, true});
  metrics_.push_back({"approxkl", "loss/approximate_kullback-leibler", means.kl, true});
  metrics_.push_back({"clipfrac", "loss/clip_factor", means.clipped, true});
  metrics_.push_back({"", "loss/loss", loss});
  metrics_.push_back({"explained_variance", "", explained_variance});
  metrics_.push_back({"", "input_info/discounted_rewards", mean_of(rollout_.returns)});
  metrics_.push_back({"", "input_info/learning_rate", learning_rate_});
  metrics_.push_back({"", "input_info/advantage", mean_of(rollout_.advantages)});
  metrics_.push_back({"", "input_info/clip_range", clip_range_});
  if (clip_range_vf_ >= 0.0f) metrics_.push_back({"", "input_info/clip_range_vf", clip_range_vf_});
  metrics_.push_back({"", "input_info/old_neglog_action_probability", mean_of(rollout_.neglogp)});
  metrics_.push_back({"", "input_info/old_value_pred", mean_of(rollout_.values)});
}

// Source: Stable Baselines3, ppo.py, train: approx_kl is the last epoch's mean, loss the last minibatch's.
void Ppo::WriteMetricsOf3(const LossSums& means, double explained_variance) {
  const auto put = [this](std::string_view name, double number) { metrics_.push_back({name, name, number}); };
  put("train/approx_kl", epoch_sums_.kl / static_cast<double>(epoch_gradient_steps_));
  put("train/clip_fraction", means.clipped);
  put("train/clip_range", clip_range_);
  if (clip_range_vf_ >= 0.0f) put("train/clip_range_vf", clip_range_vf_);
  put("train/entropy_loss", -means.entropy);
  put("train/explained_variance", explained_variance);
  put("train/learning_rate", learning_rate_);
  put("train/loss", last_sums_.policy - ppo_.ent_coef * last_sums_.entropy + ppo_.vf_coef * last_sums_.value);
  put("train/n_updates", static_cast<double>(epochs_));
  put("train/policy_gradient_loss", means.policy);
  if (!log_std().empty()) {
    double deviation = 0.0;
    for (const float value_of : log_std()) deviation += std::exp(value_of);
    put("train/std", deviation / static_cast<double>(log_std().size()));
  }
  put("train/value_loss", means.value);
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
  archive("skipped_steps", skipped_steps_);
  archive("epoch", epoch_);
  archive("minibatch_begin", minibatch_begin_);
  archive("rows", rows_);
  archive("gradient_steps", gradient_steps_);
  archive("learning_rate", learning_rate_);
  archive("clip_range", clip_range_);
  archive("clip_range_vf", clip_range_vf_);
  archive("order", std::span<std::int32_t>(order_));
  const auto row_count = static_cast<std::int64_t>(order_.size());
  archive.Check("rows", rows_ >= 0 && rows_ <= row_count);
  archive.Check("minibatch_begin", minibatch_begin_ >= 0 && minibatch_begin_ <= rows_);
  archive.Check("order", std::all_of(order_.begin(), order_.end(),
                                     [&](std::int32_t row) { return row >= 0 && row < row_count; }));
  archive("update_sums", update_sums_);
  archive("epoch_sums", epoch_sums_);
  archive("epoch_gradient_steps", epoch_gradient_steps_);
  archive("steps", steps_);
  archive("updates", updates_);
  archive("epochs", epochs_);
  if (!archive.loading()) return;
  if (ppo_.norm_obs) RefreshNormaliser();
  evaluator_.Load(std::span(parameters_).first(static_cast<std::size_t>(network_.parameter_count())));
}

}  // namespace consac::learn
