#pragma once
// The backward half of core's table of block kinds (consac/nn/ops.h): one row per kind, found by the same name. A
// layer that is not part of this library brings its row by AddGradientOp.

#include <cstdint>
#include <span>
#include <string_view>

#include "consac/nn/ops.h"

namespace consac::learn {

/// One input of a block's backward work.
struct GradientInput {
  nn::ConstRows x;                          ///< [rows, size] what it read, with slack
  nn::Rows dx;                              ///< [rows, size] the gradient with respect to it, or null: not wanted
  nn::Store store = nn::Store::kOverwrite;  ///< of dx
  bool rectified = false;  ///< asked of dense blocks alone: x is a dense block's relu, and dx wanted before it
};

/// One block's backward work.
struct GradientCall {
  const nn::PlacedBlock* block = nullptr;   ///< which block
  const float* packed = nullptr;            ///< its parameters, packed for backward
  std::int64_t rows = 0;                    ///< samples: [steps, rows / steps]
  std::span<const GradientInput> inputs;    ///< one per input
  nn::ConstRows y;                          ///< [rows, out_size] what it wrote
  nn::ConstRows saved;                      ///< [rows, Needs::saved] what forward kept, or null
  nn::Rows dy;                              ///< [rows, out_size] with slack; becomes dz where there is an activation
  bool is_dz = false;                       ///< of dense blocks alone: dy is dz already
  float* dparameters = nullptr;             ///< the block's part of the gradient, or null: not wanted
  nn::Store store = nn::Store::kOverwrite;  ///< of dparameters
  float* scratch = nullptr;                 ///< [GradientOp::scratch]
  std::int64_t steps = 1;                   ///< steps in time
  const std::uint8_t* begins = nullptr;     ///< [rows] 1: an episode begins; null: nowhere
};

/// One block's forward-mode work: how its output moves when inputs and parameters move.
struct TangentCall {
  const nn::PlacedBlock* block = nullptr;   ///< which block
  const float* packed = nullptr;            ///< parameters and direction, from pack_tangent
  std::int64_t rows = 0;                    ///< samples
  std::span<const nn::ConstRows> inputs;    ///< one per input: [rows, size] what it read
  std::span<const nn::ConstRows> tangents;  ///< one per input: [rows, size] how that moves, or null: not at all
  nn::ConstRows y;                          ///< [rows, out_size] what it wrote
  nn::ConstRows saved;                      ///< [rows, Needs::saved] what forward kept, or null
  nn::Rows dy;                              ///< [rows, out_size] how the output moves, to write
  float* scratch = nullptr;                 ///< [GradientOp::scratch]
};

/// How a kind of block runs backward and along a tangent. Functions that a kind has no use for are null.
struct GradientOp {
  std::string_view name;  ///< as in Block::op
  /// Floats for pack.
  std::int64_t (*packed_size)(const nn::PlacedBlock& block) = nullptr;
  /// Arranges parameters for the gradient with respect to the inputs.
  void (*pack)(const nn::PlacedBlock& block, const float* parameters, float* packed) = nullptr;
  /// Floats of work space of one call of at most `rows` rows.
  std::int64_t (*scratch)(const nn::PlacedBlock& block, std::int64_t rows) = nullptr;
  /// Runs it.
  void (*backward)(const GradientCall& call) = nullptr;
  /// Floats for pack_tangent.
  std::int64_t (*tangent_size)(const nn::PlacedBlock& block) = nullptr;
  /// Arranges parameters and a direction of them for tangent.
  void (*pack_tangent)(const nn::PlacedBlock& block, const float* parameters, const float* direction,
                       float* packed) = nullptr;
  /// Runs it forward along a tangent; null: the kind has none (yet), and Backpropagation refuses to be made for it.
  void (*tangent)(const TangentCall& call) = nullptr;
};

/// The row of that name. Every kind in core's table has one; a test holds the two tables together.
const GradientOp* FindGradientOp(std::string_view name);
/// Adds a row, as nn::AddOp does for the forward half. `op` must outlive all use.
void AddGradientOp(const GradientOp& op);

/// The rows, one function per kind.
GradientOp DenseGradientOp();
GradientOp DuellingGradientOp();
GradientOp ConvolutionGradientOp();
GradientOp FlattenGradientOp();
GradientOp ConcatenationGradientOp();
GradientOp SliceGradientOp();
GradientOp LayerNormGradientOp();

}  // namespace consac::learn
