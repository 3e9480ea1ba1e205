#pragma once
#include "CoreMinimal.h"

struct FParse {
  static bool Value(const TCHAR* stream, const TCHAR* match, FString& value);
};
