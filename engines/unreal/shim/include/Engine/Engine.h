#pragma once
#include <map>

#include "UObject/Object.h"

enum class EGetWorldErrorMode { LogAndReturnNull };

class UEngine {
 public:
  void AddOnScreenDebugMessage(uint64 key, float seconds, FColor color, const FString& text) {
    static_cast<void>(seconds), static_cast<void>(color);
    shim_screen_[key] = text;
  }
  /// For tests: what is on the screen, by keys.
  std::map<uint64, FString> shim_screen_;
  UWorld* GetWorldFromContextObject(const UObject* object, EGetWorldErrorMode mode) const {
    static_cast<void>(mode);
    return object != nullptr ? object->GetWorld() : nullptr;
  }
};
extern UEngine* GEngine;
