// Copyright CONSAC authors. MIT License.
#include "ConsacTransformSensorComponent.h"

#include "GameFramework/Actor.h"
#include "UObject/UObjectGlobals.h"

UConsacTransformSensorComponent::UConsacTransformSensorComponent()
{
	ObservationName = FName(TEXT("transform"));
}

FConsacSpace UConsacTransformSensorComponent::GetSpace() const
{
	FConsacSpace Space;
	Space.Size = bRotation ? 7 : 3;
	return Space;
}

void UConsacTransformSensorComponent::Sense(TArray<float>& Values)
{
	Values.Reset();
	const AActor* Owner = GetOwner();
	const AActor* Seen = IsValid(Of.Get()) ? Of.Get() : Owner;
	if (Seen == nullptr)
	{
		Values.SetNum(bRotation ? 7 : 3);
		return;
	}
	const FVector Place = Seen->GetActorLocation();
	const FVector From = bFromOwner && Owner != nullptr ? Owner->GetActorLocation() : FVector(0.0, 0.0, 0.0);
	const double Unit = Scale > 0.0f ? 1.0 / static_cast<double>(Scale) : 1.0;
	Values.Add(static_cast<float>((Place.X - From.X) * Unit));
	Values.Add(static_cast<float>((Place.Y - From.Y) * Unit));
	Values.Add(static_cast<float>((Place.Z - From.Z) * Unit));
	if (bRotation)
	{
		const FQuat Turned = Seen->GetActorQuat();
		Values.Add(static_cast<float>(Turned.X));
		Values.Add(static_cast<float>(Turned.Y));
		Values.Add(static_cast<float>(Turned.Z));
		Values.Add(static_cast<float>(Turned.W));
	}
}
