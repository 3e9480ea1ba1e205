#pragma once
#include "GameFramework/Actor.h"

/// A level's settings: a tick is no shorter and no longer than they say, in seconds, whatever was asked for.
class AWorldSettings : public AActor {
  SHIM_CLASS(AWorldSettings, AActor)
  float MinUndilatedFrameTime = 0.0005f;
  float MaxUndilatedFrameTime = 0.4f;
};
