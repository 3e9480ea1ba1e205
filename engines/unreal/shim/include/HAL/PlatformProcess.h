#pragma once
#include "CoreMinimal.h"

struct FProcHandle {
  bool IsValid() const { return shim_child_ > 0; }

 private:
  friend struct FPlatformProcess;
  int shim_child_ = 0;
};

struct FPlatformProcess {
  static FProcHandle CreateProc(const TCHAR* url, const TCHAR* parameters, bool detached, bool hidden,
                                bool really_hidden, uint32* process_id, int32 priority, const TCHAR* folder,
                                void* pipe_write, void* pipe_read = nullptr);
  static bool IsProcRunning(FProcHandle& handle);
  static void TerminateProc(FProcHandle& handle, bool kill_tree = false);
  static void CloseProc(FProcHandle& handle);
  /// For tests: handles that were not closed.
  static inline int shim_open_ = 0;
};
