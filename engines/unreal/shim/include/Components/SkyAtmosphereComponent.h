#pragma once
#include "GameFramework/Actor.h"

class ASkyAtmosphere : public AActor {
  SHIM_CLASS(ASkyAtmosphere, AActor)
};
