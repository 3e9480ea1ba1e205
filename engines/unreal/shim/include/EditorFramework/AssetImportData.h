#pragma once
#include "UObject/Object.h"

/// The file that an asset was made of.
class UAssetImportData : public UObject {
  SHIM_CLASS(UAssetImportData, UObject)
  void Update(const FString& file) { shim_file_ = file; }
  void UpdateFilenameOnly(const FString& file) { shim_file_ = file; }
  FString GetFirstFilename() const { return shim_file_; }
  void ExtractFilenames(TArray<FString>& files) const {
    if (!shim_file_.IsEmpty()) files.Add(shim_file_);
  }

 private:
  FString shim_file_;
};
