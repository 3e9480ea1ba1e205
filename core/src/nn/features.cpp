#include "consac/nn/features.h"

#include <algorithm>

namespace consac::nn {
namespace {

/// One convolution of the nature CNN.
struct NatureLayer {
  std::int64_t filters, kernel, stride;
};
constexpr NatureLayer kNatureLayers[] = {{32, 8, 4}, {64, 4, 2}, {64, 3, 1}};
constexpr std::int64_t kSmallestImage = 36;  // pixels a side that leave one behind all three

bool ChannelsFirst(const Shape& image) {
  return image[0] < image[1] && image[0] < image[2];
}

/// A run of the observation as a value of its own; an image's bytes are divided by 255.
Port AddSlice(const std::string& name, std::int64_t offset, const Shape& shape, bool divide, NetworkSpec* spec) {
  Block slice{.op = "slice", .inputs = {spec->inputs[0].name}, .output = name, .name = name};
  slice.attributes.SetInteger("offset", offset);
  slice.attributes.SetIntegers("shape", shape);
  if (divide) slice.attributes.SetNumber("divide_by", 255.0);
  spec->blocks.push_back(std::move(slice));
  return {name, SizeOf(shape), shape};
}

Port AddNatureCnn(const std::string& name, Port from, bool channels_first, const FeatureOptions& options,
                  NetworkSpec* spec) {
  Block block;
  block.activation = options.activation;
  block.init = options.init;
  block.gain = options.gain;
  for (std::size_t i = 0; i < std::size(kNatureLayers); ++i) {
    const NatureLayer& layer = kNatureLayers[i];
    block.op = "convolution";
    block.inputs = {from.name};
    block.output = block.name = name + "/" + std::to_string(i);
    block.attributes = {};
    block.attributes.SetIntegers("kernel", Shape{layer.kernel, layer.kernel});
    block.attributes.SetIntegers("stride", Shape{layer.stride, layer.stride});
    block.attributes.SetInteger("filters", layer.filters);
    if (channels_first && i == 0) block.attributes.SetText("layout", "CHW");
    spec->blocks.push_back(block);
    from.name = block.output;
  }
  block.op = "dense";
  block.inputs = {from.name};
  block.output = block.name = name + "/features";
  block.attributes = {};
  block.out_size = options.cnn_features;
  spec->blocks.push_back(block);
  return {block.output, options.cnn_features, {}};
}

}  // namespace

bool IsImage(const Leaf& leaf) {
  if (leaf.space.kind() != SpaceKind::kBox || leaf.dtype != DType::kU8 || leaf.space.shape().size() != 3) return false;
  const auto [low, high] = ElementBounds(leaf, 0);
  return low == 0.0 && high == 255.0;
}

bool FitsNatureCnn(const Leaf& leaf) {
  const Shape shape = leaf.space.shape();
  const std::size_t first = ChannelsFirst(shape) ? 1 : 0;
  return std::min(shape[first], shape[first + 1]) >= kSmallestImage;
}

bool HasImage(const Layout& observation) {
  return std::any_of(observation.leaves.begin(), observation.leaves.end(), IsImage);
}

Result<Port> AddFeatures(const Layout& observation, const FeatureOptions& options, NetworkSpec* spec) {
  const Port all{"obs", observation.feature_count, {}};
  spec->inputs = {all};
  if (!HasImage(observation) || (options.extractor == Extractor::kFlatten && !options.divide)) return all;
  Block together{.op = "concatenation", .inputs = {}, .output = "features", .name = "features"};
  std::int64_t size = 0;
  for (std::size_t i = 0; i < observation.leaves.size(); ++i) {
    const Leaf& leaf = observation.leaves[i];
    const std::string name = "features/" + std::to_string(i);
    const bool image = IsImage(leaf);
    const Shape shape = image ? Shape(leaf.space.shape()) : Shape{leaf.feature_count};
    Port part = AddSlice(name, leaf.feature_offset, shape, image && options.divide, spec);
    if (image && options.extractor == Extractor::kNatureCnn) {
      if (!FitsNatureCnn(leaf)) {
        return Status(StatusCode::kInvalidArgument,
                      "the image " + leaf.space.ToString() + " is too small for CnnPolicy, which needs " +
                          std::to_string(kSmallestImage) + " pixels a side; use MlpPolicy, or larger images");
      }
      part = AddNatureCnn(name, part, ChannelsFirst(shape), options, spec);
    }
    together.inputs.push_back(part.name);
    size += part.size;
  }
  if (together.inputs.size() == 1) return Port{together.inputs[0], size, {}};
  spec->blocks.push_back(std::move(together));
  return Port{"features", size, {}};
}

}  // namespace consac::nn
