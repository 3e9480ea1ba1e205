#pragma once
#include "Components/DirectionalLightComponent.h"
#include "GameFramework/Actor.h"

class ADirectionalLight : public AActor {
 public:
  using Super = AActor;
  ADirectionalLight() {
    SetRootComponent(CreateDefaultSubobject<UDirectionalLightComponent>(FName(u"LightComponent0")));
  }
  static UClass* StaticClass() {
    static UClass made("ADirectionalLight", AActor::StaticClass());
    return &made;
  }
  UClass* ShimClass() const override { return StaticClass(); }
};
