#pragma once
#include "Widgets/DeclarativeSyntaxSupport.h"

/// One under the other, and a bar where there is no room for all.
class SScrollBox : public SWidget {
 public:
  struct FArguments : Shim::SlotArguments<FArguments> {};
  static Shim::Slot Slot() { return {}; }
  void ShimConstruct(const FArguments& arguments) { Shim::Fill(*this, arguments.slots); }

 private:
  FVector2D ComputeDesiredSize(float) const override { return Shim::SizeOf(*this); }
};
