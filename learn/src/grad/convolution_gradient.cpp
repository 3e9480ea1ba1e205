// The convolution block backward: dz = dy * activation', dW = dz^T patches, dpatches = dz W, which are added back to
// the image. Patches are read in place, or, of images whose channels come first and of very narrow ones, gathered anew.

#include <algorithm>

#include "consac/nn/convolution.h"
#include "grad/gradient_ops.h"

namespace consac::learn {
namespace {

std::int64_t ConvolutionBackwardSize(const nn::PlacedBlock& block) {
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  return nn::PackedDenseBackwardSize(g.patch(), g.filters);
}

void ConvolutionBackwardPack(const nn::PlacedBlock& block, const float* parameters, float* packed) {
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  nn::PackDenseBackward(parameters, g.patch(), g.filters, packed);
}

std::int64_t ConvolutionScratch(const nn::PlacedBlock& block, std::int64_t) {
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  return g.chunk() * (g.patch_stride() + g.filters) + nn::kSlack;
}

void ConvolutionBackward(const GradientCall& call) {
  const nn::PlacedBlock& block = *call.block;
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  const GradientInput& input = call.inputs[0];
  nn::MultiplyByDerivative(block.activation, call.rows, block.out_size,
                           nn::NeedsPreActivation(block.activation) ? call.saved : call.y, call.dy);
  nn::Store store = call.store;
  const bool in_place = !g.channels_first && nn::SumsPatchesInPlace(g.grid());
  if (in_place && call.dparameters != nullptr) {
    nn::ConvolutionWeightGradient({g.grid(), g.filters, call.rows, input.x, call.dy, call.dparameters,
                                   call.dparameters + g.patch() * g.filters, store});
  }
  const bool gathers = !in_place && call.dparameters != nullptr;
  for (std::int64_t r = 0; r < call.rows && (gathers || input.dx.data != nullptr); ++r) {
    const float* image = input.x.data + r * input.x.stride;
    float* dimage = input.dx.data == nullptr ? nullptr : input.dx.data + r * input.dx.stride;
    if (dimage != nullptr && input.store == nn::Store::kOverwrite) std::fill_n(dimage, block.in_size, 0.0f);
    for (std::int64_t first = 0; first < g.pixels(); first += g.chunk()) {
      const std::int64_t count = std::min(g.chunk(), g.pixels() - first);
      const nn::ConstRows dz(call.dy.data + r * call.dy.stride + first * g.filters, g.filters);
      const nn::DenseShape shape{count, g.patch(), g.filters};
      const nn::Rows patches{call.scratch, g.patch_stride()};
      if (gathers) {
        nn::GatherPatches(g, image, first, count, patches.data);
        nn::DenseWeightGradient(
            {shape, patches, dz, call.dparameters, call.dparameters + g.patch() * g.filters, store});
        store = nn::Store::kAdd;
      }
      if (dimage == nullptr) continue;
      nn::DenseInputGradient({shape, call.packed, dz, patches, nn::Store::kOverwrite});
      nn::ScatterPatches(g, patches.data, first, count, dimage);
    }
  }
}

std::int64_t ConvolutionTangentSize(const nn::PlacedBlock& block) {
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  return 2 * nn::PackedDenseSize(g.patch(), g.filters) + g.filters;
}

void ConvolutionPackTangent(const nn::PlacedBlock& block, const float* parameters, const float* direction,
                            float* packed) {
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  const std::int64_t packing = nn::PackedDenseSize(g.patch(), g.filters);
  nn::PackDense(direction, direction + g.patch() * g.filters, g.patch(), g.filters, packed);
  float* no_bias = packed + 2 * packing;
  std::fill_n(no_bias, g.filters, 0.0f);
  nn::PackDense(parameters, no_bias, g.patch(), g.filters, packed + packing);
}

void ConvolutionTangent(const TangentCall& call) {
  const nn::PlacedBlock& block = *call.block;
  const nn::ConvolutionGeometry& g = nn::ConvolutionGeometry::Of(block);
  const nn::DenseLayer layer{g.patch(), g.filters, nn::Activation::kLinear};
  const nn::Rows patches{call.scratch, g.patch_stride()}, moved{call.scratch + g.chunk() * g.patch_stride(), g.filters};
  const nn::ConstRows& tangent = call.tangents[0];
  for (std::int64_t r = 0; r < call.rows; ++r) {
    for (std::int64_t first = 0; first < g.pixels(); first += g.chunk()) {
      const std::int64_t count = std::min(g.chunk(), g.pixels() - first);
      float* dz = call.dy.data + r * call.dy.stride + first * g.filters;
      nn::GatherPatches(g, call.inputs[0].data + r * call.inputs[0].stride, first, count, patches.data);
      nn::DenseForward(layer, {call.packed, count, patches, {dz, g.filters}, {}});
      if (tangent.data == nullptr) continue;
      nn::GatherPatches(g, tangent.data + r * tangent.stride, first, count, patches.data);
      nn::DenseForward(layer, {call.packed + nn::PackedDenseSize(g.patch(), g.filters), count, patches, moved, {}});
      const auto size = static_cast<std::size_t>(count * g.filters);
      nn::AddTo({moved.data, size}, {dz, size});
    }
  }
  nn::MultiplyByDerivative(block.activation, call.rows, block.out_size,
                           nn::NeedsPreActivation(block.activation) ? call.saved : call.y, call.dy);
}

}  // namespace

GradientOp ConvolutionGradientOp() {
  GradientOp op;
  op.name = "convolution";
  op.packed_size = ConvolutionBackwardSize;
  op.pack = ConvolutionBackwardPack;
  op.scratch = ConvolutionScratch;
  op.backward = ConvolutionBackward;
  op.tangent_size = ConvolutionTangentSize;
  op.pack_tangent = ConvolutionPackTangent;
  op.tangent = ConvolutionTangent;
  return op;
}

}  // namespace consac::learn
