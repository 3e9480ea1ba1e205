#pragma once
// The rows of the table of block kinds, one per file of this folder. Private to nn; ops.cpp puts them together.

#include "consac/nn/ops.h"

namespace consac::nn {

/// y = activation(x W^T + b).
Op DenseOp();
/// Q = V + A - mean A.
Op DuellingOp();

}  // namespace consac::nn
