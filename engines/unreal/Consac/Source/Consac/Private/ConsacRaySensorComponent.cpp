// Copyright CONSAC authors. MIT License.
#include "ConsacRaySensorComponent.h"

#include <cmath>

#include "CollisionQueryParams.h"
#include "Engine/EngineTypes.h"
#include "Engine/HitResult.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"

UConsacRaySensorComponent::UConsacRaySensorComponent()
{
	ObservationName = FName(TEXT("rays"));
}

FConsacSpace UConsacRaySensorComponent::GetSpace() const
{
	FConsacSpace Space;
	Space.Size = Rays;
	Space.Low.Add(0.0f);
	Space.High.Add(1.0f);
	return Space;
}

void UConsacRaySensorComponent::Sense(TArray<float>& Values)
{
	Values.Reset();
	const UWorld* World = GetWorld();
	FCollisionQueryParams Parameters;
	Parameters.AddIgnoredActor(GetOwner());
	const FVector Start = GetComponentLocation();
	const FVector Forward = GetForwardVector();
	const FVector Right = GetRightVector();
	// All around: the last ray is not the first once more.
	const int32 Gaps = SpreadDegrees >= 360.0f ? Rays : Rays - 1;
	const double Step = Gaps > 0 ? static_cast<double>(SpreadDegrees) / Gaps : 0.0;
	const double First = SpreadDegrees >= 360.0f || Gaps == 0 ? 0.0 : -0.5 * static_cast<double>(SpreadDegrees);
	for (int32 Ray = 0; Ray < Rays; ++Ray)
	{
		const double Angle = (First + Ray * Step) * 0.017453292519943295;
		const double Along = std::cos(Angle) * static_cast<double>(Length);
		const double Across = std::sin(Angle) * static_cast<double>(Length);
		const FVector End(Start.X + Along * Forward.X + Across * Right.X, Start.Y + Along * Forward.Y + Across * Right.Y,
			Start.Z + Along * Forward.Z + Across * Right.Z);
		FHitResult Hit;
		const bool bHit = World != nullptr && World->LineTraceSingleByChannel(Hit, Start, End, Channel, Parameters);
		Values.Add(bHit ? Hit.Time : 1.0f);
	}
}
