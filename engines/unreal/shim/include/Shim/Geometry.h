#pragma once
// Places and rotations: of doubles, as in Unreal 5. What Unreal leaves uninitialised is garbage here.

#include <cstring>

#include "Shim/Macros.h"

namespace Shim {
/// A number that nobody means.
inline double Garbage() {
  constexpr unsigned char kByte = 0xCD;
  double value;
  std::memset(&value, kByte, sizeof(value));
  return value;
}
}  // namespace Shim

struct FVector {
  double X, Y, Z;
  FVector() : X(Shim::Garbage()), Y(Shim::Garbage()), Z(Shim::Garbage()) {}
  FVector(double x, double y, double z) : X(x), Y(y), Z(z) {}
  static const FVector ZeroVector;
};
inline const FVector FVector::ZeroVector(0.0, 0.0, 0.0);

struct FQuat {
  double X, Y, Z, W;
  FQuat() : X(Shim::Garbage()), Y(Shim::Garbage()), Z(Shim::Garbage()), W(Shim::Garbage()) {}
  FQuat(double x, double y, double z, double w) : X(x), Y(y), Z(z), W(w) {}
  static const FQuat Identity;
};
inline const FQuat FQuat::Identity(0.0, 0.0, 0.0, 1.0);

struct FRotator {
  double Pitch, Yaw, Roll;
  FRotator() : Pitch(Shim::Garbage()), Yaw(Shim::Garbage()), Roll(Shim::Garbage()) {}
  FRotator(double pitch, double yaw, double roll) : Pitch(pitch), Yaw(yaw), Roll(roll) {}
};

struct FTransform {
  FVector GetLocation() const { return location_; }
  FQuat GetRotation() const { return rotation_; }
  void SetLocation(const FVector& location) { location_ = location; }
  void SetRotation(const FQuat& rotation) { rotation_ = rotation; }
  FVector ShimScale() const { return scale_; }
  void SetScale3D(const FVector& scale) { scale_ = scale; }

 private:
  FVector location_ = FVector::ZeroVector;
  FQuat rotation_ = FQuat::Identity;
  FVector scale_{1.0, 1.0, 1.0};
};

struct FColor {
  uint8 B, G, R;
  FColor() : B(0xCD), G(0xCD), R(0xCD) {}
  FColor(uint8 r, uint8 g, uint8 b) : B(b), G(g), R(r) {}
};
struct FLinearColor {
  float R, G, B, A;
  FLinearColor() = default;
  FLinearColor(float r, float g, float b, float a = 1.0f) : R(r), G(g), B(b), A(a) {}
};

/// Places on a screen, from its upper left corner.
struct FVector2D {
  double X, Y;
  FVector2D() : X(Shim::Garbage()), Y(Shim::Garbage()) {}
  FVector2D(double x, double y) : X(x), Y(y) {}
};
struct FVector2f {
  float X, Y;
  FVector2f() : X(-4.3e8f), Y(-4.3e8f) {}
  FVector2f(float x, float y) : X(x), Y(y) {}
};

/// Points of a picture, the last ones left out.
struct FIntRect {
  FIntRect() = default;  // leaves garbage in the engine's; here none is read
  FIntRect(int32 x0, int32 y0, int32 x1, int32 y1) : shim_width_(x1 - x0), shim_height_(y1 - y0) {}
  int32 shim_width_ = 0, shim_height_ = 0;
};
