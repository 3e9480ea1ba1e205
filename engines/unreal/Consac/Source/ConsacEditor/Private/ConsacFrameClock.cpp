// Copyright CONSAC authors. MIT License.
#include "ConsacFrameClock.h"

void FConsacFrameClock::BeginWorld(double Now)
{
	WorldBegan = Now;
}

void FConsacFrameClock::EndWorld(double Now)
{
	WorldsNow += Now - WorldBegan;
	bTicked = true;
}

void FConsacFrameClock::EndFrame(double Now)
{
	if (bTicked && bBegun)
	{
		++Frames;
		SumOfFrames += Now - FrameBegan;
		SumOfWorlds += WorldsNow;
	}
	FrameBegan = Now;
	bBegun = true;
	WorldsNow = 0.0;
	bTicked = false;
}

FConsacFrameTimes FConsacFrameClock::Take()
{
	FConsacFrameTimes Times;
	if (Frames > 0)
	{
		constexpr double Milliseconds = 1000.0;
		Times.Frames = Frames;
		Times.Frame = Milliseconds * SumOfFrames / Frames;
		Times.Worlds = Milliseconds * SumOfWorlds / Frames;
	}
	Frames = 0;
	SumOfFrames = SumOfWorlds = 0.0;
	return Times;
}
