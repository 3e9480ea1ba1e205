#pragma once
#include "HAL/CriticalSection.h"

/// Holds a lock for as long as it lives.
class FScopeLock {
 public:
  explicit FScopeLock(FCriticalSection* lock) : shim_lock_(lock->shim_mutex_) {}

 private:
  std::lock_guard<std::recursive_mutex> shim_lock_;
};
