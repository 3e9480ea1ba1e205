#pragma once
#include "CoreMinimal.h"

namespace Shim {
/// A size that becomes either kind of vector, and is none.
struct LocalSize {
  double x, y;
  operator FVector2D() const { return FVector2D(x, y); }
  operator FVector2f() const { return FVector2f(static_cast<float>(x), static_cast<float>(y)); }
};
}  // namespace Shim

/// Where a widget is drawn.
class FPaintGeometry {
 public:
  Shim::LocalSize shim_size_{0.0, 0.0};
};

/// The room of a widget.
struct FGeometry {
  FPaintGeometry ToPaintGeometry() const { return FPaintGeometry{shim_size_}; }
  Shim::LocalSize GetLocalSize() const { return shim_size_; }
  Shim::LocalSize shim_size_{0.0, 0.0};
};
