// Copyright CONSAC authors. MIT License.
#include "ConsacCurve.h"

#include <algorithm>

void FConsacCurve::Add(int64 Steps, float Reward)
{
	if (Samples > 0 && Steps < Latest.Steps)
	{
		Clear();
	}
	const bool bSame = Samples > 0 && Steps == Latest.Steps;
	Latest.Steps = Steps;
	Latest.Reward = Reward;
	if (bSame)
	{
		if (!Kept.IsEmpty() && Kept.Last().Steps == Steps)
		{
			Kept.Last() = Latest;
		}
		return;
	}
	if (Samples % Every == 0)
	{
		Kept.Add(Latest);
	}
	++Samples;
	if (Kept.Num() > Most)
	{
		TArray<FConsacCurvePoint> Fewer;
		for (int32 Index = 0; Index < Kept.Num(); Index += 2)
		{
			Fewer.Add(Kept[Index]);
		}
		Kept = Fewer;
		Every *= 2;
	}
}

void FConsacCurve::Clear()
{
	Kept.Reset();
	Latest = FConsacCurvePoint();
	Samples = 0;
	Every = 1;
}

TArray<FConsacCurvePoint> FConsacCurve::GetPoints() const
{
	TArray<FConsacCurvePoint> Points = Kept;
	if (!Points.IsEmpty() && Points.Last().Steps != Latest.Steps)
	{
		Points.Add(Latest);
	}
	return Points;
}

float FConsacCurve::GetLowest() const
{
	float Lowest = Latest.Reward;
	for (const FConsacCurvePoint& Point : Kept)
	{
		Lowest = std::min(Lowest, Point.Reward);
	}
	return Lowest;
}

float FConsacCurve::GetHighest() const
{
	float Highest = Latest.Reward;
	for (const FConsacCurvePoint& Point : Kept)
	{
		Highest = std::max(Highest, Point.Reward);
	}
	return Highest;
}

TArray<FVector2f> FConsacCurve::InPicture(float Width, float Height) const
{
	TArray<FVector2f> Line;
	TArray<FConsacCurvePoint> Points = GetPoints();
	if (Points.Num() < 2)
	{
		return Line;
	}
	const int64 First = Points[0].Steps;
	const double Steps = static_cast<double>(Points.Last().Steps - First);
	const float Lowest = GetLowest();
	const float Rewards = GetHighest() - Lowest;
	for (const FConsacCurvePoint& Point : Points)
	{
		const float Along = static_cast<float>(static_cast<double>(Point.Steps - First) / Steps);
		const float Up = Rewards > 0.0f ? (Point.Reward - Lowest) / Rewards : 0.5f;
		Line.Add(FVector2f(Width * Along, Height * (1.0f - Up)));
	}
	return Line;
}
