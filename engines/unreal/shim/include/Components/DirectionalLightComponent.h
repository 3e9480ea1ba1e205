#pragma once
#include "Components/SceneComponent.h"

class UDirectionalLightComponent : public USceneComponent {
  SHIM_CLASS(UDirectionalLightComponent, USceneComponent)
  uint32 bAtmosphereSunLight : 1 = 0;
};
