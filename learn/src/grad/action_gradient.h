#pragma once
// What an actor is learned by: the gradient of a loss of critics' values with respect to the actions that they judge,
// the critics held fast. Private to learn.

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "grad/loss_of.h"

namespace consac::learn {

/// Of one minibatch at a time.
class ActionGradient {
 public:
  /// Through `critics`, whose inputs are observations and actions of `raw` numbers, for at most `max_rows` rows.
  /// `packed`, of the same network, holds what Run is given, whenever it is called; null: Run packs it.
  ActionGradient(const nn::Network& critics, std::int64_t raw, std::int64_t max_rows,
                 std::shared_ptr<const nn::PackedNetwork> packed = nullptr)
      : raw_(raw),
        parameters_(static_cast<std::size_t>(critics.parameter_count())),
        gradients_(static_cast<std::size_t>(raw * max_rows)),
        backpropagation_(critics, {.max_rows = max_rows,
                                   .parameter_count = 0,
                                   .input_gradients = true,
                                   .first_input = 1,
                                   .packed = std::move(packed)}) {}

  /// Runs the critics with the first of `parameters`: `gather` fills both inputs of a block, `loss` reads its values
  /// and writes d loss / d value.
  template <class GatherFunction, class LossFunction>
  void Run(std::span<const float> parameters, std::int64_t rows, const Executor& executor, GatherFunction&& gather,
           LossFunction&& loss) {
    LossOf whole(std::forward<GatherFunction>(gather), std::forward<LossFunction>(loss),
                 [this](const LossBlock& block) {
                   std::copy_n(block.input_gradients[1], block.rows * raw_, gradients_.data() + block.first_row * raw_);
                 });
    backpropagation_.Run(parameters.first(parameters_), rows, executor, whole);
  }
  /// d loss / d action of a row of the last Run, [raw].
  const float* row(std::int64_t row) const { return gradients_.data() + row * raw_; }
  /// Those of a block's rows as the gradient of its first output: of an actor whose outputs are the actions.
  void Backward(const LossBlock& block) const {
    std::copy_n(row(block.first_row), block.rows * raw_, block.output_gradients[0]);
  }

 private:
  std::int64_t raw_;
  std::size_t parameters_;        // of the critics
  std::vector<float> gradients_;  // [rows, raw]
  Backpropagation backpropagation_;
};

}  // namespace consac::learn
