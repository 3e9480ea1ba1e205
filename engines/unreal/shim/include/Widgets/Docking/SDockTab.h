#pragma once
#include "Widgets/DeclarativeSyntaxSupport.h"

enum ETabRole : uint8 { ShimMajorTab, NomadTab };

/// A tab of the editor.
class SDockTab : public SWidget {
 public:
  struct FArguments {
    FArguments& TabRole(ETabRole role) {
      shim_role_ = role;
      return *this;
    }
    FArguments& operator[](const TSharedRef<SWidget>& widget) {
      shim_content_ = TSharedPtr<SWidget>(widget);
      return *this;
    }
    ETabRole shim_role_ = ETabRole::ShimMajorTab;
    TSharedPtr<SWidget> shim_content_;
  };
  void ShimConstruct(const FArguments& arguments) {
    check(arguments.shim_role_ == ETabRole::NomadTab);  // as a nomad's spawner must
    shim_children_.push_back(TSharedRef<SWidget>(arguments.shim_content_.shim_));
  }

 private:
  FVector2D ComputeDesiredSize(float) const override { return Shim::SizeOf(*this); }
};
