#include "collect/parameter_noise.h"

#include <algorithm>
#include <cmath>

namespace consac::learn {
namespace {

constexpr double kAdaption = 1.01;

double LogSumExp(const float* values, std::int64_t count) {
  const double largest = static_cast<double>(*std::max_element(values, values + count));
  double sum = 0.0;
  for (std::int64_t i = 0; i < count; ++i) sum += std::exp(static_cast<double>(values[i]) - largest);
  return largest + std::log(sum);
}

/// KL(softmax p || softmax q).
double SoftmaxDivergence(const float* p, const float* q, std::int64_t count) {
  const double p_sum = LogSumExp(p, count), q_sum = LogSumExp(q, count);
  double divergence = 0.0;
  for (std::int64_t i = 0; i < count; ++i) {
    const double log_p = static_cast<double>(p[i]) - p_sum;
    divergence += std::exp(log_p) * (log_p - static_cast<double>(q[i]) + q_sum);
  }
  return divergence;
}

}  // namespace

ParameterNoise::ParameterNoise(const nn::Network& network, std::uint64_t seed, std::int64_t max_rows, double deviation)
    : disturbed_(static_cast<std::size_t>(network.parameter_count())),
      acting_(disturbed_.size()),
      trial_(disturbed_.size()),
      acting_evaluator_(network, max_rows),
      trial_evaluator_(network, max_rows),
      outputs_(network.output_size(0)),
      rng_(seed, StreamId("parameter_noise")),
      deviation_(deviation) {
  for (const nn::PlacedBlock& block : network.blocks()) {
    if (block.op != "dense") continue;
    std::fill_n(disturbed_.begin() + block.parameter_offset, block.parameter_count, std::uint8_t{1});
  }
}

void ParameterNoise::Draw(std::span<const float> parameters, std::vector<float>* perturbed) {
  const auto deviation = static_cast<float>(deviation_);
  for (std::size_t i = 0; i < perturbed->size(); ++i)
    (*perturbed)[i] = parameters[i] + (disturbed_[i] != 0 ? deviation * rng_.Normal() : 0.0f);
}

void ParameterNoise::Perturb(std::span<const float> parameters) {
  Draw(parameters, &acting_);
  acting_evaluator_.Load(acting_);
}

const float* ParameterNoise::Values(const float* features, std::int64_t rows) {
  acting_evaluator_.Forward({&features, 1}, rows);
  return acting_evaluator_.output(0);
}

const float* ParameterNoise::Try(std::span<const float> parameters, const float* features, std::int64_t rows) {
  Draw(parameters, &trial_);
  trial_evaluator_.Load(trial_);
  trial_evaluator_.Forward({&features, 1}, rows);
  return trial_evaluator_.output(0);
}

void ParameterNoise::Adapt(std::span<const float> parameters, const float* features, const float* values,
                           std::int64_t rows, double epsilon) {
  const float* tried = Try(parameters, features, rows);
  double divergence = 0.0;
  for (std::int64_t row = 0; row < rows; ++row) {
    divergence +=
        SoftmaxDivergence(values + row * outputs_, tried + row * outputs_, outputs_) / static_cast<double>(rows);
  }
  const double threshold = -std::log(1.0 - epsilon + epsilon / static_cast<double>(outputs_));
  deviation_ = divergence < threshold ? std::min(deviation_ * kAdaption, kStrongest) : deviation_ / kAdaption;
}

double ParameterNoise::Distance(std::span<const float> parameters, const float* features, const float* outputs,
                                std::int64_t rows) {
  const float* tried = Try(parameters, features, rows);
  const std::int64_t numbers = rows * outputs_;
  double squares = 0.0;
  for (std::int64_t i = 0; i < numbers; ++i) {
    const double moved = static_cast<double>(outputs[i] - tried[i]);
    squares += moved * moved;
  }
  return std::sqrt(squares / static_cast<double>(numbers));
}

void ParameterNoise::Visit(Archive& archive) {
  archive("acting", std::span<float>(acting_));
  archive("rng", rng_);
  archive("deviation", deviation_);
  archive.Check("deviation", deviation_ >= 0.0);
  if (!archive.loading()) return;
  deviation_ = std::min(deviation_, kStrongest);  // earlier programs let it grow further
  acting_evaluator_.Load(acting_);
}

}  // namespace consac::learn
