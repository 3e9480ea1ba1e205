#pragma once
// The backward half of core's table of block kinds (consac/nn/ops.h): one row per kind, found by the same name.

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
};

/// One block's backward work.
struct GradientCall {
  const nn::PlacedBlock* block = nullptr;   ///< which block
  const float* packed = nullptr;            ///< its parameters, packed for backward
  std::int64_t rows = 0;                    ///< samples
  std::span<const GradientInput> inputs;    ///< one per input
  nn::ConstRows y;                          ///< [rows, out_size] what it wrote
  nn::ConstRows saved;                      ///< [rows, Needs::saved] what forward kept, or null
  nn::Rows dy;                              ///< [rows, out_size] with slack; used up
  float* dparameters = nullptr;             ///< the block's part of the gradient
  nn::Store store = nn::Store::kOverwrite;  ///< of dparameters
};

/// How a kind of block runs backward. Functions that a kind has no use for are null.
struct GradientOp {
  std::string_view name;  ///< as in Block::op
  /// Floats for pack.
  std::int64_t (*packed_size)(const nn::PlacedBlock& block) = nullptr;
  /// Arranges parameters for the gradient with respect to the inputs.
  void (*pack)(const nn::PlacedBlock& block, const float* parameters, float* packed) = nullptr;
  /// Runs it.
  void (*backward)(const GradientCall& call) = nullptr;
};

/// The row of that name. Every kind in core's table has one; a test holds the two tables together.
const GradientOp* FindGradientOp(std::string_view name);

/// The rows, one per file.
GradientOp DenseGradientOp();
GradientOp DuellingGradientOp();

}  // namespace consac::learn
