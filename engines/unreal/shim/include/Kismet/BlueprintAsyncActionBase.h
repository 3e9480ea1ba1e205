#pragma once
#include "UObject/Object.h"

class UBlueprintAsyncActionBase : public UObject {
  SHIM_CLASS(UBlueprintAsyncActionBase, UObject)
  virtual void Activate() {}
  /// The game keeps it until it is ready to go; nobody else does.
  void RegisterWithGameInstance(const UObject* context);
  virtual void SetReadyToDestroy() { shim_ready_ = true; }
  /// For the shim and tests.
  UObject* shim_game_ = nullptr;
  bool shim_ready_ = false;
};
