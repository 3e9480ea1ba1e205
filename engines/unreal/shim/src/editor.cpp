// The editor's assets: packages by their paths, made by whoever takes a file's ending.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "AssetToolsModule.h"
#include "AutomatedAssetImportData.h"
#include "Factories/Factory.h"
#include "Shim/Runtime.h"
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
