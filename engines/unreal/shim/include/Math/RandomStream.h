#pragma once
#include <cmath>

#include "CoreMinimal.h"

/// Random numbers from a seed; not Unreal's numbers.
struct FRandomStream {
  FRandomStream() = default;
  explicit FRandomStream(int32 seed) : shim_state_(static_cast<std::uint32_t>(seed)) {}
  int32 RandRange(int32 low, int32 high) {
    return low + static_cast<int32>(ShimNext() * (static_cast<double>(high) - low + 1.0));
  }
  float FRandRange(float low, float high) { return low + static_cast<float>(ShimNext()) * (high - low); }

 private:
  double ShimNext() {
    shim_state_ = shim_state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(shim_state_ >> 33) / 2147483648.0;
  }
  std::uint64_t shim_state_ = 1;
};
