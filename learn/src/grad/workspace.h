#pragma once
// Activations and their gradients for one block of a minibatch, and the schedule that runs a network over it. Private
// to grad; Backpropagation owns one per lane that runs at the same time.

#include <atomic>
#include <vector>

#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/activations.h"
#include "grad/gradient_ops.h"

namespace consac::learn {

/// What the backward pass does with one input of a step, decided once.
struct BackwardInput {
  bool wanted = false;                      ///< something with parameters stands before it
  nn::Store store = nn::Store::kOverwrite;  ///< the first to reach a value overwrites, the others add
};

/// What it does with a step.
struct BackwardStep {
  const GradientOp* op = nullptr;     ///< how
  bool reached = false;               ///< an output depends on it; otherwise its gradient stays 0
  bool first_use = true;              ///< of its parameters, backward; the later ones add
  std::vector<BackwardInput> inputs;  ///< one per input
};

/// A network's parameters packed for both directions, and the order of work.
class GradientSchedule {
 public:
  /// For `network`.
  explicit GradientSchedule(const nn::Network& network);
  /// Packs `parameters` (canonical order).
  void Pack(std::span<const float> parameters);

  nn::PackedNetwork forward;              ///< plan and forward packing
  std::vector<BackwardStep> backward;     ///< [plan.steps]
  std::vector<std::size_t> order;         ///< [plan.steps] forward
  std::vector<std::int64_t> backward_at;  ///< [plan.steps] into packed
  nn::AlignedFloats packed;               ///< backward packing

 private:
  void PlanBackward();
};

/// Memory for one block of kBlockRows rows.
class BlockWorkspace {
 public:
  /// Sized for `schedule`, which must outlive it.
  explicit BlockWorkspace(const GradientSchedule& schedule);
  /// Gather, forward, loss, backward. The network's gradient goes to `gradient` (overwritten or added to).
  void Run(LossBlock block, BlockLoss& loss, float* gradient, nn::Store store);

  std::atomic<bool> taken = false;  ///< some thread is using it

 private:
  nn::Rows Gradient(std::size_t value);
  void Backward(std::int64_t rows, float* gradient, nn::Store store);

  const GradientSchedule& schedule_;
  nn::Activations activations_;
  std::vector<nn::AlignedFloats> gradients_;       // [values] each [kBlockRows, stride]
  std::vector<GradientInput> step_inputs_;         // of one step
  std::vector<float*> inputs_, output_gradients_;  // what the loss sees
  std::vector<const float*> outputs_;
};

}  // namespace consac::learn
