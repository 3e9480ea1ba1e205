#pragma once
#include "Input/Reply.h"
#include "Widgets/DeclarativeSyntaxSupport.h"

/// A button with a text.
class SButton : public SWidget {
 public:
  struct FArguments {
    FArguments& Text(const FText& text) {
      shim_text_ = text;
      return *this;
    }
    FArguments& ToolTipText(const FText& text) {
      check(!text.ShimToString().IsEmpty());
      return *this;
    }
    /// A function of a widget, which is not called once that is gone.
    template <class W>
    FArguments& OnClicked(W* widget, FReply (W::*function)()) {
      static_assert(std::is_base_of_v<SWidget, W>,
                    "the engine keeps such a function weakly, by the widget that has it");
      shim_clicked_ = [widget, function] { return (widget->*function)(); };
      return *this;
    }
    FText shim_text_;
    std::function<FReply()> shim_clicked_;
  };
  void ShimConstruct(const FArguments& arguments) {
    shim_text_ = arguments.shim_text_;
    shim_click_ = arguments.shim_clicked_;
  }
  std::string ShimText() const override { return Shim::Narrow(*shim_text_.ShimToString()); }
  bool ShimIsButton() const override { return true; }
  bool ShimClick() override {
    shim_click_();
    return true;
  }
  FText shim_text_;
  std::function<FReply()> shim_click_;

 private:
  FVector2D ComputeDesiredSize(float) const override {
    return FVector2D(16.0 + 7.0 * static_cast<double>(shim_text_.ShimToString().Len()), 24.0);
  }
};
