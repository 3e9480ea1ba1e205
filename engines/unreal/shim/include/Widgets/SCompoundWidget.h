#pragma once
#include "Widgets/DeclarativeSyntaxSupport.h"

/// A widget made of others: of one, in its slot.
class SCompoundWidget : public SWidget {
 public:
  FVector2D ComputeDesiredSize(float) const override { return Shim::SizeOf(*this); }

 protected:
  struct ShimOneSlot {
    SCompoundWidget* shim_owner;
    void operator[](const TSharedRef<SWidget>& widget) { shim_owner->shim_children_ = {widget}; }
  };
  ShimOneSlot ChildSlot{this};
};
