// Copyright CONSAC authors. MIT License.
#include "ConsacGridSensorComponent.h"

#include "CollisionQueryParams.h"
#include "CollisionShape.h"
#include "Engine/EngineTypes.h"
#include "Engine/OverlapResult.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"

UConsacGridSensorComponent::UConsacGridSensorComponent()
{
	ObservationName = FName(TEXT("grid"));
}

FConsacSpace UConsacGridSensorComponent::GetSpace() const
{
	FConsacSpace Space;
	const int32 Channels = DetectableTags.IsEmpty() ? 1 : DetectableTags.Num();
	const int64 Size = static_cast<int64>(Rows) * Columns * Channels;
	constexpr int64 Largest = 1 << 24; // of a box
	Space.Size = Size > 0 && Size <= Largest ? static_cast<int32>(Size) : 0;
	for (const int32 Extent : { Rows, Columns, Channels })
	{
		Space.Shape.Add(Extent);
	}
	Space.Low.Add(0.0f);
	Space.High.Add(1.0f);
	return Space;
}

void UConsacGridSensorComponent::Sense(TArray<float>& Values)
{
	Values.Reset();
	const UWorld* World = GetWorld();
	FCollisionQueryParams Parameters;
	Parameters.AddIgnoredActor(GetOwner());
	const FVector Middle = GetComponentLocation();
	const FVector Forward = GetForwardVector();
	const FVector Right = GetRightVector();
	const FQuat Turned = GetComponentQuat();
	const double Half = 0.5 * static_cast<double>(CellSize);
	const FCollisionShape Cell = FCollisionShape::MakeBox(FVector(Half, Half, 0.5 * static_cast<double>(CellHeight)));
	static TArray<FOverlapResult> Found; // of the game thread: no memory is asked for once it is large enough
	for (int32 Row = 0; Row < Rows; ++Row)
	{
		for (int32 Column = 0; Column < Columns; ++Column)
		{
			const double Ahead = (0.5 * (Rows - 1) - Row) * static_cast<double>(CellSize);
			const double Beside = (Column - 0.5 * (Columns - 1)) * static_cast<double>(CellSize);
			const FVector Place(Middle.X + Ahead * Forward.X + Beside * Right.X, Middle.Y + Ahead * Forward.Y + Beside * Right.Y,
				Middle.Z + Ahead * Forward.Z + Beside * Right.Z);
			Found.Reset();
			if (World != nullptr)
			{
				World->OverlapMultiByChannel(Found, Place, Turned, Channel, Cell, Parameters);
			}
			if (DetectableTags.IsEmpty())
			{
				Values.Add(Found.IsEmpty() ? 0.0f : 1.0f);
			}
			for (const FName& Tag : DetectableTags)
			{
				bool bThere = false;
				for (const FOverlapResult& One : Found)
				{
					const AActor* Actor = One.GetActor();
					bThere = bThere || (Actor != nullptr && Actor->ActorHasTag(Tag));
				}
				Values.Add(bThere ? 1.0f : 0.0f);
			}
		}
	}
}
