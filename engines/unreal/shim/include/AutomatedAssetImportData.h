#pragma once
#include "UObject/Object.h"

/// Files to import without a question.
class UAutomatedAssetImportData : public UObject {
  SHIM_CLASS(UAutomatedAssetImportData, UObject)
  FString DestinationPath;
  TArray<FString> Filenames;
  bool bReplaceExisting = false;
};
