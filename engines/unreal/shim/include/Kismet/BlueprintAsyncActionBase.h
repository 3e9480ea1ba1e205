#pragma once
#include "UObject/Object.h"

class UBlueprintAsyncActionBase : public UObject {
  SHIM_CLASS(UBlueprintAsyncActionBase, UObject)
  virtual void Activate() {}
  void RegisterWithGameInstance(const UObject* context) { check(context != nullptr); }
  virtual void SetReadyToDestroy() { shim_ready_ = true; }
  /// For tests.
  bool shim_ready_ = false;
};
