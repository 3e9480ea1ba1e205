// Copyright CONSAC authors. MIT License.
#include "ConsacSensorComponent.h"

#include "ConsacAgentComponent.h"
#include "ConsacLog.h"
#include "GameFramework/Actor.h"

FConsacSpace UConsacSensorComponent::GetSeenSpace_Implementation() const
{
	return FConsacSpace();
}

void UConsacSensorComponent::Look_Implementation(TArray<float>& Values)
{
	Values.Reset();
}

FConsacSpace UConsacSensorComponent::GetSpace() const
{
	return GetSeenSpace();
}

FConsacSpace UConsacSensorComponent::BeginStack()
{
	FConsacSpace Space = GetSpace();
	PictureChannels = Space.Shape.Num() > 1 ? Space.Shape.Last() : 0;
	if (Stack <= 1)
	{
		return Space;
	}
	const TArray<float> Low = Space.Low;
	const TArray<float> High = Space.High;
	for (int32 Before = 1; Before < Stack; ++Before)
	{
		if (Low.Num() > 1) // one for all stays one for all
		{
			Space.Low.Append(Low);
		}
		if (High.Num() > 1)
		{
			Space.High.Append(High);
		}
	}
	Space.Size *= Stack;
	if (!Space.Shape.IsEmpty())
	{
		Space.Shape.Last() *= Stack;
	}
	return Space;
}

void UConsacSensorComponent::ForgetLooks()
{
	bLooked = false;
}

// No memory is asked for once the first look has been taken.
void UConsacSensorComponent::SenseStacked(TArray<float>& Values)
{
	if (Stack <= 1)
	{
		Sense(Values);
		return;
	}
	Sense(Now);
	const int32 Size = Now.Num();
	const int32 Looks = Stack - 1;
	if (Past.Num() != Looks * Size)
	{
		Past.SetNumUninitialized(Looks * Size);
		bLooked = false;
	}
	if (!bLooked)
	{
		bLooked = true;
		for (int32 Index = 0; Index < Past.Num(); ++Index)
		{
			Past[Index] = Now[Index % Size];
		}
	}
	// A picture's numbers lie point by point: the looks of a point come together, as channels do.
	const int32 Width = PictureChannels > 0 && Size % PictureChannels == 0 ? PictureChannels : Size;
	Values.SetNumUninitialized(Stack * Size);
	int32 To = 0;
	for (int32 From = 0; From < Size; From += Width)
	{
		for (int32 At = 0; At < Stack; ++At)
		{
			const float* Source = At < Looks ? Past.GetData() + At * Size : Now.GetData();
			for (int32 Channel = 0; Channel < Width; ++Channel)
			{
				Values[To++] = Source[From + Channel];
			}
		}
	}
	for (int32 Index = 0; Index < Past.Num(); ++Index)
	{
		Past[Index] = Index + Size < Past.Num() ? Past[Index + Size] : Now[Index + Size - Past.Num()];
	}
}

FString UConsacSensorComponent::GetFault() const
{
	const bool bNumbers = Stack <= 1 || GetSpace().Kind == EConsacSpaceKind::Box;
	return bNumbers ? FString() : FString(TEXT("only numbers (Box) can be stacked; set Stack to 1"));
}

void UConsacSensorComponent::Prepare()
{
}

void UConsacSensorComponent::Sense(TArray<float>& Values)
{
	Look(Values);
}

TArray<float> UConsacSensorComponent::GetSensorValues()
{
	TArray<float> Values;
	Sense(Values);
	return Values;
}

void UConsacSensorComponent::BeginPlay()
{
	Super::BeginPlay();
	AActor* Owner = GetOwner();
	UConsacAgentComponent* Agent = Owner != nullptr ? Owner->FindComponentByClass<UConsacAgentComponent>() : nullptr;
	if (Agent == nullptr)
	{
		ConsacPlugin::LogError(FString::Printf(TEXT("the sensor %s is on an actor without a Consac Agent"), *GetName()));
		return;
	}
	Agent->AddSensor(this);
}

void UConsacSensorComponent::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	const AActor* Owner = GetOwner();
	if (UConsacAgentComponent* Agent = Owner != nullptr ? Owner->FindComponentByClass<UConsacAgentComponent>() : nullptr)
	{
		Agent->RemoveSensor(this);
	}
	Super::EndPlay(EndPlayReason);
}
