#pragma once
// The rows of the table of block kinds, one per file of this folder. Private to nn; ops.cpp puts them together.

#include "consac/nn/ops.h"

namespace consac::nn {

/// y = activation(x W^T + b).
Op DenseOp();
/// Q = V + A - mean A.
Op DuellingOp();
/// y = activation(patches W^T + b) at every pixel.
Op ConvolutionOp();
/// The same numbers in one row.
Op FlattenOp();
/// The inputs one behind the other.
Op ConcatenationOp();
/// A run of numbers, shaped and divided.
Op SliceOp();
/// The row brought to mean 0 and deviation 1, then scaled and shifted.
Op LayerNormOp();

/// Starts the matrix [out, in] and the bias [out] behind it as block.init and block.gain say.
void InitialiseLinear(const Block& block, std::int64_t in_size, std::int64_t out_size, Rng& rng, float* parameters);

}  // namespace consac::nn
