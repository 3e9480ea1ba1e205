#pragma once
#include "Components/PrimitiveComponent.h"

class UStaticMesh;

class UStaticMeshComponent : public UPrimitiveComponent {
  SHIM_CLASS(UStaticMeshComponent, UPrimitiveComponent)
  bool SetStaticMesh(UStaticMesh* mesh) {
    shim_mesh_ = mesh;
    return mesh != nullptr;
  }
  /// For tests: what is seen.
  UStaticMesh* shim_mesh_ = nullptr;
};
