#pragma once
#include "CoreMinimal.h"

struct FProcHandle {
  bool IsValid() const { return shim_child_ > 0; }

 private:
  friend struct FPlatformProcess;
  int shim_child_ = 0;
  bool shim_detached_ = false;
};

/// As on Linux.
struct FPlatformProcess {
  static FProcHandle CreateProc(const TCHAR* url, const TCHAR* parameters, bool detached, bool hidden,
                                bool really_hidden, uint32* process_id, int32 priority, const TCHAR* folder,
                                void* pipe_write, void* pipe_read = nullptr);
  static bool IsProcRunning(FProcHandle& handle);
  /// Asks it to end, and does not wait until it has.
  static void TerminateProc(FProcHandle& handle, bool kill_tree = false);
  /// Waits until it has ended, unless it was launched detached.
  static void CloseProc(FProcHandle& handle);
  /// For tests: handles that were not closed, and the latest program's process.
  static inline int shim_open_ = 0, shim_latest_ = 0;
  /// For tests: no program goes on after this.
  static void ShimEndAll();
};
