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
  void ShimReferences(Shim::References& references) const override {
    references.Add(shim_subsystems_);
    references.Add(shim_worlds_);
    references.Add(shim_registered_);
  }
  /// For the shim: its worlds, and what keeps itself alive in it.
  std::vector<UWorld*> shim_worlds_;
  std::vector<UObject*> shim_registered_;
  std::vector<UGameInstanceSubsystem*> shim_subsystems_;
};
