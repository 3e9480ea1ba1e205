#pragma once
#include "Engine/EngineBaseTypes.h"
#include "Shim/Play.h"
#include "UObject/Object.h"

class AActor;

enum ETickingGroup { TG_PrePhysics, TG_PostPhysics };
struct FActorComponentTickFunction {
  ETickingGroup TickGroup = TG_PrePhysics;
  bool bCanEverTick = false;
  bool bTickEvenWhenPaused = false;
  /// For the shim: whether it ticks now.
  bool ShimTicks(ETickingGroup group, bool paused) const {
    return bCanEverTick && TickGroup == group && (!paused || bTickEvenWhenPaused);
  }
};

class UActorComponent : public UObject {
  SHIM_CLASS(UActorComponent, UObject)
  virtual void BeginPlay() {}
  virtual void EndPlay(const EEndPlayReason::Type reason) { static_cast<void>(reason); }
  virtual void TickComponent(float seconds, ELevelTick type, FActorComponentTickFunction* function) {
    static_cast<void>(seconds), static_cast<void>(type), static_cast<void>(function);
  }
  void RegisterComponent();
  virtual void DestroyComponent(bool promote_children = false);
  bool HasBegunPlay() const { return shim_begun_; }
  AActor* GetOwner() const;
  UWorld* GetWorld() const override;
  FActorComponentTickFunction PrimaryComponentTick;

  /// For the shim.
  bool shim_begun_ = false;
};
