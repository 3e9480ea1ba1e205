// The duelling block backward: of Q = V + A - mean A, dV is the sum of dQ and dA is dQ less its mean.

#include "grad/gradient_ops.h"

namespace consac::learn {
namespace {

void DuellingBackward(const GradientCall& call) {
  const std::int64_t n = call.block->out_size;
  const GradientInput &value = call.inputs[0], &advantages = call.inputs[1];
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* dq = call.dy.data + r * call.dy.stride;
    float sum = 0.0f;
    for (std::int64_t i = 0; i < n; ++i) sum += dq[i];
    if (value.dx.data != nullptr) {
      float& dv = value.dx.data[r * value.dx.stride];
      dv = (value.store == nn::Store::kAdd ? dv : 0.0f) + sum;
    }
    if (advantages.dx.data == nullptr) continue;
    const float mean = sum / static_cast<float>(n);
    float* da = advantages.dx.data + r * advantages.dx.stride;
    for (std::int64_t i = 0; i < n; ++i) da[i] = (advantages.store == nn::Store::kAdd ? da[i] : 0.0f) + dq[i] - mean;
  }
}

/// Q is linear in V and A: it moves as they do.
void DuellingTangent(const TangentCall& call) {
  const std::int64_t n = call.block->out_size;
  const nn::ConstRows &value = call.tangents[0], &advantages = call.tangents[1];
  for (std::int64_t r = 0; r < call.rows; ++r) {
    float* dq = call.dy.data + r * call.dy.stride;
    float sum = 0.0f;
    for (std::int64_t i = 0; i < n; ++i) {
      dq[i] = advantages.data == nullptr ? 0.0f : advantages.data[r * advantages.stride + i];
      sum += dq[i];
    }
    const float shift = (value.data == nullptr ? 0.0f : value.data[r * value.stride]) - sum / static_cast<float>(n);
    for (std::int64_t i = 0; i < n; ++i) dq[i] += shift;
  }
}

}  // namespace

GradientOp DuellingGradientOp() {
  GradientOp op;
  op.name = "duelling";
  op.backward = DuellingBackward;
  op.tangent = DuellingTangent;
  return op;
}

}  // namespace consac::learn
