// The dense block backward: dz = dy * activation', dx = dz W, dW = dz^T x, db = column sums of dz.

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
  nn::MultiplyByDerivative(block.activation, call.rows, block.out_size,
                           nn::NeedsPreActivation(block.activation) ? call.saved : call.y, call.dy);
  nn::DenseWeightGradient(
      {shape, input.x, call.dy, call.dparameters, call.dparameters + block.in_size * block.out_size, call.store});
  if (input.dx.data != nullptr) nn::DenseInputGradient({shape, call.packed, call.dy, input.dx, input.store});
}

}  // namespace

GradientOp DenseGradientOp() {
  return {"dense", DenseBackwardSize, DenseBackwardPack, DenseBackward};
}

}  // namespace consac::learn
