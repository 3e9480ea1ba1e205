// The layer norm block: act((x - mean) / sqrt(variance + epsilon) * scale + shift) over the features of a row. Tensors:
// scale [features], shift [features]. Source: Ba et al. 2016, arXiv:1607.06450; epsilon as in PyTorch unless the
// attribute says otherwise.

#include <cmath>

#include "nn/blocks.h"

namespace consac::nn {
namespace {

constexpr double kLayerNormEpsilon = 1e-5;

Result<Shape> InferLayerNorm(const Block& block, std::span<const Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(CheckInputCount(block, inputs, 1));
  if (block.attributes.contains("epsilon") && !(block.attributes.Number("epsilon").value_or(0.0) > 0.0))
    return BlockFault(block, "epsilon must be a number above 0");
  return inputs[0];
}

std::shared_ptr<const void> PrepareLayerNorm(const PlacedBlock& block) {
  return std::make_shared<const float>(
      static_cast<float>(block.attributes.Number("epsilon").value_or(kLayerNormEpsilon)));
}

std::vector<Parameter> LayerNormParameters(const PlacedBlock& block) {
  return {{block.name + "/scale", {block.out_size}, 0, block.out_size},
          {block.name + "/shift", {block.out_size}, block.out_size, block.out_size}};
}

void InitialiseLayerNorm(const PlacedBlock& block, Rng&, float* parameters) {
  for (std::int64_t i = 0; i < block.out_size; ++i) {
    parameters[i] = 1.0f;
    parameters[block.out_size + i] = 0.0f;
  }
}

std::int64_t LayerNormPackedSize(const PlacedBlock& block) {
  return 2 * block.out_size;
}

void PackLayerNorm(const PlacedBlock& block, const float* parameters, float* packed) {
  for (std::int64_t i = 0; i < 2 * block.out_size; ++i) packed[i] = parameters[i];
}

/// Saved: the normalised row, 1 / deviation, and the row before the activation where that needs it.
Needs LayerNormNeeds(const PlacedBlock& block, std::int64_t) {
  Needs needs;
  needs.saved = (NeedsPreActivation(block.activation) ? 2 : 1) * block.out_size + 1;
  return needs;
}

void LayerNormForward(const PlacedBlock& block, const BlockCall& call) {
  const std::int64_t n = block.out_size;
  const float epsilon = *static_cast<const float*>(block.details.get());
  const float *scale = call.packed, *shift = call.packed + n;
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* x = call.inputs[0].data + r * call.inputs[0].stride;
    float* y = call.output.data + r * call.output.stride;
    float sum = 0.0f, squares = 0.0f;
    for (std::int64_t i = 0; i < n; ++i) sum += x[i];
    const float mean = sum / static_cast<float>(n);
    for (std::int64_t i = 0; i < n; ++i) squares += (x[i] - mean) * (x[i] - mean);
    const float inverse = 1.0f / std::sqrt(squares / static_cast<float>(n) + epsilon);
    for (std::int64_t i = 0; i < n; ++i) y[i] = (x[i] - mean) * inverse * scale[i] + shift[i];
    if (call.saved.data == nullptr) continue;
    float* saved = call.saved.data + r * call.saved.stride;
    for (std::int64_t i = 0; i < n; ++i) saved[i] = (x[i] - mean) * inverse;
    saved[n] = inverse;
    for (std::int64_t i = 0; i < n && NeedsPreActivation(block.activation); ++i) saved[n + 1 + i] = y[i];
  }
  Activate(block.activation, call.rows, n, call.output, call.output);
}

}  // namespace

Op LayerNormOp() {
  Op op;
  op.name = "layer_norm";
  op.activates = true;
  op.infer = InferLayerNorm;
  op.prepare = PrepareLayerNorm;
  op.parameters = LayerNormParameters;
  op.initialise = InitialiseLayerNorm;
  op.packed_size = LayerNormPackedSize;
  op.pack = PackLayerNorm;
  op.needs = LayerNormNeeds;
  op.forward = LayerNormForward;
  return op;
}

}  // namespace consac::nn
