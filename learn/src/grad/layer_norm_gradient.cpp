// The layer norm block backward. With h the normalised row and g = dz * scale: dx = (g - mean g - h mean(g h)) /
// deviation, dscale = sum of dz h, dshift = sum of dz. Along a tangent the same Jacobian, which is symmetric.

#include "grad/gradient_ops.h"

namespace consac::learn {
namespace {

/// to (+)= (g - mean g - h mean(g h)) * inverse.
void NormaliseJacobian(std::int64_t n, const float* h, float inverse, const float* g, bool add, float* to) {
  float sum = 0.0f, products = 0.0f;
  for (std::int64_t i = 0; i < n; ++i) {
    sum += g[i];
    products += g[i] * h[i];
  }
  const float mean = sum / static_cast<float>(n), slope = products / static_cast<float>(n);
  for (std::int64_t i = 0; i < n; ++i) to[i] = (add ? to[i] : 0.0f) + (g[i] - mean - h[i] * slope) * inverse;
}

std::int64_t LayerNormPackSize(const nn::PlacedBlock& block) {
  return block.out_size;
}

void LayerNormPack(const nn::PlacedBlock& block, const float* parameters, float* packed) {
  for (std::int64_t i = 0; i < block.out_size; ++i) packed[i] = parameters[i];
}

std::int64_t LayerNormScratch(const nn::PlacedBlock& block, std::int64_t) {
  return block.out_size;
}

/// What the activation's derivative is taken from: behind h and the inverse deviation, or the result.
nn::ConstRows ActivationSource(const nn::PlacedBlock& block, nn::ConstRows saved, nn::ConstRows y) {
  return nn::NeedsPreActivation(block.activation) ? nn::ConstRows(saved.data + block.out_size + 1, saved.stride) : y;
}

void LayerNormBackward(const GradientCall& call) {
  const nn::PlacedBlock& block = *call.block;
  const std::int64_t n = block.out_size;
  const GradientInput& input = call.inputs[0];
  nn::MultiplyByDerivative(block.activation, call.rows, n, ActivationSource(block, call.saved, call.y), call.dy);
  float* dscale = call.dparameters;
  for (std::int64_t i = 0; dscale != nullptr && call.store == nn::Store::kOverwrite && i < 2 * n; ++i) dscale[i] = 0.0f;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float *dz = call.dy.data + r * call.dy.stride, *h = call.saved.data + r * call.saved.stride;
    for (std::int64_t i = 0; dscale != nullptr && i < n; ++i) {
      dscale[i] += dz[i] * h[i];
      dscale[n + i] += dz[i];
    }
    if (input.dx.data == nullptr) continue;
    for (std::int64_t i = 0; i < n; ++i) call.scratch[i] = dz[i] * call.packed[i];
    NormaliseJacobian(n, h, h[n], call.scratch, input.store == nn::Store::kAdd, input.dx.data + r * input.dx.stride);
  }
}

std::int64_t LayerNormTangentSize(const nn::PlacedBlock& block) {
  return 3 * block.out_size;
}

void LayerNormPackTangent(const nn::PlacedBlock& block, const float* parameters, const float* direction,
                          float* packed) {
  LayerNormPack(block, parameters, packed);
  for (std::int64_t i = 0; i < 2 * block.out_size; ++i) packed[block.out_size + i] = direction[i];
}

void LayerNormTangent(const TangentCall& call) {
  const nn::PlacedBlock& block = *call.block;
  const std::int64_t n = block.out_size;
  const float *scale = call.packed, *scale_moves = call.packed + n, *shift_moves = call.packed + 2 * n;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* h = call.saved.data + r * call.saved.stride;
    float* dy = call.dy.data + r * call.dy.stride;
    for (std::int64_t i = 0; i < n; ++i) call.scratch[i] = 0.0f;
    if (call.tangents[0].data != nullptr) {
      NormaliseJacobian(n, h, h[n], call.tangents[0].data + r * call.tangents[0].stride, false, call.scratch);
    }
    for (std::int64_t i = 0; i < n; ++i) dy[i] = call.scratch[i] * scale[i] + h[i] * scale_moves[i] + shift_moves[i];
  }
  nn::MultiplyByDerivative(block.activation, call.rows, n, ActivationSource(block, call.saved, call.y), call.dy);
}

}  // namespace

GradientOp LayerNormGradientOp() {
  GradientOp op;
  op.name = "layer_norm";
  op.packed_size = LayerNormPackSize;
  op.pack = LayerNormPack;
  op.scratch = LayerNormScratch;
  op.backward = LayerNormBackward;
  op.tangent_size = LayerNormTangentSize;
  op.pack_tangent = LayerNormPackTangent;
  op.tangent = LayerNormTangent;
  return op;
}

}  // namespace consac::learn
