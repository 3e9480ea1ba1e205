// Copyright CONSAC authors. MIT License.
// Ticks of one length, as fast as the computer can: sets what is needed and puts everything back.
#pragma once

#include "CoreMinimal.h"

/** While it lives, every tick is `StepSeconds` of game time and nothing waits for the clock. */
class FConsacStepGuard
{
public:
	explicit FConsacStepGuard(double StepSeconds);
	~FConsacStepGuard();
	FConsacStepGuard(const FConsacStepGuard&) = delete;
	FConsacStepGuard& operator=(const FConsacStepGuard&) = delete;

private:
	bool bUsedFixedStep = false;
	double FixedSeconds = 0.0;
	float MaxFramesPerSecond = 0.0f;
	float MaxPhysicsSeconds = 0.0f;
	bool bSubstepped = false;
};
