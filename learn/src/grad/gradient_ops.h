#pragma once
// The backward half of core's table of block kinds (consac/nn/ops.h): one row per kind, found by the same name.

#include <cstdint>
#include <string_view>

#include "consac/nn/kernels.h"
#include "consac/nn/network.h"

namespace consac::learn {

/// One block's backward work.
struct GradientCall {
  const nn::Block* block = nullptr;            ///< which block
  const float* packed = nullptr;               ///< its parameters, packed for backward
  std::int64_t rows = 0;                       ///< samples
  nn::ConstRows x;                             ///< [rows, in_size] what it read, with slack
  nn::ConstRows y;                             ///< [rows, out_size] what it wrote
  nn::ConstRows z;                             ///< [rows, out_size] before the activation, or null
  nn::Rows dy;                                 ///< [rows, out_size] with slack; used up
  nn::Rows dx;                                 ///< [rows, in_size], or null: not wanted
  nn::Store dx_store = nn::Store::kOverwrite;  ///< of dx
  float* dparameters = nullptr;                ///< the block's part of the gradient
  nn::Store store = nn::Store::kOverwrite;     ///< of dparameters
};

/// How a kind of block runs backward.
struct GradientOp {
  std::string_view name;                                                         ///< as in Block::op
  std::int64_t (*packed_size)(const nn::Block& block);                           ///< floats for pack
  void (*pack)(const nn::Block& block, const float* parameters, float* packed);  ///< arranges for backward
  void (*backward)(const GradientCall& call);                                    ///< runs it
};

/// The row of that name. Every kind in core's table has one; a test holds the two tables together.
const GradientOp* FindGradientOp(std::string_view name);

/// The row of the dense block.
GradientOp DenseGradientOp();

}  // namespace consac::learn
