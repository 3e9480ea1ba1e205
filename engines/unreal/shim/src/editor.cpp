// The editor: its assets, which are packages by their paths, made by whoever takes a file's ending; its level, menus
// and tabs.
#include "Editor.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "AssetToolsModule.h"
#include "AutomatedAssetImportData.h"
#include "Editor/EditorEngine.h"
#include "Engine/World.h"
#include "Factories/Factory.h"
#include "FileHelpers.h"
#include "Framework/Docking/TabManager.h"
#include "Logging/LogMacros.h"
#include "Shim/Runtime.h"
#include "ToolMenus.h"
#include "UObject/UObjectGlobals.h"

namespace {

class UPackage : public UObject {
  SHIM_CLASS(UPackage, UObject)
};

struct Package {
  Package() { outer.Hold(NewObject<UPackage>()); }
  Shim::Held outer, asset;
};

std::map<std::string, std::unique_ptr<Package>>& Packages() {
  static std::map<std::string, std::unique_ptr<Package>> packages;
  return packages;
}

}  // namespace

TArray<UObject*> IAssetTools::ImportAssetsAutomated(const UAutomatedAssetImportData* data) const {
  TArray<UObject*> made;
  for (const FString& file : data->Filenames) {
    const std::filesystem::path path = Shim::Narrow(*file);
    const std::string ending = path.extension().string();
    const FString name(Shim::Wide(path.stem().string()).c_str());
    std::unique_ptr<Package>& package = Packages()[Shim::Narrow(*data->DestinationPath) + "/" + path.stem().string()];
    if (package == nullptr) package = std::make_unique<Package>();
    if (package->asset.object() != nullptr && !data->bReplaceExisting) continue;
    std::vector<UFactory*> factories = UFactory::ShimAll();
    std::stable_sort(factories.begin(), factories.end(),
                     [](const UFactory* a, const UFactory* b) { return a->ImportPriority > b->ImportPriority; });
    for (UFactory* factory : factories) {
      if (ending.empty() || !factory->ShimTakes(ending.substr(1)) || !factory->FactoryCanImport(file)) continue;
      bool canceled = false;
      UObject* asset = factory->FactoryCreateFile(factory->SupportedClass.Get(), package->outer.object(), FName(*name),
                                                  RF_Public | RF_Standalone, file, nullptr, nullptr, canceled);
      if (asset == nullptr) break;
      package->asset.Hold(asset);
      made.Add(asset);
      break;
    }
  }
  return made;
}

UObject* IAssetTools::ShimAsset(const std::string& path) {
  const auto at = Packages().find(path);
  return at != Packages().end() ? at->second->asset.object() : nullptr;
}

void IAssetTools::ShimForgetAll() {
  Packages().clear();
}

static Shim::Held& ShimLevel() {
  static Shim::Held level;
  return level;
}

UWorld* UEditorLoadingAndSavingUtils::NewBlankMap(bool save_existing_map) {
  check(!save_existing_map);  // that would save without asking
  if (GEditor->PlayWorld != nullptr) return nullptr;
  UWorld* level = NewObject<UWorld>();
  level->WorldType = EWorldType::Editor;
  ShimLevel().Hold(level);
  return level;
}

void UEditorLoadingAndSavingUtils::ShimCloseLevel() {
  ShimLevel().Hold(nullptr);
  Shim::Collect();
}

DEFINE_LOG_CATEGORY_STATIC(LogSlate, Log, All);

TSharedRef<FGlobalTabmanager> FGlobalTabmanager::Get() {
  static const TSharedRef<FGlobalTabmanager> manager(std::make_shared<FGlobalTabmanager>());
  return manager;
}

FTabSpawnerEntry& FGlobalTabmanager::RegisterNomadTabSpawner(const FName id, const FOnSpawnTab& spawn) {
  const auto [at, fresh] = shim_spawners_.try_emplace(*id.ToString());
  if (!fresh) UE_LOG(LogSlate, Error, TEXT("a tab %s is there already"), *id.ToString());
  at->second.shim_spawn_ = spawn;
  return at->second;
}

void FGlobalTabmanager::UnregisterNomadTabSpawner(const FName id) {
  shim_spawners_.erase(*id.ToString());
}

TSharedPtr<SDockTab> FGlobalTabmanager::TryInvokeTab(const FTabId& id) {
  const auto at = shim_spawners_.find(*id.shim_name_.ToString());
  if (at == shim_spawners_.end()) return nullptr;
  if (!at->second.shim_tab_.IsValid()) at->second.shim_tab_ = TSharedPtr<SDockTab>(at->second.shim_spawn_.shim_call_());
  return at->second.shim_tab_;
}

void FGlobalTabmanager::ShimClose(const TCHAR* id) {
  shim_spawners_.at(id).shim_tab_ = nullptr;
}

TSharedPtr<SDockTab> FGlobalTabmanager::ShimOpen(const TCHAR* id) {
  const auto at = shim_spawners_.find(id);
  return at != shim_spawners_.end() ? at->second.shim_tab_ : TSharedPtr<SDockTab>();
}

namespace {

struct Menus {
  std::map<std::u16string, std::unique_ptr<UToolMenu>> all;
  std::vector<FSimpleDelegate> waiting;
};

Menus& AllMenus() {
  static Menus menus;
  return menus;
}

}  // namespace

UToolMenus* UToolMenus::Get() {
  static UToolMenus menus;
  return &menus;
}

UToolMenu* UToolMenus::ExtendMenu(const FName name) {
  std::unique_ptr<UToolMenu>& menu = AllMenus().all[*name.ToString()];
  if (menu == nullptr) menu = std::make_unique<UToolMenu>();
  return menu.get();
}

void UToolMenus::RegisterStartupCallback(const FSimpleMulticastDelegate::FDelegate& delegate) {
  AllMenus().waiting.push_back(delegate);
}

void UToolMenus::UnRegisterStartupCallback(const void* owner) {
  std::erase_if(AllMenus().waiting, [owner](const FSimpleDelegate& one) { return one.shim_object_ == owner; });
}

void UToolMenus::UnregisterOwner(const void* owner) {
  for (auto& [name, menu] : AllMenus().all)
    for (auto& [key, section] : menu->shim_sections_)
      std::erase_if(section.shim_entries_, [owner](const FToolMenuEntry& entry) { return entry.shim_owner_ == owner; });
}

void UToolMenus::ShimStart() {
  const std::vector<FSimpleDelegate> waiting = std::exchange(AllMenus().waiting, {});
  for (const FSimpleDelegate& one : waiting) one.shim_call_();
}

std::vector<FToolMenuEntry> UToolMenus::ShimEntries(const TCHAR* menu) {
  std::vector<FToolMenuEntry> all;
  for (const auto& [key, section] : Get()->ExtendMenu(menu)->shim_sections_)
    all.insert(all.end(), section.shim_entries_.begin(), section.shim_entries_.end());
  return all;
}

bool UToolMenus::ShimChoose(const TCHAR* menu, const TCHAR* entry) {
  for (const FToolMenuEntry& one : ShimEntries(menu)) {
    if (!(one.shim_name_ == FName(entry))) continue;
    one.shim_action_.shim_execute_.shim_call_();
    return true;
  }
  return false;
}
