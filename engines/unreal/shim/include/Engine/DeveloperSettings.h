#pragma once
#include "UObject/Object.h"

class UDeveloperSettings : public UObject {
  SHIM_CLASS(UDeveloperSettings, UObject)
};
