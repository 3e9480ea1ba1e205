// Copyright CONSAC authors. MIT License.
// The curve of the Consac panel: mean reward over steps, kept for as long as a training is.
#pragma once

#include "CoreMinimal.h"

/** A point of the curve. */
struct FConsacCurvePoint
{
	int64 Steps = 0;
	float Reward = 0.0f;
};

/** Mean reward over steps, from the first on. Of many samples every second is kept, of more every fourth, and so on: it stays evenly dense, and
 *  short. */
class FConsacCurve
{
public:
	/** Most points that are kept, and the latest. */
	static constexpr int32 Most = 256;

	/** A sample. One without a step more than the one before changes its reward; one with fewer steps begins another training's curve. */
	void Add(int64 Steps, float Reward);

	/** Another training's. */
	void Clear();

	/** All that is kept, in order of steps. */
	TArray<FConsacCurvePoint> GetPoints() const;

	/** Lowest and highest reward that is kept; 0 where nothing is. */
	float GetLowest() const;
	float GetHighest() const;

	/** As a line in a picture of that size, whose upper left corner is 0: first and latest step at its sides, highest and lowest reward at its top and
	 *  bottom; where all are alike, in its middle. Nothing where there are fewer than two points. */
	TArray<FVector2f> InPicture(float Width, float Height) const;

private:
	TArray<FConsacCurvePoint> Kept;
	FConsacCurvePoint Latest;
	int32 Samples = 0;
	int32 Every = 1; // sample of so many is kept
};
