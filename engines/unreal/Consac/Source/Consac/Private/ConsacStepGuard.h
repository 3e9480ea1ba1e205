// Copyright CONSAC authors. MIT License.
// How time passes while it trains: ticks of one length, and frames as fast as the computer can. Each sets what is needed and
// puts everything back. Game thread only.
#pragma once

#include "CoreMinimal.h"

class UWorld;

/** While it lives, every tick is `StepSeconds` of game time; a warning where `World` allows no such ticks. Of several at once, in several games of one process, the latest
 *  that is left says how long a tick is, and the last to go puts everything back. */
class FConsacStepGuard
{
public:
	FConsacStepGuard(double StepSeconds, const UWorld& World);
	~FConsacStepGuard();
	FConsacStepGuard(const FConsacStepGuard&) = delete;
	FConsacStepGuard& operator=(const FConsacStepGuard&) = delete;
};

/** While it lives, no frame waits: for a limit, for the screen, or because the editor is in the background. The last of
 *  several puts back what nobody has changed meanwhile. */
class FConsacSpeedGuard
{
public:
	FConsacSpeedGuard();
	~FConsacSpeedGuard();
	FConsacSpeedGuard(const FConsacSpeedGuard&) = delete;
	FConsacSpeedGuard& operator=(const FConsacSpeedGuard&) = delete;
};
