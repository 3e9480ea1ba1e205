#include "grad/squashed_samples.h"

#include <algorithm>
#include <cmath>

#include "consac/nn/kernels.h"

namespace consac::learn {

SquashedSamples::SquashedSamples(const ActionHead& head, std::int64_t max_rows, const StateMatrices* matrices)
    : head_(head), matrices_(head.features() > 0 ? matrices : nullptr) {
  CONSAC_ASSERT((head.features() > 0) == (matrices_ != nullptr));
  for (const ActionHead::Part& part : head.parts()) {
    CONSAC_ASSERT(part.distribution->name ==
                  (matrices_ != nullptr ? "squashed_sde_gaussian" : std::string_view("squashed_gaussian")));
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
  features_.resize(static_cast<std::size_t>(max_rows * head.features()));
}

void SquashedSamples::Draw(const float* head, std::int64_t rows, Rng& rng) {
  const std::size_t raw = places_.size(), numbers = static_cast<std::size_t>(rows) * raw;
  matrices_ != nullptr ? DrawByState(head, rows) : DrawByElements(head, rows, rng);
  nn::Tanh({actions_.data(), numbers}, {actions_.data(), numbers});
  std::fill_n(log_probabilities_.begin(), rows, 0.0f);
  for (std::size_t i = 0; i < numbers; ++i) {
    log_probabilities_[i / raw] -= 0.5f * noise_[i] * noise_[i] + log_stds_[i] + 0.5f * kLogTwoPi +
                                   std::log(1.0f - actions_[i] * actions_[i] + kSquashEpsilon);
  }
}

void SquashedSamples::DrawByElements(const float* head, std::int64_t rows, Rng& rng) {
  const std::size_t raw = places_.size(), numbers = static_cast<std::size_t>(rows) * raw;
  for (std::size_t i = 0; i < numbers; ++i) {
    const float said = head[static_cast<std::int64_t>(i / raw) * head_.size() + places_[i % raw].log_std];
    log_stds_[i] = std::clamp(said, kLeastLogStd, kMostLogStd);
    clipped_[i] = said < kLeastLogStd || said > kMostLogStd ? 1 : 0;
    noise_[i] = rng.Normal();
  }
  nn::Exp({log_stds_.data(), numbers}, {deviations_.data(), numbers});
  for (std::size_t i = 0; i < numbers; ++i) {
    const float mean = head[static_cast<std::int64_t>(i / raw) * head_.size() + places_[i % raw].mean];
    actions_[i] = mean + deviations_[i] * noise_[i];
  }
}

void SquashedSamples::DrawByState(const float* head, std::int64_t rows) {
  const std::int64_t raw = head_.raw_size();
  for (std::int64_t r = 0; r < rows; ++r) {
    const float* said = head + r * head_.size();
    const float* phi = said + head_.features_offset();
    std::copy_n(phi, head_.features(), features_.begin() + r * head_.features());
    for (const ActionHead::Part& part : head_.parts()) {
      for (std::int64_t i = 0; i < part.leaf.count; ++i) {
        const auto place = static_cast<std::size_t>(r * raw + part.raw_offset + i);
        float noise = 0.0f, variance = StateNoise::kEpsilon;
        for (std::int64_t l = 0; l < head_.features(); ++l) {
          const auto at = static_cast<std::size_t>(part.exploration_offset + l * part.leaf.count + i);
          const float deviation = phi[l] * matrices_->deviations[at];
          noise += phi[l] * matrices_->matrices[at];
          variance += deviation * deviation;
        }
        const float mean = said[part.head_offset + i];
        deviations_[place] = std::sqrt(variance);
        log_stds_[place] = 0.5f * std::log(variance);
        noise_[place] = noise / deviations_[place];
        clipped_[place] = part.noise.Within(mean) ? 0 : 1;
        actions_[place] = part.noise.Clip(mean) + noise;
      }
    }
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
void SquashedSamples::Backward(std::int64_t row, const float* d_action, float d_log_probability, float* d_head,
                               float* d_log_std) const {
  const std::size_t raw = places_.size(), first = static_cast<std::size_t>(row) * raw;
  if (matrices_ != nullptr) std::fill_n(d_head + head_.features_offset(), head_.features(), 0.0f);
  for (const ActionHead::Part& part : head_.parts()) {
    for (std::int64_t e = 0; e < part.leaf.count; ++e) {
      const auto i = static_cast<std::size_t>(part.raw_offset + e);
      const float action = actions_[first + i], slope = 1.0f - action * action;
      const float d_before = (d_action[i] + d_log_probability * 2.0f * action / (slope + kSquashEpsilon)) * slope;
      if (matrices_ != nullptr) {
        d_head[places_[i].mean] = clipped_[first + i] != 0 ? 0.0f : d_before;
        BackwardByState(row, part, e, d_before, d_log_probability, d_head, d_log_std);
        continue;
      }
      d_head[places_[i].mean] = d_before;
      d_head[places_[i].log_std] =
          clipped_[first + i] != 0 ? 0.0f : d_before * deviations_[first + i] * noise_[first + i] - d_log_probability;
    }
  }
}

// With n = phi W and v = sum phi^2 sigma^2 + epsilon: log p has -n^2 / 2v - log(v) / 2, and W = sigma xi.
void SquashedSamples::BackwardByState(std::int64_t row, const ActionHead::Part& part, std::int64_t element,
                                      float d_before, float d_log_probability, float* d_head, float* d_log_std) const {
  const auto i = static_cast<std::size_t>(row * head_.raw_size() + part.raw_offset + element);
  const float z = noise_[i], deviation = deviations_[i];
  const float d_noise = d_before - d_log_probability * z / deviation;
  const float d_variance = 0.5f * d_log_probability * (z * z - 1.0f) / (deviation * deviation);
  const float* phi = features_.data() + row * head_.features();
  float* d_phi = d_head + head_.features_offset();
  for (std::int64_t l = 0; l < head_.features(); ++l) {
    const auto at = static_cast<std::size_t>(part.exploration_offset + l * part.leaf.count + element);
    const float sigma = matrices_->deviations[at], twice = 2.0f * d_variance * phi[l] * sigma;
    d_phi[l] += d_noise * matrices_->matrices[at] + twice * sigma;
    d_log_std[part.log_std_offset + part.noise.log_std_of(l, element, part.leaf.count)] +=
        (d_noise * phi[l] * matrices_->normals[at] + twice * phi[l]) * matrices_->slopes[at];
  }
}

}  // namespace consac::learn
