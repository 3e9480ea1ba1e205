#pragma once
// The dense block: y = activation(x W^T + b). Private to nn; its row stands in ops.cpp.

#include "consac/nn/ops.h"

namespace consac::nn {

/// The row of the dense block.
Op DenseOp();

}  // namespace consac::nn
