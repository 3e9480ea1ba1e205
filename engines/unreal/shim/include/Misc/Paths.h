#pragma once
#include "CoreMinimal.h"

class FPaths {
 public:
  static FString ProjectSavedDir();
  static FString ProjectContentDir();
  static FString ConvertRelativePathToFull(const FString& path);
  static bool FileExists(const FString& path);
  template <class... T>
  static FString Combine(const T&... parts) {
    std::u16string whole;
    (ShimAdd(whole, FString(ShimText(parts))), ...);
    return FString(whole.c_str());
  }
  /// For tests: where the project's files are.
  static void ShimSetProject(const std::string& folder);

 private:
  static const TCHAR* ShimText(const FString& part) { return *part; }
  static const TCHAR* ShimText(const TCHAR* part) { return part; }
  static void ShimAdd(std::u16string& whole, const FString& part);
};
