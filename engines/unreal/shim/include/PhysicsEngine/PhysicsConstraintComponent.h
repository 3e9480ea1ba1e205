#pragma once
#include "Components/PrimitiveComponent.h"

enum ELinearConstraintMotion { LCM_Free, LCM_Limited, LCM_Locked };
enum EAngularConstraintMotion { ACM_Free, ACM_Limited, ACM_Locked };
namespace EAngularDriveMode {
enum Type { SLERP, TwistAndSwing };
}

/// Holds two bodies; nothing is simulated here, tests read what it was told.
class UPhysicsConstraintComponent : public USceneComponent {
  SHIM_CLASS(UPhysicsConstraintComponent, USceneComponent)
  void SetConstrainedComponents(UPrimitiveComponent* first, FName first_bone, UPrimitiveComponent* second,
                                FName second_bone) {
    static_cast<void>(first_bone), static_cast<void>(second_bone);
    shim_first_ = first, shim_second_ = second;
  }
  void SetDisableCollision(bool disable) { shim_collides_ = !disable; }
  void SetLinearXLimit(ELinearConstraintMotion motion, float size) { shim_linear_[0] = motion, shim_shift_ = size; }
  void SetLinearYLimit(ELinearConstraintMotion motion, float) { shim_linear_[1] = motion; }
  void SetLinearZLimit(ELinearConstraintMotion motion, float) { shim_linear_[2] = motion; }
  void SetAngularTwistLimit(EAngularConstraintMotion motion, float degrees) {
    shim_twist_ = motion, shim_degrees_ = degrees;
  }
  void SetAngularSwing1Limit(EAngularConstraintMotion motion, float) { shim_swing_[0] = motion; }
  void SetAngularSwing2Limit(EAngularConstraintMotion motion, float) { shim_swing_[1] = motion; }
  void SetAngularDriveMode(EAngularDriveMode::Type mode) { shim_mode_ = mode; }
  void SetOrientationDriveTwistAndSwing(bool twist, bool swing) { shim_drives_ = twist && !swing; }
  void SetAngularVelocityDriveTwistAndSwing(bool twist, bool swing) { shim_damps_ = twist && !swing; }
  void SetAngularDriveParams(float stiffness, float damping, float force) {
    shim_stiffness_ = stiffness, shim_damping_ = damping, shim_force_ = force;
  }
  void SetAngularOrientationTarget(const FRotator& target) { shim_roll_ = target.Roll; }
  void SetLinearPositionDrive(bool x, bool y, bool z) { shim_drives_ = x && !y && !z; }
  void SetLinearVelocityDrive(bool x, bool y, bool z) { shim_damps_ = x && !y && !z; }
  void SetLinearDriveParams(float stiffness, float damping, float force) {
    SetAngularDriveParams(stiffness, damping, force);
  }
  void SetLinearPositionTarget(const FVector& target) { shim_x_ = target.X; }

  /// For tests: as in the engine, all is free until it is limited but for the linear axes.
  UPrimitiveComponent *shim_first_ = nullptr, *shim_second_ = nullptr;
  bool shim_collides_ = true, shim_drives_ = false, shim_damps_ = false;
  ELinearConstraintMotion shim_linear_[3] = {LCM_Locked, LCM_Locked, LCM_Locked};
  EAngularConstraintMotion shim_twist_ = ACM_Free, shim_swing_[2] = {ACM_Free, ACM_Free};
  EAngularDriveMode::Type shim_mode_ = EAngularDriveMode::SLERP;
  float shim_shift_ = 0.0f, shim_degrees_ = 0.0f, shim_stiffness_ = 0.0f, shim_damping_ = 0.0f, shim_force_ = 0.0f;
  double shim_roll_ = 0.0, shim_x_ = 0.0;
};
