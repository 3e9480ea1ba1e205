#pragma once
#include "CoreMinimal.h"

struct FCollisionShape {
  static FCollisionShape MakeBox(const FVector& half) {
    FCollisionShape made;
    made.shim_half_ = half;
    return made;
  }
  FVector shim_half_ = FVector::ZeroVector;
};
