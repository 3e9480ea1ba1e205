#pragma once
#include <map>

#include "Widgets/Docking/SDockTab.h"

class FSpawnTabArgs {};
namespace ETabSpawnerMenuType {
enum Type { Enabled, Disabled, Hidden };
}

/// Makes a tab when it is asked for.
class FOnSpawnTab {
 public:
  template <class O>
  static FOnSpawnTab CreateRaw(O* object, TSharedRef<SDockTab> (O::*function)(const FSpawnTabArgs&)) {
    FOnSpawnTab made;
    made.shim_call_ = [object, function] { return (object->*function)(FSpawnTabArgs()); };
    return made;
  }
  std::function<TSharedRef<SDockTab>()> shim_call_;
};

struct FTabId {
  FTabId(const FName name) : shim_name_(name) {}
  FName shim_name_;
};

/// How a tab is offered.
struct FTabSpawnerEntry {
  FTabSpawnerEntry& SetDisplayName(const FText& name) {
    shim_title_ = name;
    return *this;
  }
  FTabSpawnerEntry& SetMenuType(ETabSpawnerMenuType::Type type) {
    shim_menu_ = type;
    return *this;
  }
  FText shim_title_;
  ETabSpawnerMenuType::Type shim_menu_ = ETabSpawnerMenuType::Enabled;
  FOnSpawnTab shim_spawn_;
  TSharedPtr<SDockTab> shim_tab_;
};

/// All tabs of the editor.
class FGlobalTabmanager {
 public:
  static TSharedRef<FGlobalTabmanager> Get();
  /// One of a name only: a second one is refused with an error in the log.
  FTabSpawnerEntry& RegisterNomadTabSpawner(const FName id, const FOnSpawnTab& spawn);
  void UnregisterNomadTabSpawner(const FName id);
  /// Opens it, or puts it in front.
  TSharedPtr<SDockTab> TryInvokeTab(const FTabId& id);
  /// For tests: closes it; how many kinds are known; the open one.
  void ShimClose(const TCHAR* id);
  std::size_t ShimKinds() const { return shim_spawners_.size(); }
  TSharedPtr<SDockTab> ShimOpen(const TCHAR* id);

 private:
  std::map<std::u16string, FTabSpawnerEntry> shim_spawners_;
};
