#pragma once
// A BlockLoss made of functions, for algorithms that differentiate several networks one after another:
//   LossOf critic([&](const LossBlock& block) { gather }, [&](const LossBlock& block) { loss });
// Private to learn.

#include <utility>

#include "consac/learn/grad/backpropagation.h"

namespace consac::learn {

/// Where nobody reads input gradients.
struct NoInputGradients {
  /// Nothing.
  void operator()(const LossBlock&) const {}
};

/// Calls what it was made of.
template <class GatherFunction, class LossFunction, class InputsFunction = NoInputGradients>
class LossOf final : public BlockLoss {
 public:
  /// Of these, called as BlockLoss says.
  LossOf(GatherFunction gather, LossFunction loss, InputsFunction inputs = {})
      : gather_(std::move(gather)), loss_(std::move(loss)), inputs_(std::move(inputs)) {}
  void Gather(const LossBlock& block) override { gather_(block); }
  void Loss(const LossBlock& block) override { loss_(block); }
  void InputGradients(const LossBlock& block) override { inputs_(block); }

 private:
  GatherFunction gather_;
  LossFunction loss_;
  InputsFunction inputs_;
};

}  // namespace consac::learn
