#pragma once
#include "UObject/Object.h"

class UGameInstance;
class FSubsystemCollectionBase {};

class UGameInstanceSubsystem : public UObject {
  SHIM_CLASS(UGameInstanceSubsystem, UObject)
  virtual void Initialize(FSubsystemCollectionBase& collection) { static_cast<void>(collection); }
  virtual void Deinitialize() {}
  UGameInstance* GetGameInstance() const { return shim_game_; }
  /// For the shim.
  UGameInstance* shim_game_ = nullptr;
};

namespace Shim {
/// Every game has one of these; the generated code says so.
int AddSubsystem(UGameInstanceSubsystem* (*make)());
}  // namespace Shim
