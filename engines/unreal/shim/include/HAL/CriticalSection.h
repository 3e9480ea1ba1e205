#pragma once
#include <mutex>

/// A lock for the threads of one process.
class FCriticalSection {
 public:
  std::recursive_mutex shim_mutex_;
};
