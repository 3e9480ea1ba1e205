// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Logging/LogMacros.h"

DECLARE_LOG_CATEGORY_EXTERN(LogConsac, Log, All);
