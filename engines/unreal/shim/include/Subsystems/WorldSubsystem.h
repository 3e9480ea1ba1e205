#pragma once
#include "Engine/EngineTypes.h"
#include "Subsystems/GameInstanceSubsystem.h"

/// One for each world that it supports, for as long as that lives.
class UWorldSubsystem : public UObject {
  SHIM_CLASS(UWorldSubsystem, UObject)
  virtual void Initialize(FSubsystemCollectionBase& collection) { static_cast<void>(collection); }
  virtual void Deinitialize() {}
  UWorld* GetWorld() const override;
  /// For the shim.
  bool ShimSupports(EWorldType::Type type) const { return DoesSupportWorldType(type); }

 protected:
  virtual bool DoesSupportWorldType(const EWorldType::Type type) const { return type != EWorldType::None; }
};

namespace Shim {
/// Every world has one of these; the generated code says so.
int AddSubsystem(UWorldSubsystem* (*make)());
}  // namespace Shim
