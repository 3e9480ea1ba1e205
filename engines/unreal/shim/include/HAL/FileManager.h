#pragma once
#include "CoreMinimal.h"
#include "Misc/DateTime.h"

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
  /// Whole paths, of the folders in it too; `name` may begin with a star.
  void FindFilesRecursive(TArray<FString>& found, const TCHAR* folder, const TCHAR* name, bool files, bool folders,
                          bool clear = true) const;
  FDateTime GetTimeStamp(const TCHAR* path) const;
  int64 FileSize(const TCHAR* path) const;
  uint32 Copy(const TCHAR* to, const TCHAR* from);
  bool Delete(const TCHAR* path);
};
