// Copyright CONSAC authors. MIT License.
#include "ConsacSensorComponent.h"

#include "ConsacAgentComponent.h"
#include "ConsacLog.h"
#include "GameFramework/Actor.h"

FConsacSpace UConsacSensorComponent::GetSpace() const
{
	return FConsacSpace();
}

FString UConsacSensorComponent::GetFault() const
{
	return FString();
}

void UConsacSensorComponent::Prepare()
{
}

void UConsacSensorComponent::Sense(TArray<float>& Values)
{
	Values.Reset();
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
