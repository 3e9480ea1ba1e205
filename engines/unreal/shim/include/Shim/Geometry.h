#pragma once
// Places and rotations: of doubles, as in Unreal 5.

#include "Shim/Macros.h"

struct FVector {
  double X = 0.0, Y = 0.0, Z = 0.0;
  FVector() = default;
  FVector(double x, double y, double z) : X(x), Y(y), Z(z) {}
};

struct FQuat {
  double X = 0.0, Y = 0.0, Z = 0.0, W = 1.0;
};

struct FRotator {
  double Pitch = 0.0, Yaw = 0.0, Roll = 0.0;
  FRotator() = default;
  FRotator(double pitch, double yaw, double roll) : Pitch(pitch), Yaw(yaw), Roll(roll) {}
};

struct FTransform {
  FVector GetLocation() const { return location_; }
  FQuat GetRotation() const { return rotation_; }
  void SetLocation(const FVector& location) { location_ = location; }
  void SetRotation(const FQuat& rotation) { rotation_ = rotation; }

 private:
  FVector location_;
  FQuat rotation_;
};

struct FColor {
  uint8 B = 0, G = 0, R = 0;
};
struct FLinearColor {};
