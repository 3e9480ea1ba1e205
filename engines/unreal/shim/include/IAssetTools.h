#pragma once
#include "CoreMinimal.h"

class UAutomatedAssetImportData;
class UObject;

class IAssetTools {
 public:
  TArray<UObject*> ImportAssetsAutomated(const UAutomatedAssetImportData* data) const;
  /// For tests: the asset of a path, "/Game/Consac/road/default"; null where there is none.
  static UObject* ShimAsset(const std::string& path);
  static void ShimForgetAll();
};
