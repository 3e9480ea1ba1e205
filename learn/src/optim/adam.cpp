#include <cmath>

#include "consac/learn/optim/optimiser.h"
#include "consac/nn/kernels.h"

namespace consac::learn {

Adam::Adam(std::int64_t size, const AdamOptions& options)
    : options_(options), m_(static_cast<std::size_t>(size)), v_(static_cast<std::size_t>(size)) {}

void Adam::Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate,
                float gradient_scale) {
  ++steps_;
  const double t = static_cast<double>(steps_);
  const double first = 1.0 - std::pow(static_cast<double>(options_.beta1), t);
  const double second = std::sqrt(1.0 - std::pow(static_cast<double>(options_.beta2), t));
  const bool tensorflow = options_.form == OptimiserForm::kTensorFlow;
  nn::AdamCall call;
  call.gradient_scale = gradient_scale;
  call.beta1 = options_.beta1;
  call.beta2 = options_.beta2;
  call.epsilon = options_.epsilon;
  call.step = static_cast<float>(static_cast<double>(learning_rate) / first * (tensorflow ? second : 1.0));
  call.root_scale = tensorflow ? 1.0f : static_cast<float>(1.0 / second);
  nn::AdamStep(call, gradient, m_, v_, parameters);
}

void Adam::Visit(Archive& archive) {
  archive("steps", steps_);
  archive("m", std::span<float>(m_));
  archive("v", std::span<float>(v_));
}

}  // namespace consac::learn
