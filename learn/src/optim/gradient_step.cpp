#include "optim/gradient_step.h"

#include <cmath>

namespace consac::learn {
namespace {

constexpr const char* kAdvice = "lower the learning rate, or check the world's rewards and observations";

}  // namespace

bool GradientStep::Apply(std::span<float> parameters, std::span<float> gradient, float learning_rate) {
  ranks_.Sum(gradient);
  const double norm = GlobalNorm(gradient);
  if (!std::isfinite(norm)) {
    ++skipped_;
    return false;
  }
  for (const nn::Parameter& tensor : tensors_) {
    const auto part = gradient.subspan(static_cast<std::size_t>(tensor.offset), static_cast<std::size_t>(tensor.count));
    const float factor = ClipFactor(GlobalNorm(part), max_grad_norm_, optimiser_.form());
    if (factor == 1.0f) continue;
    for (float& value : part) value *= factor;
  }
  const float whole = tensors_.empty() ? ClipFactor(norm, max_grad_norm_, optimiser_.form()) : 1.0f;
  optimiser_.Step(parameters, gradient, learning_rate, whole);
  return true;
}

void GradientStep::Finish(std::int64_t update, std::int64_t gradients) {
  if (skipped_ == gradients) {
    health_ = {StatusCode::kNonFinite, "no gradient of update " + std::to_string(update) +
                                           " was finite, so nothing more can be learned; " + kAdvice};
  } else if (skipped_ > 0) {
    Log(LogLevel::kWarning, std::to_string(skipped_) + " of " + std::to_string(gradients) + " gradients of update " +
                                std::to_string(update) + " were not finite and were skipped; " + kAdvice);
  }
}

void GradientStep::Visit(Archive& archive) {
  archive(optimiser_.name(), optimiser_);
  archive("skipped_steps", skipped_);
}

}  // namespace consac::learn
