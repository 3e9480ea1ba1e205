// Copyright CONSAC authors. MIT License.
// Ticks of one length, as fast as the computer can: sets what is needed and puts everything back.
#pragma once

#include "CoreMinimal.h"

/** While it lives, every tick is `StepSeconds` of game time and nothing waits for the clock. Of several at once, in
 *  several games of one process, the latest says how long a tick is, and the last to go puts everything back. */
class FConsacStepGuard
{
public:
	explicit FConsacStepGuard(double StepSeconds);
	~FConsacStepGuard();
	FConsacStepGuard(const FConsacStepGuard&) = delete;
	FConsacStepGuard& operator=(const FConsacStepGuard&) = delete;
};
