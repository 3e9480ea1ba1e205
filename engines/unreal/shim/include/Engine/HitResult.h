#pragma once
class AActor;

struct FHitResult {
  float Time = 1.0f;
  AActor* GetActor() const { return shim_actor_; }
  /// For tests: what was hit.
  AActor* shim_actor_ = nullptr;
};
