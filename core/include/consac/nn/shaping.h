#pragma once
// What a slice block does, for its forward in core and its gradient in learn.

#include "consac/nn/network.h"

namespace consac::nn {

/// Numbers of a slice block: `shape` features from `offset` on, each divided by `divide_by`.
struct SliceNumbers {
  std::int64_t offset = 0;  ///< first feature
  float divisor = 1.0f;     ///< 255 for the bytes of an image, as Stable Baselines3 has it

  /// Of a slice block of a network.
  static const SliceNumbers& Of(const PlacedBlock& block) {
    return *static_cast<const SliceNumbers*>(block.details.get());
  }
};

}  // namespace consac::nn
