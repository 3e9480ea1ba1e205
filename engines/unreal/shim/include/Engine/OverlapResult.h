#pragma once
class AActor;

struct FOverlapResult {
  AActor* GetActor() const { return shim_actor_; }
  AActor* shim_actor_ = nullptr;
};
