#pragma once
#include "Components/SceneComponent.h"

/// Takes the sky's light when it is registered.
class USkyLightComponent : public USceneComponent {
  SHIM_CLASS(USkyLightComponent, USceneComponent)
  void SetMobility(EComponentMobility::Type mobility) override {
    USceneComponent::SetMobility(mobility);
    shim_captures_ = bRealTimeCapture;
  }
  bool bRealTimeCapture = false;
  bool shim_captures_ = false;
};
