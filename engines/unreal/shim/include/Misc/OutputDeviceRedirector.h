#pragma once
#include <mutex>
#include <vector>

#include "Misc/OutputDevice.h"

/// The log: tells all who hear it, on the thread that wrote the line. They must have left before they go.
class FOutputDeviceRedirector {
 public:
  void AddOutputDevice(FOutputDevice* device) {
    const std::lock_guard lock(shim_mutex_);
    shim_devices_.push_back(device);
  }
  void RemoveOutputDevice(FOutputDevice* device) {
    const std::lock_guard lock(shim_mutex_);
    std::erase(shim_devices_, device);
  }
  void ShimTell(const TCHAR* line, ELogVerbosity::Type verbosity, const FName& category) {
    const std::lock_guard lock(shim_mutex_);
    for (FOutputDevice* device : shim_devices_) device->Serialize(line, verbosity, category);
  }
  std::vector<FOutputDevice*> shim_devices_;
  std::mutex shim_mutex_;
};
