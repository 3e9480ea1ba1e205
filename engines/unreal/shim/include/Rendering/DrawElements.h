#pragma once
#include <vector>

#include "Layout/Geometry.h"

enum class ESlateDrawEffect : uint8 { None };

/// What was drawn; for tests.
class FSlateWindowElementList {
 public:
  struct ShimLines {
    std::vector<FVector2f> points;
    FLinearColor colour;
    uint32 layer;
  };
  std::vector<ShimLines> shim_lines_;
};

class FSlateDrawElement {
 public:
  /// A line through the points, which are within the geometry.
  static void MakeLines(FSlateWindowElementList& elements, uint32 layer, const FPaintGeometry& geometry,
                        TArray<FVector2f> points, ESlateDrawEffect effects = ESlateDrawEffect::None,
                        const FLinearColor& tint = FLinearColor(1.0f, 1.0f, 1.0f), bool antialias = true,
                        float thickness = 1.0f) {
    check(points.Num() >= 2 && thickness > 0.0f && antialias && effects == ESlateDrawEffect::None);
    for (const FVector2f& point : points) {
      check(point.X >= 0.0f && static_cast<double>(point.X) <= geometry.shim_size_.x + 1e-3);
      check(point.Y >= 0.0f && static_cast<double>(point.Y) <= geometry.shim_size_.y + 1e-3);
    }
    elements.shim_lines_.push_back({{points.begin(), points.end()}, tint, layer});
  }
};
