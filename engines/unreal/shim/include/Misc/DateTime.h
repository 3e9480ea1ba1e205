#pragma once
#include "CoreMinimal.h"

/// A time between two others.
struct FTimespan {
  double GetTotalSeconds() const { return shim_seconds_; }
  double shim_seconds_ = 0.0;
};

/// A time of the calendar, in UTC.
struct FDateTime {
  FDateTime() = default;
  static FDateTime UtcNow();
  FString ToString(const TCHAR* format) const;
  friend FTimespan operator-(const FDateTime& a, const FDateTime& b) { return {a.shim_unix_ - b.shim_unix_}; }
  friend bool operator>(const FDateTime& a, const FDateTime& b) { return a.shim_unix_ > b.shim_unix_; }
  double shim_unix_ = 0.0;
};
