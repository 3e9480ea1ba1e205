#pragma once
#include <vector>

#include "ToolMenu.h"

/// Who made entries from now on, until it goes.
class FToolMenuOwnerScoped {
 public:
  explicit FToolMenuOwnerScoped(const void* owner) { Shim::menu_owner = owner; }
  ~FToolMenuOwnerScoped() { Shim::menu_owner = nullptr; }
  FToolMenuOwnerScoped(const FToolMenuOwnerScoped&) = delete;
  FToolMenuOwnerScoped& operator=(const FToolMenuOwnerScoped&) = delete;
};

/// The editor's menus, which are there once it has started: that is after its modules.
class UToolMenus : public UObject {
  SHIM_CLASS(UToolMenus, UObject)
  static UToolMenus* Get();
  UToolMenu* ExtendMenu(const FName name);
  static void RegisterStartupCallback(const FSimpleMulticastDelegate::FDelegate& delegate);
  static void UnRegisterStartupCallback(const void* owner);
  static void UnregisterOwner(const void* owner);
  /// For tests: the editor has started; what is in a menu; what is chosen there.
  static void ShimStart();
  static std::vector<FToolMenuEntry> ShimEntries(const TCHAR* menu);
  static bool ShimChoose(const TCHAR* menu, const TCHAR* entry);
};
