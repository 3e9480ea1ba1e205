#pragma once
#include "Components/SceneComponent.h"

/// Something that may be a body.
class UPrimitiveComponent : public USceneComponent {
  SHIM_CLASS(UPrimitiveComponent, USceneComponent)
  /// A body is where physics puts it: it leaves its parent.
  virtual void SetSimulatePhysics(bool simulates) {
    const FTransform at = GetComponentTransform();
    shim_physics_ = simulates;
    if (!simulates) return;
    shim_parent_ = nullptr;
    SetRelativeTransform(at);
  }
  void SetMassOverrideInKg(FName bone = NAME_None, float mass = 1.0f, bool overrides = true) {
    static_cast<void>(bone);
    shim_mass_ = overrides ? mass : 0.0f;
  }
  virtual void WakeRigidBody(FName bone = NAME_None) {
    static_cast<void>(bone);
    ++shim_woken_;
  }

  /// For tests.
  float shim_mass_ = 0.0f;  // kg; 0: by its shape
  int shim_woken_ = 0;
};
