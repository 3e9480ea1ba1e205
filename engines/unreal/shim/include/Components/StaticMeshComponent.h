#pragma once
#include "Components/SceneComponent.h"

class UStaticMesh;

class UStaticMeshComponent : public USceneComponent {
  SHIM_CLASS(UStaticMeshComponent, USceneComponent)
  bool SetStaticMesh(UStaticMesh* mesh) { return mesh != nullptr; }
};
