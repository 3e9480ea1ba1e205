#pragma once
#include "UObject/Object.h"

enum class EGetWorldErrorMode { LogAndReturnNull };

class UEngine {
 public:
  UWorld* GetWorldFromContextObject(const UObject* object, EGetWorldErrorMode mode) const {
    static_cast<void>(mode);
    return object != nullptr ? object->GetWorld() : nullptr;
  }
};
extern UEngine* GEngine;
