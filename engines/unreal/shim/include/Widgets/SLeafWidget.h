#pragma once
#include "Widgets/DeclarativeSyntaxSupport.h"

/// A widget that draws itself, and says how large it would be.
class SLeafWidget : public SWidget {
 public:
  int32 OnPaint(const FPaintArgs& arguments, const FGeometry& geometry, const FSlateRect& culling,
                FSlateWindowElementList& elements, int32 layer, const FWidgetStyle& style,
                bool enabled) const override = 0;
  FVector2D ComputeDesiredSize(float scale) const override = 0;
};
