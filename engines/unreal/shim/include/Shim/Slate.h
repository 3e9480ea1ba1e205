#pragma once
// Widgets as a tree that a test reads, clicks and paints. What a widget may be told is on its own header; here is how
// they are put together.

#include <functional>
#include <string>
#include <vector>

#include "CoreMinimal.h"
#include "Layout/Geometry.h"
#include "Layout/SlateRect.h"
#include "Styling/WidgetStyle.h"
#include "Templates/SharedPointer.h"
#include "Types/PaintArgs.h"

class FSlateWindowElementList;

/// Every widget. Made by SNew alone, so that it is shared from its first day.
class SWidget {
 public:
  SWidget() { check(shim_making > 0); }
  virtual ~SWidget() = default;
  SWidget(const SWidget&) = delete;
  SWidget& operator=(const SWidget&) = delete;
  virtual int32 OnPaint(const FPaintArgs& arguments, const FGeometry& geometry, const FSlateRect& culling,
                        FSlateWindowElementList& elements, int32 layer, const FWidgetStyle& style, bool enabled) const {
    static_cast<void>(arguments), static_cast<void>(geometry), static_cast<void>(culling);
    static_cast<void>(elements), static_cast<void>(style), static_cast<void>(enabled);
    return layer;
  }
  virtual FVector2D ComputeDesiredSize(float scale) const = 0;

  /// For tests: what is written on it; whether it could be clicked, and was.
  virtual std::string ShimText() const { return {}; }
  virtual bool ShimClick() { return false; }
  virtual bool ShimIsButton() const { return false; }
  /// For the shim and tests: what is in it, in order, and whether that is side by side.
  std::vector<TSharedRef<SWidget>> shim_children_;
  bool shim_across_ = false;
  static inline int shim_making = 0;
};

namespace Shim {

template <class W>
struct WidgetMaker {
  std::function<void(const TSharedRef<W>&)> told;
  TSharedRef<W> operator<<=(const typename W::FArguments& arguments) const {
    ++SWidget::shim_making;
    TSharedRef<W> made(std::make_shared<W>());
    --SWidget::shim_making;
    if constexpr (requires { made->ShimConstruct(arguments); })
      made->ShimConstruct(arguments);
    else
      made->Construct(arguments);
    if (told) told(made);
    return made;
  }
};

/// A part of a box, with what is in it.
struct Slot {
  Slot& operator[](const TSharedRef<SWidget>& widget) {
    content = TSharedPtr<SWidget>(widget);
    return *this;
  }
  Slot& AutoHeight() { return *this; }
  Slot& AutoWidth() { return *this; }
  Slot& Padding(float all) {
    check(all >= 0.0f);
    return *this;
  }
  TSharedPtr<SWidget> content;
};

/// What a box is told: its parts.
template <class W>
struct SlotArguments {
  W& operator+(const Slot& slot) {
    slots.push_back(slot);
    return static_cast<W&>(*this);
  }
  std::vector<Slot> slots;
};

inline void Fill(SWidget& box, const std::vector<Slot>& slots) {
  for (const Slot& slot : slots) {
    check(slot.content.IsValid());  // a slot without content takes no room
    box.shim_children_.push_back(TSharedRef<SWidget>(slot.content.shim_));
  }
}

/// The size of a box: of what is in it.
inline FVector2D SizeOf(const SWidget& box) {
  FVector2D size(0.0, 0.0);
  for (const TSharedRef<SWidget>& child : box.shim_children_) {
    const FVector2D one = child->ComputeDesiredSize(1.0f);
    double& along = box.shim_across_ ? size.X : size.Y;
    double& beside = box.shim_across_ ? size.Y : size.X;
    along += box.shim_across_ ? one.X : one.Y;
    beside = std::max(beside, box.shim_across_ ? one.Y : one.X);
  }
  return size;
}

}  // namespace Shim
