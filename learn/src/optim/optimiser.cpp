#include "consac/learn/optim/optimiser.h"

namespace consac::learn {

void Optimiser::Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate,
                     float gradient_scale) {
  if (Adam* adam = std::get_if<Adam>(&either_)) return adam->Step(parameters, gradient, learning_rate, gradient_scale);
  std::get_if<RmsProp>(&either_)->Step(parameters, gradient, learning_rate, gradient_scale);
}

OptimiserForm Optimiser::form() const {
  const Adam* adam = std::get_if<Adam>(&either_);
  return adam != nullptr ? adam->form() : std::get_if<RmsProp>(&either_)->form();
}

void Optimiser::Visit(Archive& archive) {
  if (Adam* adam = std::get_if<Adam>(&either_)) return adam->Visit(archive);
  std::get_if<RmsProp>(&either_)->Visit(archive);
}

}  // namespace consac::learn
