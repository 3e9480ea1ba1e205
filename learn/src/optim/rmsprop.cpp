#include "consac/learn/optim/optimiser.h"
#include "consac/nn/kernels.h"

namespace consac::learn {

RmsProp::RmsProp(std::int64_t size, const RmsPropOptions& options)
    : options_(options),
      mean_square_(static_cast<std::size_t>(size), options.form == OptimiserForm::kTensorFlow ? 1.0f : 0.0f),
      momentum_(static_cast<std::size_t>(size)) {}

void RmsProp::Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate,
                   float gradient_scale) {
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
