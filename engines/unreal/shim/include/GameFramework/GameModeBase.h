#pragma once
#include "GameFramework/Actor.h"

class AGameModeBase : public AActor {
  SHIM_CLASS(AGameModeBase, AActor)
};
