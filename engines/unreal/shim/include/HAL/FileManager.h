#pragma once
#include "CoreMinimal.h"

/// Files and folders, by the engine's own paths.
class IFileManager {
 public:
  static IFileManager& Get();
  /// `tree`: those above it too.
  bool MakeDirectory(const TCHAR* path, bool tree = false);
};
