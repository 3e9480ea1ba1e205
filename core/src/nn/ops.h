#pragma once
// The table of network operations. A new layer is its own file and one row in ops.cpp (and its backward in
// learn/src/grad). Private to core/nn.

#include <span>
#include <string_view>
#include <vector>

#include "consac/nn/network.h"

namespace consac::nn {

/// One row.
struct Op {
  std::string_view name;                                     ///< as Block::op names it
  std::vector<Parameter> (*parameters)(const Block& block);  ///< its tensors, in arena order; offsets unset
};

/// The row of that name, or null.
const Op* FindOp(std::string_view name);
/// All names, for messages.
std::span<const std::string_view> OpNames();

/// Writes the starting values of one tensor of a block.
void InitialiseParameter(const Block& block, const Parameter& parameter, Rng& rng, float* values);

}  // namespace consac::nn
