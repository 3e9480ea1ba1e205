#pragma once
// Where the numbers of a convolution lie: from an image to patches, one row per pixel of the result, so that a
// convolution is a dense layer over patches. Used by the convolution block and its gradient. Patches are copied only
// where kernels.h cannot read them in place.

#include <cstdint>

#include "consac/nn/kernels.h"

namespace consac::nn {

/// The geometry of a two-dimensional convolution without padding. The result and the patches have channels last.
struct ConvolutionGeometry {
  std::int64_t height = 0, width = 0, channels = 0;  ///< of the image
  bool channels_first = false;                       ///< the image is [channels, height, width], else channels last
  std::int64_t kernel_height = 0, kernel_width = 0;  ///< of the kernel
  std::int64_t stride_height = 1, stride_width = 1;  ///< from one pixel of the result to the next
  std::int64_t filters = 0;                          ///< channels of the result
  std::int64_t out_height = 0, out_width = 0;        ///< of the result

  /// From a block's attributes: `kernel` [h, w], `stride` [h, w], `filters`, `layout` "HWC" (default) or "CHW".
  static Result<ConvolutionGeometry> Of(const Block& block, const Shape& image);
  /// Of a convolution block of a network.
  static const ConvolutionGeometry& Of(const PlacedBlock& block) {
    return *static_cast<const ConvolutionGeometry*>(block.details.get());
  }
  /// Where the patches lie; only of images whose channels come last.
  PatchGrid grid() const {
    return {out_height,
            out_width,
            stride_height * width * channels,
            stride_width * channels,
            kernel_height,
            kernel_width * channels,
            width * channels};
  }
  /// Pixels of the result.
  std::int64_t pixels() const { return out_height * out_width; }
  /// Numbers of a patch: [kernel_height, kernel_width, channels].
  std::int64_t patch() const { return kernel_height * kernel_width * channels; }
  /// Pixels that are worked on together, so that their patches stay in cache.
  std::int64_t chunk() const;
  /// Floats between patches.
  std::int64_t patch_stride() const;
};

/// Copies the patches of pixels `first` to `first + count` of one image: `patches` [count, patch_stride].
void GatherPatches(const ConvolutionGeometry& geometry, const float* image, std::int64_t first, std::int64_t count,
                   float* patches);
/// The reverse: adds every number of the patches to the pixel of the image that it was copied from.
void ScatterPatches(const ConvolutionGeometry& geometry, const float* patches, std::int64_t first, std::int64_t count,
                    float* image);

}  // namespace consac::nn
