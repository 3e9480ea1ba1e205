#pragma once
#include "GameFramework/Actor.h"

class ACameraActor : public AActor {
  SHIM_CLASS(ACameraActor, AActor)
};
