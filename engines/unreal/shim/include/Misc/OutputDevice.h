#pragma once
#include "CoreMinimal.h"
#include "Logging/LogVerbosity.h"

/// Whoever hears the log.
class FOutputDevice {
 public:
  virtual ~FOutputDevice() = default;
  virtual void Serialize(const TCHAR* line, ELogVerbosity::Type verbosity, const FName& category) = 0;
};
