#pragma once
#include "Components/SkyLightComponent.h"
#include "GameFramework/Actor.h"

class ASkyLight : public AActor {
 public:
  using Super = AActor;
  ASkyLight() { SetRootComponent(CreateDefaultSubobject<USkyLightComponent>(FName(u"SkyLightComponent0"))); }
  static UClass* StaticClass() {
    static UClass made("ASkyLight", AActor::StaticClass());
    return &made;
  }
  UClass* ShimClass() const override { return StaticClass(); }
};
