#pragma once
// One clipped step of an optimiser at a time, and what became of those of an update: a gradient that is not finite is
// skipped, and an update without any finite one ends the learning. Private to learn.

#include <string>

#include "consac/base/communicator.h"
#include "consac/base/status.h"
#include "consac/learn/optim/optimiser.h"
#include "consac/nn/network.h"

namespace consac::learn {

/// An optimiser with its clip and its health.
class GradientStep {
 public:
  /// Clips the global norm at `max_grad_norm` (0: never) in the optimiser's form. Gradients are summed over `ranks`.
  GradientStep(Optimiser optimiser, double max_grad_norm, const Communicator& ranks = {})
      : optimiser_(std::move(optimiser)), max_grad_norm_(max_grad_norm), ranks_(ranks) {}

  /// The gradient of each of `tensors`, which must stay, is clipped by itself from now on instead of the whole, as
  /// Stable Baselines 2 does for DQN and DDPG.
  void ClipEach(std::span<const nn::Parameter> tensors) { tensors_ = tensors; }
  /// An update begins.
  void Begin() { skipped_ = 0; }
  /// Sums the gradient over the ranks in place, clips and steps; false when it was not finite and was left out, which
  /// then is so on every rank.
  bool Apply(std::span<float> parameters, std::span<float> gradient, float learning_rate);
  /// Update `update` of `gradients` gradients ends: health, and a line when some of them were left out.
  void Finish(std::int64_t update, std::int64_t gradients);
  /// kNonFinite once a whole update had no finite gradient.
  const Status& health() const { return health_; }

  /// The optimiser's state under its name, and the steps left out.
  void Visit(Archive& archive);

 private:
  Optimiser optimiser_;
  double max_grad_norm_;
  Communicator ranks_;
  std::span<const nn::Parameter> tensors_;  // that are clipped each by itself; none: the whole
  std::int64_t skipped_ = 0;
  Status health_;
};

}  // namespace consac::learn
