// Blocks without parameters that only move numbers: flatten (one row of numbers of whatever shape), concatenation (the
// inputs one behind the other) and slice (a run of numbers, given a shape and divided: an image out of an observation).

#include "consac/nn/shaping.h"

#include <algorithm>

#include "nn/blocks.h"

namespace consac::nn {
namespace {

Result<Shape> InferFlatten(const Block& block, std::span<const Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(CheckInputCount(block, inputs, 1));
  return Shape{SizeOf(inputs[0])};
}

Result<Shape> InferConcatenation(const Block& block, std::span<const Shape> inputs) {
  if (inputs.empty()) return BlockFault(block, "a concatenation has at least one input");
  std::int64_t size = 0;
  for (const Shape& shape : inputs) size += SizeOf(shape);
  return Shape{size};
}

constexpr std::int64_t kNarrow = 16;  // numbers of a row for which a call that copies them costs more than they do

/// Flatten is a concatenation of one.
void ConcatenationForward(const PlacedBlock& block, const BlockCall& call) {
  float* to = call.output.data;
  for (std::size_t i = 0; i < call.inputs.size(); ++i) {
    const ConstRows& from = call.inputs[i];
    const std::int64_t size = SizeOf(block.in_shapes[i]);
    for (std::int64_t r = 0; size >= kNarrow && r < call.rows; ++r)
      std::copy_n(from.data + r * from.stride, size, to + r * call.output.stride);
    for (std::int64_t k = 0; size < kNarrow && k < size; ++k) {
      for (std::int64_t r = 0; r < call.rows; ++r) to[r * call.output.stride + k] = from.data[r * from.stride + k];
    }
    to += size;
  }
}

Result<Shape> InferSlice(const Block& block, std::span<const Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(CheckInputCount(block, inputs, 1));
  const Shape shape = block.attributes.Integers("shape").value_or(Shape());
  const std::int64_t size = SizeOf(shape), offset = block.attributes.Integer("offset").value_or(0);
  if (shape.empty() || size < 1 || offset < 0 || offset > SizeOf(inputs[0]) - size) {
    return BlockFault(block, "a slice needs the attribute shape, and with offset it must lie within " +
                                 std::to_string(SizeOf(inputs[0])) + " features");
  }
  if (block.attributes.contains("divide_by") && !(block.attributes.Number("divide_by").value_or(0.0) > 0.0))
    return BlockFault(block, "divide_by must be a number above 0");
  return shape;
}

std::shared_ptr<const void> PrepareSlice(const PlacedBlock& block) {
  return std::make_shared<const SliceNumbers>(
      SliceNumbers{block.attributes.Integer("offset").value_or(0),
                   static_cast<float>(block.attributes.Number("divide_by").value_or(1.0))});
}

void SliceForward(const PlacedBlock& block, const BlockCall& call) {
  const SliceNumbers& slice = SliceNumbers::Of(block);
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* from = call.inputs[0].data + r * call.inputs[0].stride + slice.offset;
    float* to = call.output.data + r * call.output.stride;
    const auto size = static_cast<std::size_t>(block.out_size);
    if (slice.divisor == 1.0f)
      std::copy_n(from, size, to);
    else
      Divide(slice.divisor, {from, size}, {to, size});
  }
}

}  // namespace

Op FlattenOp() {
  Op op;
  op.name = "flatten";
  op.infer = InferFlatten;
  op.forward = ConcatenationForward;
  return op;
}

Op ConcatenationOp() {
  Op op;
  op.name = "concatenation";
  op.infer = InferConcatenation;
  op.forward = ConcatenationForward;
  return op;
}

Op SliceOp() {
  Op op;
  op.name = "slice";
  op.infer = InferSlice;
  op.prepare = PrepareSlice;
  op.forward = SliceForward;
  return op;
}

}  // namespace consac::nn
