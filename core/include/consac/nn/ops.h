#pragma once
// The table of block kinds. A new layer is one file with these functions, one row in nn/ops.cpp, and its gradient in
// learn/grad. Used by Network, what runs it, and learn/grad; not by users of models.

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "consac/nn/kernels.h"
#include "consac/nn/network.h"

namespace consac::nn {

/// What a block wants from whoever runs it.
struct Needs {
  std::int64_t saved = 0;     ///< floats per row that forward keeps for backward
  std::int64_t scratch = 0;   ///< floats of work space for one call, whatever was in them before
  std::int64_t state = 0;     ///< floats per slot that go from one step to the next
  bool couples_rows = false;  ///< while learning, a row's result depends on the other rows
};

/// One block's forward work. Rows are [steps, sequences]: while acting, and where no block has a state, steps is 1.
struct BlockCall {
  const float* packed = nullptr;      ///< its packed parameters
  std::int64_t rows = 0;              ///< samples
  std::span<const ConstRows> inputs;  ///< one per input: [rows, size]
  Rows output;                        ///< [rows, out_size] to write, with slack
  Rows saved;                         ///< [rows, Needs::saved] to write, or null: nobody learns
  float* scratch = nullptr;           ///< [Needs::scratch]
  std::int64_t steps = 1;             ///< steps in time
  Rows state;  ///< [rows / steps, Needs::state] before the first step; to become that after the last
  const std::uint8_t* begins = nullptr;  ///< [rows] 1: an episode begins, the state before it is zero; null: nowhere
};

/// A kind of block. Functions that a kind has no use for are null.
struct Op {
  std::string_view name;   ///< as in Block::op
  bool activates = false;  ///< its result goes through Block::activation; the others have none
  /// The output's shape, given the inputs'. The error says what it cannot be, and names the block.
  Result<Shape> (*infer)(const Block& block, std::span<const Shape> inputs) = nullptr;
  /// What it makes of its attributes once, for PlacedBlock::details.
  std::shared_ptr<const void> (*prepare)(const PlacedBlock& block) = nullptr;
  /// Its tensors; offsets count from the block's first.
  std::vector<Parameter> (*parameters)(const PlacedBlock& block) = nullptr;
  /// Starting values.
  void (*initialise)(const PlacedBlock& block, Rng& rng, float* parameters) = nullptr;
  /// Floats for pack.
  std::int64_t (*packed_size)(const PlacedBlock& block) = nullptr;
  /// Arranges parameters for the kernels.
  void (*pack)(const PlacedBlock& block, const float* parameters, float* packed) = nullptr;
  /// What it wants, for calls of at most `rows` rows.
  Needs (*needs)(const PlacedBlock& block, std::int64_t rows) = nullptr;
  /// Runs it.
  void (*forward)(const PlacedBlock& block, const BlockCall& call) = nullptr;
};

/// The row of that name, or null.
const Op* FindOp(std::string_view name);
/// All names, for messages.
std::vector<std::string_view> OpNames();
/// Adds a row to the table, for a layer that is not part of this library. `op` stays the caller's and must outlive all
/// use. Not thread-safe: call it before networks are made.
void AddOp(const Op& op);

/// An error that begins with the block's name.
Status BlockFault(const Block& block, std::string_view message);
/// Ok when the block has `count` inputs.
Status CheckInputCount(const Block& block, std::span<const Shape> inputs, std::size_t count);

}  // namespace consac::nn
