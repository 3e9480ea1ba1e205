#pragma once
#include "Components/StaticMeshComponent.h"
#include "GameFramework/Actor.h"

class AStaticMeshActor : public AActor {
 public:
  using Super = AActor;
  AStaticMeshActor() { SetRootComponent(CreateDefaultSubobject<UStaticMeshComponent>(FName(u"StaticMeshComponent0"))); }
  static UClass* StaticClass() {
    static UClass made("AStaticMeshActor", AActor::StaticClass());
    return &made;
  }
  UClass* ShimClass() const override { return StaticClass(); }
};
