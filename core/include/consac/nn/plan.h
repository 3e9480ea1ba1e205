#pragma once
// A NetworkSpec with its names resolved to numbers: what runs it, forward (Activations) or backward (learn/grad).

#include <cstddef>
#include <cstdint>
#include <vector>

#include "consac/nn/ops.h"

namespace consac::nn {

/// Index of "nobody".
inline constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// A value that flows between blocks.
struct PlanValue {
  std::int64_t size = 0;         ///< features
  std::size_t producer = kNone;  ///< step that writes it; kNone for an input of the network
  std::size_t output = kNone;    ///< place among the network's outputs, or kNone
};

/// A block to run.
struct PlanStep {
  PlacedBlock block;                ///< its description
  const Op* op = nullptr;           ///< its row in the table
  std::vector<std::size_t> inputs;  ///< values it reads
  std::size_t output = 0;           ///< value it writes
  std::int64_t state_at = 0;        ///< its part of a slot's state
  std::int64_t state_size = 0;      ///< how much of it
};

/// The resolved network. Values: first the inputs, then one per block.
struct Plan {
  /// Resolves; `network` has been checked, so this cannot fail.
  explicit Plan(const Network& network);

  /// Steps that output `index` needs, in order.
  std::vector<std::size_t> StepsTo(std::size_t index) const;

  std::vector<PlanValue> values;     ///< inputs, then results
  std::vector<PlanStep> steps;       ///< in execution order
  std::vector<std::size_t> outputs;  ///< values that the network's outputs name
  std::size_t input_count = 0;       ///< values that the caller gives
  std::int64_t state_size = 0;       ///< floats of a slot's state
};

/// Floats between rows of an inner value: whole cache lines, and never a multiple of 1 KiB, which would crowd every
/// row into the same few cache sets.
std::int64_t InnerStride(std::int64_t size);

}  // namespace consac::nn
