#pragma once
// Activations and their gradients for one block of a minibatch, and the schedule that runs a network over it. Private
// to grad; Backpropagation owns one per lane that runs at the same time.

#include <atomic>
#include <memory>
#include <vector>

#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/activations.h"
#include "grad/gradient_ops.h"

namespace consac::learn {

/// What the backward pass does with one input of a step, decided once.
struct BackwardInput {
  bool wanted = false;                      ///< something that learns, or an input that is asked for, stands before it
  nn::Store store = nn::Store::kOverwrite;  ///< the first to reach a value overwrites, the others add
  bool rectified = false;                   ///< as GradientInput's
};

/// What it does with a step.
struct BackwardStep {
  const GradientOp* op = nullptr;     ///< how
  bool reached = false;               ///< an output depends on it; otherwise its gradient stays 0
  bool learns = false;                ///< its parameters have a gradient
  bool first_use = true;              ///< of its parameters, backward; the later ones add
  bool is_dz = false;                 ///< as GradientCall's
  bool moves = false;                 ///< along a tangent; otherwise its output's tangent is 0
  std::vector<BackwardInput> inputs;  ///< one per input
  std::int64_t packed_at = -1;        ///< into GradientSchedule::packed; -1: nothing to pack
  std::int64_t tangent_at = -1;       ///< into GradientSchedule::tangent
};

/// A network's parameters packed for both directions, and the order of work.
class GradientSchedule {
 public:
  /// For `network`.
  GradientSchedule(const nn::Network& network, const BackpropagationOptions& options);
  /// Packs `parameters` (canonical order): for backward, and for forward unless somebody else does.
  void Pack(std::span<const float> parameters);
  /// Packs `direction` beside `parameters`, both in canonical order.
  void PackTangent(std::span<const float> parameters, std::span<const float> direction);
  /// Whether the gradient with respect to this input of the network is asked for.
  bool WantsInput(std::size_t input) const;

  BackpropagationOptions options;                    ///< as they came, but for parameter_count
  std::shared_ptr<nn::PackedNetwork> own;            ///< null: the forward packing is somebody else's
  std::shared_ptr<const nn::PackedNetwork> forward;  ///< plan and forward packing
  std::vector<BackwardStep> backward;                ///< [plan.steps]
  std::vector<std::size_t> order;                    ///< [plan.steps] forward
  std::int64_t block_rows;                           ///< rows of one block
  std::int64_t scratch = 0;                          ///< floats of work space
  nn::AlignedFloats packed, tangent;                 ///< packed for backward; parameters and direction

 private:
  bool Learns(const nn::PlacedBlock& block) const;
  void PlanBackward();
  void PlanRectified();
  void PlanMemory();
};

/// Memory for one block.
class BlockWorkspace {
 public:
  /// Sized for `schedule`, which must outlive it.
  explicit BlockWorkspace(const GradientSchedule& schedule);
  /// Gather, forward, (along the tangent,) loss, backward. The network's gradient goes to `gradient` (overwritten or
  /// added to).
  void Run(LossBlock block, BlockLoss& loss, bool along_tangent, float* gradient, nn::Store store);

  std::atomic<bool> taken = false;  ///< some thread is using it

 private:
  nn::Rows Gradient(std::size_t value);
  nn::Rows Tangent(std::size_t value);
  void Along(std::int64_t rows);
  void Backward(const LossBlock& block, float* gradient, nn::Store store);

  const GradientSchedule& schedule_;
  nn::Activations activations_;
  std::vector<nn::AlignedFloats> gradients_;  // [values] each [block_rows, stride]
  std::vector<nn::AlignedFloats> tangents_;   // [values] the same, or empty
  nn::AlignedFloats scratch_;
  std::vector<GradientInput> step_inputs_;  // of one step
  std::vector<nn::ConstRows> step_values_, step_tangents_;
  std::vector<float*> inputs_, output_gradients_;  // what the loss sees
  std::vector<const float*> outputs_, output_tangents_, input_gradients_;
  std::vector<float> state_;          // [sequences, state]
  std::vector<std::uint8_t> begins_;  // [rows]
};

}  // namespace consac::learn
