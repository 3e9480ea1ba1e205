#pragma once
#include "Shim/Slate.h"
#include "Widgets/DeclarativeSyntaxSupport.h"

/// One under the other.
class SVerticalBox : public SWidget {
 public:
  struct FArguments : Shim::SlotArguments<FArguments> {};
  static Shim::Slot Slot() { return {}; }
  void ShimConstruct(const FArguments& arguments) { Shim::Fill(*this, arguments.slots); }

 private:
  FVector2D ComputeDesiredSize(float) const override { return Shim::SizeOf(*this); }
};

/// Side by side.
class SHorizontalBox : public SWidget {
 public:
  struct FArguments : Shim::SlotArguments<FArguments> {};
  static Shim::Slot Slot() { return {}; }
  void ShimConstruct(const FArguments& arguments) {
    shim_across_ = true;
    Shim::Fill(*this, arguments.slots);
  }

 private:
  FVector2D ComputeDesiredSize(float) const override { return Shim::SizeOf(*this); }
};
