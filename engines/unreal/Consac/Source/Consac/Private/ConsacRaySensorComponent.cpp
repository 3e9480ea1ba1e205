// Copyright CONSAC authors. MIT License.
#include "ConsacRaySensorComponent.h"

#include <cmath>

#include "CollisionQueryParams.h"
#include "DrawDebugHelpers.h"
#include "Engine/EngineTypes.h"
#include "Engine/HitResult.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"

UConsacRaySensorComponent::UConsacRaySensorComponent()
{
	ObservationName = FName(TEXT("rays"));
}

namespace ConsacPlugin
{

// The angle of one of several that spread over so many degrees; all around the last is not the first once more.
static double SpreadAngle(int32 Index, int32 Count, float Degrees)
{
	constexpr double RadiansOfDegree = 0.017453292519943295;
	const bool bAround = Degrees >= 360.0f;
	const int32 Gaps = bAround ? Count : Count - 1;
	const double Step = Gaps > 0 ? static_cast<double>(Degrees) / Gaps : 0.0;
	const double First = bAround || Gaps == 0 ? 0.0 : -0.5 * static_cast<double>(Degrees);
	return (First + Index * Step) * RadiansOfDegree;
}

}

FConsacSpace UConsacRaySensorComponent::GetSpace() const
{
	FConsacSpace Space;
	const int64 Size = static_cast<int64>(Rays) * Fans * (1 + MoreChannels.Num()) * (1 + DetectableTags.Num());
	constexpr int64 Largest = 1 << 24; // of a box
	Space.Size = Size > 0 && Size <= Largest ? static_cast<int32>(Size) : 0;
	Space.Low.Add(0.0f);
	Space.High.Add(1.0f);
	return Space;
}

void UConsacRaySensorComponent::CastRay(const FVector& Start, const FVector& End, ECollisionChannel Through, TArray<float>& Values) const
{
	const UWorld* World = GetWorld();
	FCollisionQueryParams Parameters;
	Parameters.AddIgnoredActor(GetOwner());
	FHitResult Hit;
	const bool bHit = World != nullptr && World->LineTraceSingleByChannel(Hit, Start, End, Through, Parameters);
	const float Share = bHit ? Hit.Time : 1.0f;
	Values.Add(Share);
	const AActor* Actor = bHit ? Hit.GetActor() : nullptr;
	for (const FName& Tag : DetectableTags)
	{
		Values.Add(Actor != nullptr && Actor->ActorHasTag(Tag) ? 1.0f : 0.0f);
	}
	if (bDraw && World != nullptr)
	{
		const double Far = static_cast<double>(Share);
		const FVector Tip(Start.X + Far * (End.X - Start.X), Start.Y + Far * (End.Y - Start.Y), Start.Z + Far * (End.Z - Start.Z));
		DrawDebugLine(World, Start, Tip, bHit ? FColor(255, 64, 64) : FColor(64, 255, 64));
	}
}

void UConsacRaySensorComponent::Sense(TArray<float>& Values)
{
	Values.Reset();
	const FVector Start = GetComponentLocation();
	const FVector Forward = GetForwardVector();
	const FVector Right = GetRightVector();
	const FVector Up = GetUpVector();
	for (int32 Layer = 0; Layer <= MoreChannels.Num(); ++Layer)
	{
		const ECollisionChannel Through = Layer == 0 ? Channel : MoreChannels[Layer - 1];
		for (int32 Fan = 0; Fan < Fans; ++Fan)
		{
			const double Height = ConsacPlugin::SpreadAngle(Fan, Fans, FanSpreadDegrees);
			const double Above = std::sin(Height) * static_cast<double>(Length);
			const double Level = std::cos(Height) * static_cast<double>(Length);
			for (int32 Ray = 0; Ray < Rays; ++Ray)
			{
				const double Angle = ConsacPlugin::SpreadAngle(Ray, Rays, SpreadDegrees);
				const double Along = std::cos(Angle) * Level;
				const double Across = std::sin(Angle) * Level;
				const FVector End(Start.X + Along * Forward.X + Across * Right.X + Above * Up.X, Start.Y + Along * Forward.Y + Across * Right.Y + Above * Up.Y,
					Start.Z + Along * Forward.Z + Across * Right.Z + Above * Up.Z);
				CastRay(Start, End, Through, Values);
			}
		}
	}
}
