#pragma once
#include <atomic>

/// Time that a test sets.
struct FPlatformTime {
  static double Seconds() { return shim_seconds_; }
  static inline std::atomic<double> shim_seconds_ = 1000.0;
};
