#pragma once
// The table of block kinds. A new layer is one file with these functions, one row in nn/ops.cpp, and its gradient in
// learn/grad. Used by Network, Evaluator and learn/grad; not by users of models.

#include <cstdint>
#include <string_view>
#include <vector>

#include "consac/nn/kernels.h"
#include "consac/nn/network.h"

namespace consac::nn {

/// A kind of block.
struct Op {
  std::string_view name;                                     ///< as in Block::op
  Status (*validate)(const Block& block);                    ///< sizes that it cannot have; names the block
  std::vector<Parameter> (*parameters)(const Block& block);  ///< its tensors; offsets count from the block's first
  void (*initialise)(const Block& block, Rng& rng, float* parameters);       ///< starting values
  std::int64_t (*packed_size)(const Block& block);                           ///< floats for pack
  void (*pack)(const Block& block, const float* parameters, float* packed);  ///< arranges for the kernels
  void (*forward)(const Block& block, const ForwardCall& call);              ///< runs it
};

/// The row of that name, or null.
const Op* FindOp(std::string_view name);
/// All names, for messages.
std::vector<std::string_view> OpNames();

}  // namespace consac::nn
