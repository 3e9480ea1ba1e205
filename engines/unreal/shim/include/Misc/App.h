#pragma once
#include "CoreMinimal.h"

class FApp {
 public:
  static bool UseFixedTimeStep() { return shim_fixed_; }
  static void SetUseFixedTimeStep(bool fixed) { shim_fixed_ = fixed; }
  static double GetFixedDeltaTime() { return shim_seconds_; }
  static void SetFixedDeltaTime(double seconds) { shim_seconds_ = seconds; }
  static bool IsBenchmarking() { return shim_benchmarking_; }
  static void SetBenchmarking(bool on) { shim_benchmarking_ = on; }
  static bool CanEverRender() { return shim_renders_; }
  static bool IsUnattended() { return shim_unattended_; }
  /// For tests.
  static void ShimSetRenders(bool on) { shim_renders_ = on; }
  static void ShimSetUnattended(bool on) { shim_unattended_ = on; }

 private:
  static inline bool shim_fixed_ = false, shim_benchmarking_ = false, shim_unattended_ = false;
  static inline bool shim_renders_ = true;
  static inline double shim_seconds_ = 1.0 / 30.0;
};
