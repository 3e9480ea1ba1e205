#pragma once
#include "Components/SceneComponent.h"

class UStaticMesh;

class UStaticMeshComponent : public USceneComponent {
  SHIM_CLASS(UStaticMeshComponent, USceneComponent)
  bool SetStaticMesh(UStaticMesh* mesh) {
    shim_mesh_ = mesh;
    return mesh != nullptr;
  }
  /// For tests: what is seen.
  UStaticMesh* shim_mesh_ = nullptr;
};
