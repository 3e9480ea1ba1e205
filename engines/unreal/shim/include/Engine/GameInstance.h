#pragma once
#include "Subsystems/GameInstanceSubsystem.h"
#include "UObject/ObjectPtr.h"

/// One running game and its subsystems.
class UGameInstance : public UObject {
  SHIM_CLASS(UGameInstance, UObject)
  template <class T>
  T* GetSubsystem() const {
    for (UGameInstanceSubsystem* subsystem : shim_subsystems_) {
      if (subsystem->ShimClass()->ShimIsA(T::StaticClass())) return static_cast<T*>(subsystem);
    }
    return nullptr;
  }
  /// For the shim.
  std::vector<UGameInstanceSubsystem*> shim_subsystems_;
};
