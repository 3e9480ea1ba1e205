// Blocks that only move numbers, backward: the gradient moves the other way. Along a tangent they do what they do
// forward.

#include <algorithm>

#include "consac/nn/shaping.h"
#include "grad/gradient_ops.h"

namespace consac::learn {
namespace {

void ConcatenationBackward(const GradientCall& call) {
  const float* from = call.dy.data;
  for (std::size_t i = 0; i < call.inputs.size(); ++i) {
    const GradientInput& input = call.inputs[i];
    const std::int64_t size = nn::SizeOf(call.block->in_shapes[i]);
    for (std::int64_t r = 0; input.dx.data != nullptr && r < call.rows; ++r) {
      float* to = input.dx.data + r * input.dx.stride;
      for (std::int64_t k = 0; k < size; ++k)
        to[k] = (input.store == nn::Store::kAdd ? to[k] : 0.0f) + from[r * call.dy.stride + k];
    }
    from += size;
  }
}

void ConcatenationTangent(const TangentCall& call) {
  for (std::int64_t r = 0; r < call.rows; ++r) {
    float* to = call.dy.data + r * call.dy.stride;
    for (std::size_t i = 0; i < call.tangents.size(); ++i) {
      const std::int64_t size = nn::SizeOf(call.block->in_shapes[i]);
      const nn::ConstRows& moved = call.tangents[i];
      to = moved.data == nullptr ? std::fill_n(to, size, 0.0f) : std::copy_n(moved.data + r * moved.stride, size, to);
    }
  }
}

void SliceBackward(const GradientCall& call) {
  const nn::SliceNumbers& slice = nn::SliceNumbers::Of(*call.block);
  const GradientInput& input = call.inputs[0];
  if (input.dx.data == nullptr) return;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    float* to = input.dx.data + r * input.dx.stride;
    if (input.store == nn::Store::kOverwrite) std::fill_n(to, call.block->in_size, 0.0f);
    const float* from = call.dy.data + r * call.dy.stride;
    for (std::int64_t i = 0; i < call.block->out_size; ++i) to[slice.offset + i] += from[i] / slice.divisor;
  }
}

void SliceTangent(const TangentCall& call) {
  const nn::SliceNumbers& slice = nn::SliceNumbers::Of(*call.block);
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* from =
        call.tangents[0].data == nullptr ? nullptr : call.tangents[0].data + r * call.tangents[0].stride;
    float* to = call.dy.data + r * call.dy.stride;
    for (std::int64_t i = 0; i < call.block->out_size; ++i)
      to[i] = from == nullptr ? 0.0f : from[slice.offset + i] / slice.divisor;
  }
}

}  // namespace

GradientOp FlattenGradientOp() {
  GradientOp op;
  op.name = "flatten";
  op.backward = ConcatenationBackward;
  op.tangent = ConcatenationTangent;
  return op;
}

GradientOp ConcatenationGradientOp() {
  GradientOp op;
  op.name = "concatenation";
  op.backward = ConcatenationBackward;
  op.tangent = ConcatenationTangent;
  return op;
}

GradientOp SliceGradientOp() {
  GradientOp op;
  op.name = "slice";
  op.backward = SliceBackward;
  op.tangent = SliceTangent;
  return op;
}

}  // namespace consac::learn
