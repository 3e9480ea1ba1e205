#pragma once
// Forward and backward through a Network for one minibatch, block by block: gather, forward, loss, backward while
// the block's activations are still in cache. Blocks are cut by the minibatch's size alone and reduced in order, so
// any number of threads gives the same bits. Algorithms bring the gather and the loss.

#include <cstdint>
#include <memory>
#include <span>

#include "consac/base/executor.h"
#include "consac/nn/network.h"

namespace consac::learn {

/// Rows of one block; the last of a minibatch may hold fewer.
inline constexpr std::int64_t kBlockRows = 64;

/// One block of a minibatch, as the loss sees it.
struct LossBlock {
  std::int64_t index = 0;                    ///< 0, 1, ... within the minibatch
  std::int64_t first_row = 0;                ///< row of the minibatch that is row 0 here
  std::int64_t rows = 0;                     ///< at most kBlockRows
  std::span<float* const> inputs;            // one per network input: [rows, size], to be filled by Gather
  std::span<const float* const> outputs;     // one per network output: [rows, size]
  std::span<float* const> output_gradients;  // one per network output: [rows, size], to be filled by Loss
  std::span<float> extra_gradient;           // [extra] of parameters outside the network (log_std): add to it
};

/// What an algorithm brings. Calls for different blocks may come from different threads.
class BlockLoss {
 public:
  virtual ~BlockLoss() = default;
  /// Copies the block's rows into block.inputs.
  virtual void Gather(const LossBlock& block) = 0;
  /// Reads block.outputs, writes d(loss)/d(output) into block.output_gradients and adds to block.extra_gradient.
  virtual void Loss(const LossBlock& block) = 0;
};

/// Gradients of a network with `extra` further parameters behind it in the arena. Allocates at creation only.
class Backpropagation {
 public:
  /// For minibatches of at most `max_rows` rows.
  Backpropagation(const nn::Network& network, std::int64_t extra, std::int64_t max_rows);
  ~Backpropagation();
  Backpropagation(Backpropagation&&) noexcept;

  /// How many gradients it keeps, each of [network parameters + extra]: for whoever counts memory before creation.
  static std::int64_t GradientCopies(std::int64_t max_rows);

  /// Computes the gradient of one minibatch at `parameters` ([network parameters + extra]); overwrites gradient().
  void Run(std::span<const float> parameters, std::int64_t rows, const Executor& executor, BlockLoss& loss);
  /// [network parameters + extra], of the last Run.
  std::span<float> gradient();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace consac::learn
