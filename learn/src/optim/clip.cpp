#include <algorithm>
#include <cmath>

#include "consac/learn/optim/optimiser.h"
#include "consac/nn/kernels.h"

namespace consac::learn {

double GlobalNorm(std::span<const float> gradient) {
  return std::sqrt(nn::SumOfSquares(gradient));
}

float ClipFactor(double norm, double max_norm, OptimiserForm form) {
  if (max_norm <= 0.0) return 1.0f;
  if (form == OptimiserForm::kTensorFlow) return static_cast<float>(max_norm / std::max(norm, max_norm));
  return static_cast<float>(std::min(1.0, max_norm / (norm + 1e-6)));
}

}  // namespace consac::learn
