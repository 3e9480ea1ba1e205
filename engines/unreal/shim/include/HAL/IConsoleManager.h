#pragma once
#include <map>

#include "CoreMinimal.h"

/// Keeps by whom it was set last, and obeys nobody below.
class IConsoleVariable {
 public:
  /// Who sets, lowest first; a few of Unreal's.
  enum ShimPriority { kShimConstructor, kShimProject, kShimCode, kShimConsole };
  float GetFloat() const { return shim_value_; }
  int32 GetInt() const { return static_cast<int32>(shim_value_); }
  void Set(float value) { ShimSet(value, kShimCode); }
  void SetWithCurrentPriority(float value) { shim_value_ = value; }
  /// For tests: as a person on the console, or the project's settings.
  void ShimSet(float value, ShimPriority priority) {
    if (priority < shim_priority_) return;
    shim_value_ = value;
    shim_priority_ = priority;
  }
  ShimPriority ShimSetBy() const { return shim_priority_; }
  /// For tests: as at the start.
  void ShimForget() { *this = IConsoleVariable(); }

 private:
  float shim_value_ = 0.0f;
  ShimPriority shim_priority_ = kShimConstructor;
};

/// Knows what makes frames wait.
class IConsoleManager {
 public:
  static IConsoleManager& Get();
  IConsoleVariable* FindConsoleVariable(const TCHAR* name);

 private:
  std::map<std::u16string, IConsoleVariable> shim_variables_ = {{u"t.MaxFPS", {}},
                                                                {u"t.IdleWhenNotForeground", {}},
                                                                {u"r.VSync", {}},
                                                                {u"r.VSyncEditor", {}},
                                                                {u"r.DontLimitOnBattery", {}}};
};
