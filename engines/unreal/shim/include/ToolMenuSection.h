#pragma once
#include <vector>

#include "Framework/Commands/UIAction.h"
#include "Textures/SlateIcon.h"

namespace Shim {
/// Who makes entries now.
inline const void* menu_owner = nullptr;
}  // namespace Shim

struct FToolMenuEntry {
  FName shim_name_;
  FText shim_label_;
  FUIAction shim_action_;
  const void* shim_owner_;
};

/// A part of a menu with a heading.
struct FToolMenuSection {
  FToolMenuEntry& AddMenuEntry(const FName name, const FText& label, const FText& tip, const FSlateIcon& icon,
                               const FUIAction& action) {
    static_cast<void>(icon);
    check(!tip.ShimToString().IsEmpty());
    shim_entries_.push_back({name, label, action, Shim::menu_owner});
    return shim_entries_.back();
  }
  FText shim_label_;
  std::vector<FToolMenuEntry> shim_entries_;
};
