#pragma once
// How observations enter a network: images divided by 255 and through convolutions or flattened, everything else as it
// is, one behind the other. Used by net_arch.h's builders; the blocks are ordinary ones and stand in the model file.

#include <cstdint>
#include <string>

#include "consac/nn/network.h"
#include "consac/space/layout.h"

namespace consac::nn {

/// Whether a leaf is an image: bytes from 0 to 255 in three sizes, as Stable Baselines3 has it.
bool IsImage(const Leaf& leaf);
/// Whether an image is large enough for the convolutions of the nature CNN: 36 pixels a side.
bool FitsNatureCnn(const Leaf& leaf);
/// Whether an observation has one.
bool HasImage(const Layout& observation);

/// What images go through.
enum class Extractor : std::uint8_t {
  kFlatten,    ///< nothing: their bytes divided by 255 (MlpPolicy)
  kNatureCnn,  ///< convolutions 32 of 8x8 by 4, 64 of 4x4 by 2, 64 of 3x3 by 1, and a dense layer (CnnPolicy)
};

/// What AddFeatures makes.
struct FeatureOptions {
  Extractor extractor = Extractor::kFlatten;  ///< of images
  std::int64_t cnn_features = 512;            ///< of the dense layer behind the convolutions
  Activation activation = Activation::kRelu;  ///< of convolutions and dense layer
  Init init = Init::kUniformFanIn;            ///< of their weights
  float gain = 1.0f;                          ///< of their weights
  bool divide = true;                         ///< images' bytes are divided by 255: not where something made other
                                              ///< numbers of them
};

/// Adds blocks that read the input "obs" ([observation.feature_count]) and returns the value that the layers behind
/// them read. Where there is nothing to do that is "obs" itself and there are no blocks. Images are taken channels last
/// unless their first size is the smallest. The error says which image is too small for the convolutions. Source: Mnih
/// et al. 2015, Nature 518, 529-533; Stable Baselines3, NatureCNN.
Result<Port> AddFeatures(const Layout& observation, const FeatureOptions& options, NetworkSpec* spec);

}  // namespace consac::nn
