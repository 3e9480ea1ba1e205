#include "grad/squashed_samples.h"

#include <algorithm>
#include <cmath>

#include "consac/nn/kernels.h"

namespace consac::learn {

SquashedSamples::SquashedSamples(const ActionHead& head, std::int64_t max_rows) : head_size_(head.size()) {
  for (const ActionHead::Part& part : head.parts()) {
    CONSAC_ASSERT(part.distribution->name == "squashed_gaussian");
    for (std::int64_t i = 0; i < part.leaf.count; ++i)
      places_.push_back({part.head_offset + i, part.head_offset + part.leaf.count + i});
  }
  const std::size_t numbers = static_cast<std::size_t>(max_rows) * places_.size();
  noise_.resize(numbers);
  log_stds_.resize(numbers);
  deviations_.resize(numbers);
  actions_.resize(numbers);
  clipped_.resize(numbers);
  log_probabilities_.resize(static_cast<std::size_t>(max_rows));
}

void SquashedSamples::Draw(const float* head, std::int64_t rows, Rng& rng) {
  const std::size_t raw = places_.size(), numbers = static_cast<std::size_t>(rows) * raw;
  for (std::size_t i = 0; i < numbers; ++i) {
    const float said = head[static_cast<std::int64_t>(i / raw) * head_size_ + places_[i % raw].log_std];
    log_stds_[i] = std::clamp(said, kLeastLogStd, kMostLogStd);
    clipped_[i] = said < kLeastLogStd || said > kMostLogStd ? 1 : 0;
    noise_[i] = rng.Normal();
  }
  nn::Exp({log_stds_.data(), numbers}, {deviations_.data(), numbers});
  for (std::size_t i = 0; i < numbers; ++i) {
    const float mean = head[static_cast<std::int64_t>(i / raw) * head_size_ + places_[i % raw].mean];
    actions_[i] = mean + deviations_[i] * noise_[i];
  }
  nn::Tanh({actions_.data(), numbers}, {actions_.data(), numbers});
  std::fill_n(log_probabilities_.begin(), rows, 0.0f);
  for (std::size_t i = 0; i < numbers; ++i) {
    log_probabilities_[i / raw] -= 0.5f * noise_[i] * noise_[i] + log_stds_[i] + 0.5f * kLogTwoPi +
                                   std::log(1.0f - actions_[i] * actions_[i] + kSquashEpsilon);
  }
}

double SquashedSamples::NormalEntropy(std::int64_t row) const {
  const std::size_t raw = places_.size(), first = static_cast<std::size_t>(row) * raw;
  double entropy = 0.0;
  for (std::size_t i = 0; i < raw; ++i)
    entropy += static_cast<double>(log_stds_[first + i]) + 0.5 * (static_cast<double>(kLogTwoPi) + 1.0);
  return entropy;
}

// With u = mu + sigma xi: da/du = 1 - a^2, dlog p/da = 2a / (1 - a^2 + epsilon), and log p has -log sigma besides.
void SquashedSamples::Backward(std::int64_t row, const float* d_action, float d_log_probability, float* d_head) const {
  const std::size_t raw = places_.size(), first = static_cast<std::size_t>(row) * raw;
  for (std::size_t i = 0; i < raw; ++i) {
    const float action = actions_[first + i], slope = 1.0f - action * action;
    const float d_mean = (d_action[i] + d_log_probability * 2.0f * action / (slope + kSquashEpsilon)) * slope;
    d_head[places_[i].mean] = d_mean;
    d_head[places_[i].log_std] =
        clipped_[first + i] != 0 ? 0.0f : d_mean * deviations_[first + i] * noise_[first + i] - d_log_probability;
  }
}

}  // namespace consac::learn
