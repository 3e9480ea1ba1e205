#pragma once
#include <vector>

#include "UObject/Object.h"

namespace EReimportResult {
enum Type { Failed, Succeeded, Cancelled };
}

/// Imports again what it can; adds itself to the editor's list.
class FReimportHandler {
 public:
  FReimportHandler() { ShimAll().push_back(this); }
  virtual ~FReimportHandler() { std::erase(ShimAll(), this); }
  FReimportHandler(const FReimportHandler&) = delete;
  FReimportHandler& operator=(const FReimportHandler&) = delete;
  virtual bool CanReimport(UObject* object, TArray<FString>& files) = 0;
  virtual void SetReimportPaths(UObject* object, const TArray<FString>& files) = 0;
  virtual EReimportResult::Type Reimport(UObject* object) = 0;

  /// For the shim: what "Reimport" of the asset's menu does.
  static bool ShimReimport(UObject* object) {
    for (FReimportHandler* handler : ShimAll()) {
      TArray<FString> files;
      if (handler->CanReimport(object, files)) return handler->Reimport(object) == EReimportResult::Succeeded;
    }
    return false;
  }
  static std::vector<FReimportHandler*>& ShimAll() {
    static std::vector<FReimportHandler*> all;
    return all;
  }
};
