#pragma once
#include "UObject/Object.h"

class UPhysicsSettings : public UObject {
  SHIM_CLASS(UPhysicsSettings, UObject)
  static UPhysicsSettings* Get();
  float MaxPhysicsDeltaTime = 1.0f / 30.0f;
  float MaxSubstepDeltaTime = 1.0f / 60.0f;
  int32 MaxSubsteps = 6;
  bool bSubstepping = true;
};
