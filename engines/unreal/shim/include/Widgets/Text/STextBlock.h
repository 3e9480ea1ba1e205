#pragma once
#include "Widgets/DeclarativeSyntaxSupport.h"

/// Text that nobody types in.
class STextBlock : public SWidget {
 public:
  struct FArguments {
    FArguments& Text(const FText& text) {
      shim_text_ = text;
      return *this;
    }
    FArguments& AutoWrapText(bool wraps) {
      shim_wraps_ = wraps;
      return *this;
    }
    FText shim_text_;
    bool shim_wraps_ = false;
  };
  void ShimConstruct(const FArguments& arguments) { shim_text_ = arguments.shim_text_; }
  void SetText(const FText& text) { shim_text_ = text; }
  std::string ShimText() const override { return Shim::Narrow(*shim_text_.ShimToString()); }
  FText shim_text_;

 private:
  FVector2D ComputeDesiredSize(float) const override {
    const std::string text = ShimText();
    const auto lines = 1 + std::count(text.begin(), text.end(), '\n');
    return FVector2D(0.0, text.empty() ? 0.0 : 17.0 * static_cast<double>(lines));
  }
};
