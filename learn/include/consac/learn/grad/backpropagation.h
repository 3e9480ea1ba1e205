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

/// Rows of one block; the last of a minibatch may hold fewer. Networks with a state or with coupled rows have larger
/// ones (Backpropagation::block_rows).
inline constexpr std::int64_t kBlockRows = 64;

/// One block of a minibatch, as the loss sees it. With a state its rows are [steps, sequences].
struct LossBlock {
  std::int64_t index = 0;                    ///< 0, 1, ... within the minibatch
  std::int64_t first_row = 0;                ///< row of the minibatch that is row 0 here
  std::int64_t rows = 0;                     ///< at most block_rows
  std::span<float* const> inputs;            // one per network input: [rows, size], to be filled by Gather
  std::span<const float* const> outputs;     // one per network output: [rows, size]
  std::span<float* const> output_gradients;  // one per network output: [rows, size], to be filled by Loss
  std::span<float> extra_gradient;           // [extra] of parameters outside the network (log_std): add to it
  std::int64_t steps = 1;                    ///< steps in time
  std::span<float> state = {};               // [sequences, state size] before the first step; zeros unless Gather fills
  std::span<std::uint8_t> begins = {};       // [rows] 1: an episode begins here; zeros unless Gather fills
  std::span<const float* const> output_tangents = {};  // one per network output: [rows, size]; only of RunAlong
  std::span<const float* const> input_gradients =
      {};  // one per network input: [rows, size], or null; only in InputGradients
};

/// What an algorithm brings. Calls for different blocks may come from different threads.
class BlockLoss {
 public:
  virtual ~BlockLoss() = default;
  /// Copies the block's rows into block.inputs.
  virtual void Gather(const LossBlock& block) = 0;
  /// Reads block.outputs, writes d(loss)/d(output) into block.output_gradients and adds to block.extra_gradient.
  virtual void Loss(const LossBlock& block) = 0;
  /// Reads block.input_gradients, d(loss)/d(input), where they were asked for.
  virtual void InputGradients(const LossBlock& block) { static_cast<void>(block); }
};

/// Sees what went through each block of a network and what came back, for curvature as K-FAC's. Calls for different
/// blocks may come from different threads.
class BlockObserver {
 public:
  virtual ~BlockObserver() = default;
  /// Step `step` of the network read the rows `x` (its first input) and has d(loss)/d(what its activation was given)
  /// `dz`; each row-major with the floats between rows.
  virtual void Observe(const LossBlock& block, std::size_t step, const float* x, std::int64_t x_stride, const float* dz,
                       std::int64_t dz_stride) = 0;
};

/// What is differentiated, and for how many rows.
struct BackpropagationOptions {
  std::int64_t extra = 0;             ///< further parameters behind the network's in the arena
  std::int64_t max_rows = 1;          ///< of a minibatch
  std::int64_t steps = 1;             ///< steps of each sequence, where the network has a state
  std::int64_t first_parameter = 0;   ///< parameters before it are held fast
  std::int64_t parameter_count = -1;  ///< learned ones from the first on; -1: all; others have gradient 0
  bool input_gradients = false;       ///< BlockLoss::InputGradients is called
  std::int64_t first_input = 0;  ///< inputs before it have no gradient there: their layers need not be gone through
  bool tangents = false;         ///< RunAlong may be called
  BlockObserver* observer = nullptr;  ///< sees every block of the network; null: nobody looks
  std::shared_ptr<const nn::PackedNetwork> packed =
      nullptr;  ///< what another packs for forward; null: it packs for itself
};

/// Gradients of a network. Allocates at creation only.
class Backpropagation {
 public:
  /// For minibatches of at most `max_rows` rows, with `extra` further parameters.
  Backpropagation(const nn::Network& network, std::int64_t extra, std::int64_t max_rows);
  /// With everything that may be said. With tangents every block kind of the network must have one (HasTangent).
  Backpropagation(const nn::Network& network, const BackpropagationOptions& options);
  ~Backpropagation();
  Backpropagation(Backpropagation&&) noexcept;

  /// How many gradients it keeps, each of [network parameters + extra]: for whoever counts memory before creation.
  static std::int64_t GradientCopies(const nn::Network& network, std::int64_t max_rows);
  /// Whether few rows of `network` are work enough to be shared between threads: by its parameters alone.
  static bool IsWide(const nn::Network& network);
  /// Bytes of what flows through `network` and back, in all lanes of such minibatches: for them too.
  static std::int64_t ActivationBytes(const nn::Network& network, std::int64_t max_rows);
  /// Whether all block kinds of `network` can be run along a tangent.
  static bool HasTangent(const nn::Network& network);

  /// Rows of one block of a minibatch: kBlockRows, or whole sequences, or the whole minibatch where rows are coupled.
  std::int64_t block_rows() const;
  /// The parameters of the latest Load or Run as an Evaluator or another Backpropagation of this network reads them.
  std::shared_ptr<const nn::PackedNetwork> packed() const;
  /// Packs `parameters` ([network parameters + extra]) for RunLoaded.
  void Load(std::span<const float> parameters);
  /// Run at the parameters of the latest Load or Run.
  void RunLoaded(std::int64_t rows, const Executor& executor, BlockLoss& loss);
  /// Computes the gradient of one minibatch at `parameters` ([network parameters + extra]); overwrites gradient().
  void Run(std::span<const float> parameters, std::int64_t rows, const Executor& executor, BlockLoss& loss);
  /// The same; the loss also sees how the outputs move when the network's parameters move along `direction`
  /// ([network parameters]): J v, so that a loss that puts F J v into the output gradients leaves J^T F J v, the
  /// Fisher-vector product, in gradient().
  void RunAlong(std::span<const float> parameters, std::span<const float> direction, std::int64_t rows,
                const Executor& executor, BlockLoss& loss);
  /// [network parameters + extra], of the last Run.
  std::span<float> gradient();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace consac::learn
