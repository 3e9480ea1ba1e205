// The dense block backward: dz = dy * activation', dx = dz W, dW = dz^T x, db = column sums of dz; and along a tangent:
// z' = x W'^T + b' + x' W^T.

#include <algorithm>

#include "grad/gradient_ops.h"

namespace consac::learn {
namespace {

std::int64_t DenseBackwardSize(const nn::PlacedBlock& block) {
  return nn::PackedDenseBackwardSize(block.in_size, block.out_size);
}

void DenseBackwardPack(const nn::PlacedBlock& block, const float* parameters, float* packed) {
  nn::PackDenseBackward(parameters, block.in_size, block.out_size, packed);
}

void DenseBackward(const GradientCall& call) {
  const nn::PlacedBlock& block = *call.block;
  const GradientInput& input = call.inputs[0];
  const nn::DenseShape shape{call.rows, block.in_size, block.out_size};
  if (!call.is_dz) {
    nn::MultiplyByDerivative(block.activation, call.rows, block.out_size,
                             nn::NeedsPreActivation(block.activation) ? call.saved : call.y, call.dy);
  }
  if (call.dparameters != nullptr) {
    nn::DenseWeightGradient(
        {shape, input.x, call.dy, call.dparameters, call.dparameters + block.in_size * block.out_size, call.store});
  }
  if (input.dx.data == nullptr) return;
  const nn::ConstRows rectified = input.rectified ? input.x : nn::ConstRows();
  nn::DenseInputGradient({shape, call.packed, call.dy, input.dx, input.store, rectified});
}

std::int64_t DenseTangentSize(const nn::PlacedBlock& block) {
  return 2 * nn::PackedDenseSize(block.in_size, block.out_size) + block.out_size;
}

void DensePackTangent(const nn::PlacedBlock& block, const float* parameters, const float* direction, float* packed) {
  const std::int64_t weights = block.in_size * block.out_size;
  nn::PackDense(direction, direction + weights, block.in_size, block.out_size, packed);
  const std::int64_t packing = nn::PackedDenseSize(block.in_size, block.out_size);
  float* no_bias = packed + 2 * packing;
  std::fill_n(no_bias, block.out_size, 0.0f);
  nn::PackDense(parameters, no_bias, block.in_size, block.out_size, packed + packing);
}

std::int64_t DenseScratch(const nn::PlacedBlock& block, std::int64_t rows) {
  return rows * block.out_size;
}

void DenseTangent(const TangentCall& call) {
  const nn::PlacedBlock& block = *call.block;
  const nn::DenseLayer layer{block.in_size, block.out_size, nn::Activation::kLinear};
  nn::DenseForward(layer, {call.packed, call.rows, call.inputs[0], call.dy, {}});
  if (call.tangents[0].data != nullptr) {
    const nn::Rows moved{call.scratch, block.out_size};
    nn::DenseForward(
        layer,
        {call.packed + nn::PackedDenseSize(block.in_size, block.out_size), call.rows, call.tangents[0], moved, {}});
    const auto size = static_cast<std::size_t>(block.out_size);
    for (std::int64_t r = 0; r < call.rows; ++r)
      nn::AddTo({moved.data + r * moved.stride, size}, {call.dy.data + r * call.dy.stride, size});
  }
  nn::MultiplyByDerivative(block.activation, call.rows, block.out_size,
                           nn::NeedsPreActivation(block.activation) ? call.saved : call.y, call.dy);
}

}  // namespace

GradientOp DenseGradientOp() {
  GradientOp op;
  op.name = "dense";
  op.packed_size = DenseBackwardSize;
  op.pack = DenseBackwardPack;
  op.scratch = DenseScratch;
  op.backward = DenseBackward;
  op.tangent_size = DenseTangentSize;
  op.pack_tangent = DensePackTangent;
  op.tangent = DenseTangent;
  return op;
}

}  // namespace consac::learn
