// The convolution block: two-dimensional, without padding, as patches times a matrix, which are read in place or, of
// images whose channels come first, copied. Tensors: w [filters, kernel
// height, kernel width, channels], b [filters].

#include "consac/nn/convolution.h"

#include <algorithm>
#include <cstring>

#include "consac/base/text.h"
#include "consac/nn/plan.h"
#include "nn/blocks.h"

namespace consac::nn {
namespace {

constexpr std::int64_t kPatchFloats = 48 << 10;  // of one chunk; with the weights it stays in the second cache
constexpr std::int64_t kLargestImage = 1 << 20;

/// Two whole numbers of an attribute, each at least 1.
Status ReadPair(const Block& block, const char* name, std::int64_t* height, std::int64_t* width) {
  const auto pair = block.attributes.Integers(name);
  if (!pair.has_value() || pair->size() != 2 || std::min((*pair)[0], (*pair)[1]) < 1 ||
      std::max((*pair)[0], (*pair)[1]) > kLargestImage) {
    return BlockFault(block, std::string("a convolution needs the attribute ") + name + ": [height, width], from 1");
  }
  *height = (*pair)[0];
  *width = (*pair)[1];
  return {};
}

Result<Shape> InferConvolution(const Block& block, std::span<const Shape> inputs) {
  CONSAC_RETURN_IF_ERROR(CheckInputCount(block, inputs, 1));
  const Result<ConvolutionGeometry> geometry = ConvolutionGeometry::Of(block, inputs[0]);
  if (!geometry.ok()) return geometry.status();
  return Shape{geometry->out_height, geometry->out_width, geometry->filters};
}

std::shared_ptr<const void> PrepareConvolution(const PlacedBlock& block) {
  return std::make_shared<const ConvolutionGeometry>(*ConvolutionGeometry::Of(block, block.in_shapes[0]));
}

std::vector<Parameter> ConvolutionParameters(const PlacedBlock& block) {
  const ConvolutionGeometry& g = ConvolutionGeometry::Of(block);
  const std::int64_t weights = g.filters * g.patch();
  return {{block.name + "/w", {g.filters, g.kernel_height, g.kernel_width, g.channels}, 0, weights},
          {block.name + "/b", {g.filters}, weights, g.filters}};
}

void InitialiseConvolution(const PlacedBlock& block, Rng& rng, float* parameters) {
  const ConvolutionGeometry& g = ConvolutionGeometry::Of(block);
  InitialiseLinear(block, g.patch(), g.filters, rng, parameters);
}

std::int64_t ConvolutionPackedSize(const PlacedBlock& block) {
  const ConvolutionGeometry& g = ConvolutionGeometry::Of(block);
  return PackedDenseSize(g.patch(), g.filters);
}

void PackConvolution(const PlacedBlock& block, const float* parameters, float* packed) {
  const ConvolutionGeometry& g = ConvolutionGeometry::Of(block);
  PackDense(parameters, parameters + g.patch() * g.filters, g.patch(), g.filters, packed);
}

bool ReadsPatchesInPlace(const ConvolutionGeometry& g) {
  return !g.channels_first && ConvolvesInPlace(g.filters);
}

Needs ConvolutionNeeds(const PlacedBlock& block, std::int64_t) {
  const ConvolutionGeometry& g = ConvolutionGeometry::Of(block);
  Needs needs;
  if (!ReadsPatchesInPlace(g)) needs.scratch = g.chunk() * g.patch_stride();
  if (NeedsPreActivation(block.activation)) needs.saved = block.out_size;
  return needs;
}

void ConvolutionForward(const PlacedBlock& block, const BlockCall& call) {
  const ConvolutionGeometry& g = ConvolutionGeometry::Of(block);
  if (ReadsPatchesInPlace(g)) {
    return Convolve({g.grid(),
                     {g.patch(), g.filters, block.activation},
                     call.packed,
                     call.rows,
                     call.inputs[0],
                     call.output,
                     call.saved});
  }
  for (std::int64_t r = 0; r < call.rows; ++r) {
    const float* image = call.inputs[0].data + r * call.inputs[0].stride;
    float* y = call.output.data + r * call.output.stride;
    float* z = call.saved.data == nullptr ? nullptr : call.saved.data + r * call.saved.stride;
    for (std::int64_t first = 0; first < g.pixels(); first += g.chunk()) {
      const std::int64_t count = std::min(g.chunk(), g.pixels() - first), at = first * g.filters;
      GatherPatches(g, image, first, count, call.scratch);
      DenseForward({g.patch(), g.filters, block.activation}, {call.packed,
                                                              count,
                                                              {call.scratch, g.patch_stride()},
                                                              {y + at, g.filters},
                                                              {z == nullptr ? nullptr : z + at, g.filters}});
    }
  }
}

}  // namespace

Result<ConvolutionGeometry> ConvolutionGeometry::Of(const Block& block, const Shape& image) {
  ConvolutionGeometry g;
  if (image.size() != 3)
    return BlockFault(block, "a convolution reads images of three sizes, not of " + std::to_string(image.size()));
  const std::string layout = block.attributes.Text("layout").value_or("HWC");
  if (layout != "HWC" && layout != "CHW")
    return BlockFault(block, "the layout of its images is \"HWC\" or \"CHW\", not " + Quote(layout));
  g.channels_first = layout == "CHW";
  g.channels = image[g.channels_first ? 0 : 2];
  g.height = image[g.channels_first ? 1 : 0];
  g.width = image[g.channels_first ? 2 : 1];
  CONSAC_RETURN_IF_ERROR(ReadPair(block, "kernel", &g.kernel_height, &g.kernel_width));
  CONSAC_RETURN_IF_ERROR(ReadPair(block, "stride", &g.stride_height, &g.stride_width));
  g.filters = block.attributes.Integer("filters").value_or(0);
  if (g.filters < 1 || g.filters > kLargestImage)
    return BlockFault(block, "a convolution needs the attribute filters: how many, from 1");
  if (g.kernel_height > g.height || g.kernel_width > g.width) {
    return BlockFault(block, "a kernel of " + std::to_string(g.kernel_height) + " x " + std::to_string(g.kernel_width) +
                                 " does not fit into an image of " + std::to_string(g.height) + " x " +
                                 std::to_string(g.width) + " pixels; choose a smaller kernel");
  }
  g.out_height = (g.height - g.kernel_height) / g.stride_height + 1;
  g.out_width = (g.width - g.kernel_width) / g.stride_width + 1;
  return g;
}

std::int64_t ConvolutionGeometry::patch_stride() const {
  return InnerStride(patch());
}

std::int64_t ConvolutionGeometry::chunk() const {
  return std::clamp(kPatchFloats / patch_stride() / 8 * 8, std::int64_t{8}, std::max(pixels(), std::int64_t{8}));
}

void GatherPatches(const ConvolutionGeometry& g, const float* image, std::int64_t first, std::int64_t count,
                   float* patches) {
  const std::int64_t stride = g.patch_stride(), run = g.kernel_width * g.channels;
  for (std::int64_t p = 0; p < count; ++p) {
    const std::int64_t top = (first + p) / g.out_width * g.stride_height;
    const std::int64_t left = (first + p) % g.out_width * g.stride_width;
    float* to = patches + p * stride;
    if (!g.channels_first) {
      const float* from = image + (top * g.width + left) * g.channels;
      for (std::int64_t y = 0; y < g.kernel_height; ++y, from += g.width * g.channels, to += run)
        std::memcpy(to, from, static_cast<std::size_t>(run) * sizeof(float));
      continue;
    }
    for (std::int64_t c = 0; c < g.channels; ++c) {
      const float* from = image + (c * g.height + top) * g.width + left;
      for (std::int64_t y = 0; y < g.kernel_height; ++y, from += g.width) {
        float* row = to + y * run + c;
        for (std::int64_t x = 0; x < g.kernel_width; ++x) row[x * g.channels] = from[x];
      }
    }
  }
}

void ScatterPatches(const ConvolutionGeometry& g, const float* patches, std::int64_t first, std::int64_t count,
                    float* image) {
  if (!g.channels_first) return AddPatches(g.grid(), first, count, {patches, g.patch_stride()}, image);
  const std::int64_t stride = g.patch_stride(), run = g.kernel_width * g.channels;
  for (std::int64_t p = 0; p < count; ++p) {
    const std::int64_t top = (first + p) / g.out_width * g.stride_height;
    const std::int64_t left = (first + p) % g.out_width * g.stride_width;
    const float* from = patches + p * stride;
    for (std::int64_t c = 0; c < g.channels; ++c) {
      float* to = image + (c * g.height + top) * g.width + left;
      for (std::int64_t y = 0; y < g.kernel_height; ++y, to += g.width) {
        const float* row = from + y * run + c;
        for (std::int64_t x = 0; x < g.kernel_width; ++x) to[x] += row[x * g.channels];
      }
    }
  }
}

Op ConvolutionOp() {
  Op op;
  op.name = "convolution";
  op.activates = true;
  op.infer = InferConvolution;
  op.prepare = PrepareConvolution;
  op.parameters = ConvolutionParameters;
  op.initialise = InitialiseConvolution;
  op.packed_size = ConvolutionPackedSize;
  op.pack = PackConvolution;
  op.needs = ConvolutionNeeds;
  op.forward = ConvolutionForward;
  return op;
}

}  // namespace consac::nn
