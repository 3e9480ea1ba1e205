#pragma once
#include "CoreMinimal.h"

/// What Copy answers.
enum ECopyResult { COPY_OK, COPY_Fail, COPY_Canceled };

/// Files and folders, by the engine's own paths.
class IFileManager {
 public:
  static IFileManager& Get();
  /// `tree`: those above it too.
  bool MakeDirectory(const TCHAR* path, bool tree = false);
  /// Names without their folder, of files that end so.
  void FindFiles(TArray<FString>& found, const TCHAR* folder, const TCHAR* ending = nullptr) const;
  uint32 Copy(const TCHAR* to, const TCHAR* from);
  bool Delete(const TCHAR* path);
};
