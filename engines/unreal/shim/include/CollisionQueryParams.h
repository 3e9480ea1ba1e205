#pragma once
#include "CoreMinimal.h"

class AActor;

struct FCollisionQueryParams {
  void AddIgnoredActor(const AActor* actor) { shim_ignored_ = actor; }
  const AActor* ShimIgnored() const { return shim_ignored_; }

 private:
  const AActor* shim_ignored_ = nullptr;
};
