// The duelling block: Q = V + A - mean of A, from the inputs V [1] and A [n]. Source: Wang et al. 2016,
// arXiv:1511.06581, eq. 9.

#include "nn/blocks.h"

namespace consac::nn {
namespace {

Result<Shape> InferDuelling(const Block& block, std::span<const Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(CheckInputCount(block, inputs, 2));
  if (SizeOf(inputs[0]) != 1) {
    return BlockFault(block,
                      "its first input is the state's value, 1 number, not " + std::to_string(SizeOf(inputs[0])));
  }
  return Shape{SizeOf(inputs[1])};
}

void DuellingForward(const PlacedBlock& block, const BlockCall& call) {
  const std::int64_t n = block.out_size;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* advantages = call.inputs[1].data + r * call.inputs[1].stride;
    float sum = 0.0f;
    for (std::int64_t i = 0; i < n; ++i) sum += advantages[i];
    const float shift = call.inputs[0].data[r * call.inputs[0].stride] - sum / static_cast<float>(n);
    float* q = call.output.data + r * call.output.stride;
    for (std::int64_t i = 0; i < n; ++i) q[i] = advantages[i] + shift;
  }
}

}  // namespace

Op DuellingOp() {
  Op op;
  op.name = "duelling";
  op.infer = InferDuelling;
  op.forward = DuellingForward;
  return op;
}

}  // namespace consac::nn
