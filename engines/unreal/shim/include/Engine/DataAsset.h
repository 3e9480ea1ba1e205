#pragma once
#include "UObject/Object.h"

class UDataAsset : public UObject {
  SHIM_CLASS(UDataAsset, UObject)
};
class UPrimaryDataAsset : public UDataAsset {
  SHIM_CLASS(UPrimaryDataAsset, UDataAsset)
};
