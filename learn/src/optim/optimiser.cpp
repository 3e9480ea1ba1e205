#include "consac/learn/optim/optimiser.h"

#include <algorithm>
#include <cmath>

#include "consac/nn/kernels.h"

namespace consac::learn {

double GlobalNorm(std::span<const float> gradient) { return std::sqrt(nn::SumOfSquares(gradient)); }

float ClipFactor(double norm, double max_norm, OptimiserForm form) {
  if (max_norm <= 0.0) return 1.0f;
  if (form == OptimiserForm::kTensorFlow) return static_cast<float>(max_norm / std::max(norm, max_norm));
  return static_cast<float>(std::min(1.0, max_norm / (norm + 1e-6)));
}

Adam::Adam(std::int64_t size, const AdamOptions& options)
    : options_(options), m_(static_cast<std::size_t>(size), 0.0f), v_(static_cast<std::size_t>(size), 0.0f) {}

void Adam::Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate, float gradient_scale) {
  CONSAC_ASSERT(parameters.size() == m_.size() && gradient.size() == m_.size());
  ++steps_;
  const auto t = static_cast<double>(steps_);
  const double correction1 = 1.0 - std::pow(static_cast<double>(options_.beta1), t);
  const double correction2 = 1.0 - std::pow(static_cast<double>(options_.beta2), t);
  nn::AdamCall call;
  call.gradient_scale = gradient_scale;
  call.beta1 = options_.beta1;
  call.beta2 = options_.beta2;
  call.epsilon = options_.epsilon;
  if (options_.form == OptimiserForm::kTensorFlow) {
    call.step = static_cast<float>(learning_rate * std::sqrt(correction2) / correction1);
  } else {
    call.step = static_cast<float>(learning_rate / correction1);
    call.root_scale = static_cast<float>(1.0 / std::sqrt(correction2));
  }
  nn::AdamStep(call, gradient, m_, v_, parameters);
}

void Adam::Visit(Archive& archive) {
  archive("steps", steps_);
  archive("m", std::span<float>(m_));
  archive("v", std::span<float>(v_));
}

RmsProp::RmsProp(std::int64_t size, const RmsPropOptions& options)
    : options_(options),
      mean_square_(static_cast<std::size_t>(size), options.form == OptimiserForm::kTensorFlow ? 1.0f : 0.0f),
      momentum_(static_cast<std::size_t>(size), 0.0f) {}

// TensorFlow keeps the learning rate inside the momentum, PyTorch outside.
void RmsProp::Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate, float gradient_scale) {
  CONSAC_ASSERT(parameters.size() == mean_square_.size() && gradient.size() == mean_square_.size());
  const bool tensorflow = options_.form == OptimiserForm::kTensorFlow;
  nn::RmsPropCall call;
  call.gradient_scale = gradient_scale;
  call.decay = options_.decay;
  call.momentum = options_.momentum;
  call.inner = tensorflow ? learning_rate : 1.0f;
  call.outer = tensorflow ? 1.0f : learning_rate;
  call.epsilon_inside = tensorflow ? options_.epsilon : 0.0f;
  call.epsilon_outside = tensorflow ? 0.0f : options_.epsilon;
  nn::RmsPropStep(call, gradient, mean_square_, momentum_, parameters);
}

void RmsProp::Visit(Archive& archive) {
  archive("mean_square", std::span<float>(mean_square_));
  archive("momentum", std::span<float>(momentum_));
}

}  // namespace consac::learn
