#pragma once
// One clipped step of an optimiser at a time, and what became of those of an update: a gradient that is not finite is
// skipped, and an update without any finite one ends the learning. Private to learn.

#include <string>

#include "consac/base/status.h"
#include "consac/learn/optim/optimiser.h"

namespace consac::learn {

/// An optimiser with its clip and its health.
class GradientStep {
 public:
  /// Clips the global norm at `max_grad_norm` (0: never) in the optimiser's form.
  GradientStep(Optimiser optimiser, double max_grad_norm)
      : optimiser_(std::move(optimiser)), max_grad_norm_(max_grad_norm) {}

  /// An update begins.
  void Begin() { skipped_ = 0; }
  /// Clips and steps; false when the gradient was not finite and was left out.
  bool Apply(std::span<float> parameters, std::span<const float> gradient, float learning_rate);
  /// Update `update` of `gradients` gradients ends: health, and a line when some of them were left out.
  void Finish(std::int64_t update, std::int64_t gradients);
  /// kNonFinite once a whole update had no finite gradient.
  const Status& health() const { return health_; }

  /// The optimiser's state under its name, and the steps left out.
  void Visit(Archive& archive);

 private:
  Optimiser optimiser_;
  double max_grad_norm_;
  std::int64_t skipped_ = 0;
  Status health_;
};

}  // namespace consac::learn
