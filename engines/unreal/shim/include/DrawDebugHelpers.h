#pragma once
#include <vector>

#include "CoreMinimal.h"

class UWorld;

namespace Shim {
struct Line {
  FVector from, to;
  FColor color;
};
/// For tests: what was drawn.
inline std::vector<Line> lines;
}  // namespace Shim

inline void DrawDebugLine(const UWorld* world, const FVector& from, const FVector& to, const FColor& color,
                          bool persistent = false, float seconds = -1.0f, uint8 depth = 0, float thickness = 0.0f) {
  static_cast<void>(persistent), static_cast<void>(seconds), static_cast<void>(depth), static_cast<void>(thickness);
  check(world != nullptr);
  Shim::lines.push_back({from, to, color});
}
