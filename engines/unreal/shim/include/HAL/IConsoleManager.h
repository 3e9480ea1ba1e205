#pragma once
#include "CoreMinimal.h"

class IConsoleVariable {
 public:
  float GetFloat() const { return shim_value_; }
  int32 GetInt() const { return static_cast<int32>(shim_value_); }
  void Set(float value) { shim_value_ = value; }

 private:
  float shim_value_ = 0.0f;
};

/// Knows t.MaxFPS alone.
class IConsoleManager {
 public:
  static IConsoleManager& Get();
  IConsoleVariable* FindConsoleVariable(const TCHAR* name);

 private:
  IConsoleVariable shim_max_fps_;
};
