#pragma once
#include "Components/ActorComponent.h"
#include "Engine/EngineTypes.h"

/// Looks along X, as turned by its yaw alone.
class USceneComponent : public UActorComponent {
  SHIM_CLASS(USceneComponent, UActorComponent)
  void SetupAttachment(USceneComponent* parent) { shim_parent_ = parent; }
  void SetRelativeLocationAndRotation(const FVector& location, const FQuat& rotation) {
    shim_location_ = location;
    shim_rotation_ = rotation;
  }
  void SetRelativeTransform(const FTransform& transform) {
    SetRelativeLocationAndRotation(transform.GetLocation(), transform.GetRotation());
    SetRelativeScale3D(transform.ShimScale());
  }
  virtual void SetMobility(EComponentMobility::Type mobility) { shim_mobility_ = mobility; }
  void SetRelativeScale3D(const FVector& scale) { shim_scale_ = scale; }
  FVector GetComponentLocation() const;
  /// In the world, of itself and all that it hangs on; the actor's own place is its root's.
  FTransform GetComponentTransform() const;
  FVector GetForwardVector() const;
  FVector GetRightVector() const;
  FVector GetUpVector() const { return FVector(0.0, 0.0, 1.0); }
  FQuat GetComponentQuat() const { return shim_rotation_; }
  virtual bool IsSimulatingPhysics(FName bone = NAME_None) const {
    static_cast<void>(bone);
    return shim_physics_;
  }

  /// For the shim.
  USceneComponent* shim_parent_ = nullptr;
  FVector shim_location_ = FVector::ZeroVector, shim_scale_{1.0, 1.0, 1.0};
  FQuat shim_rotation_ = FQuat::Identity;
  bool shim_physics_ = false;
  EComponentMobility::Type shim_mobility_ = EComponentMobility::Static;
};
