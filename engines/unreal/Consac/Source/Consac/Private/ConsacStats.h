// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.h"

namespace ConsacPlugin
{

/** Shows it on the screen, under `stat Consac`. */
void ShowStats(const FConsacProgress& Progress);

}
