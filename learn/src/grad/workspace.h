#pragma once
// Activations and their gradients for one block of a minibatch, and the schedule that runs a network over it. Private
// to grad; Backpropagation owns one per lane that runs at the same time.

#include <atomic>
#include <vector>

#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/aligned.h"
#include "consac/nn/plan.h"
#include "grad/gradient_ops.h"

namespace consac::learn {

/// What the backward pass does with one step, decided once.
struct BackwardStep {
  const GradientOp* op = nullptr;           ///< how
  bool reached = false;                     ///< an output depends on it; otherwise its gradient stays 0
  bool input_wanted = false;                ///< something with parameters stands before it
  nn::Store input_store = nn::Store::kAdd;  ///< the first to reach a value overwrites, the others add
};

/// A network's parameters packed for both directions, and the order of work.
class GradientSchedule {
 public:
  /// For `network`.
  explicit GradientSchedule(const nn::Network& network);
  /// Packs `parameters` (canonical order).
  void Pack(const float* parameters);

  nn::Plan plan;                          ///< forward order
  std::vector<BackwardStep> backward;     ///< [plan.steps]
  std::vector<std::int64_t> forward_at;   ///< [plan.steps] into packed
  std::vector<std::int64_t> backward_at;  ///< [plan.steps] into packed
  nn::AlignedFloats packed;               ///< both packings

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
  nn::Rows Value(std::size_t value) { return {values_[value].data(), strides_[value]}; }
  nn::Rows Gradient(std::size_t value) { return {gradients_[value].data(), strides_[value]}; }
  nn::Rows PreActivation(std::size_t value) { return {pre_[value].data(), strides_[value]}; }
  void Forward(std::int64_t rows);
  void Backward(std::int64_t rows, float* gradient, nn::Store store);

  const GradientSchedule& schedule_;
  std::vector<std::int64_t> strides_;                        // [values]
  std::vector<nn::AlignedFloats> values_, gradients_, pre_;  // [values] each [kBlockRows, stride]
  std::vector<float*> inputs_, output_gradients_;            // what the loss sees
  std::vector<const float*> outputs_;
};

}  // namespace consac::learn
