// Copyright CONSAC authors. MIT License.
// Where the time of a frame goes while a game plays in the editor.
#pragma once

#include "CoreMinimal.h"

/** Means of the frames of some time, in milliseconds. */
struct FConsacFrameTimes
{
	/** Frames; 0 where no game was played. */
	int32 Frames = 0;
	/** From the end of a frame to the end of the next. */
	double Frame = 0.0;
	/** Of that, the tick of the game's worlds: actors, components, physics, agents and trainer. */
	double Worlds = 0.0;
};

/** Adds up what it is told. Times are in seconds. */
class FConsacFrameClock
{
public:
	void BeginWorld(double Now);
	void EndWorld(double Now);
	void EndFrame(double Now);

	/** The means since the last call. A frame without a world's tick is no frame of a game. */
	FConsacFrameTimes Take();

private:
	double WorldBegan = 0.0;
	double WorldsNow = 0.0;   // of this frame
	bool bTicked = false;     // a world, in this frame
	double FrameBegan = 0.0;
	bool bBegun = false;      // FrameBegan is known
	int32 Frames = 0;
	double SumOfFrames = 0.0;
	double SumOfWorlds = 0.0;
};
