#pragma once
#include "UObject/Object.h"

class UStaticMesh : public UObject {
  SHIM_CLASS(UStaticMesh, UObject)
};
