#pragma once
#include "GameFramework/Actor.h"

/// A person at the game, and what that person looks through.
class APlayerController : public AActor {
  SHIM_CLASS(APlayerController, AActor)
  virtual void SetViewTarget(AActor* target) { shim_view_ = target; }
  TObjectPtr<AActor> shim_view_;
};
