// Copyright CONSAC authors. MIT License.
#include "ConsacAgentComponent.h"

#include "ConsacConvert.h"
#include "ConsacHerd.h"
#include "ConsacLog.h"
#include "ConsacSensorComponent.h"
#include "ConsacSubsystem.h"
#include "ConsacTrainer.h"
#include "Engine/EngineTypes.h"

namespace ConsacPlugin
{

// A failure of an entry's node, with the entry's name.
static bool EntryAnswer(const consac::Status& Status, FName Name)
{
	if (!Status.ok())
	{
		LogError(FString::Printf(TEXT("entry '%s': %s"), *Name.ToString(), *FromUtf8(Status.message())));
	}
	return Status.ok();
}

static consac::Status NotTrained()
{
	return consac::Status(consac::StatusCode::kFailedPrecondition, "no Consac Trainer drives this agent");
}

}

UConsacAgentComponent::UConsacAgentComponent()
{
	PrimaryComponentTick.bCanEverTick = false;
}

bool UConsacAgentComponent::SetObservationNumbers(FName Name, const TArray<float>& Values)
{
	return ConsacPlugin::EntryAnswer(Herd != nullptr ? Herd->SetObservation(*this, Name, Values.GetData(), Values.Num()) : ConsacPlugin::NotTrained(), Name);
}

bool UConsacAgentComponent::SetObservationNumber(FName Name, float Value)
{
	return ConsacPlugin::EntryAnswer(Herd != nullptr ? Herd->SetObservation(*this, Name, &Value, 1) : ConsacPlugin::NotTrained(), Name);
}

bool UConsacAgentComponent::SetObservationVector(FName Name, FVector Value)
{
	const float Numbers[3] = { static_cast<float>(Value.X), static_cast<float>(Value.Y), static_cast<float>(Value.Z) };
	return ConsacPlugin::EntryAnswer(Herd != nullptr ? Herd->SetObservation(*this, Name, Numbers, 3) : ConsacPlugin::NotTrained(), Name);
}

bool UConsacAgentComponent::SetObservationChoice(FName Name, int32 Choice)
{
	return ConsacPlugin::EntryAnswer(Herd != nullptr ? Herd->SetObservedChoice(*this, Name, Choice) : ConsacPlugin::NotTrained(), Name);
}

void UConsacAgentComponent::AddReward(float Reward)
{
	if (Herd != nullptr)
	{
		Herd->AddReward(*this, Reward);
	}
}

void UConsacAgentComponent::AddGroupReward(float Reward)
{
	const UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this);
	AConsacTrainer* Trainer = Subsystem != nullptr ? Subsystem->GetTrainer() : nullptr;
	if (Group == NAME_None)
	{
		AddReward(Reward);
	}
	else if (Herd != nullptr && Trainer != nullptr)
	{
		Trainer->AddGroupReward(Group, Reward); // where nobody learns, others of the group may be in another herd
	}
}

float UConsacAgentComponent::GetEnvironmentParameter(FName Name) const
{
	consac::Result<double> Value = ConsacPlugin::NotTrained();
	const UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this);
	const AConsacTrainer* Trainer = Subsystem != nullptr ? Subsystem->GetTrainer() : nullptr;
	if (Herd != nullptr)
	{
		Value = Herd->GetParameter(*this, Name);
	}
	else if (Trainer != nullptr)
	{
		Value = ConsacPlugin::DefaultOf(Trainer->EnvironmentParameters, Name);
	}
	return ConsacPlugin::ValueOrLog(Name, Value);
}

void UConsacAgentComponent::EndEpisode(EConsacEpisodeEnd End)
{
	if (Herd != nullptr)
	{
		Herd->EndEpisode(*this, End == EConsacEpisodeEnd::Truncated ? consac::host::EpisodeEnd::kTruncated : consac::host::EpisodeEnd::kTerminated);
	}
}

TArray<float> UConsacAgentComponent::GetActionNumbers(FName Name) const
{
	TArray<float> Values;
	if (Herd != nullptr)
	{
		Herd->GetAction(*this, Name, Values);
	}
	return Values;
}

float UConsacAgentComponent::GetActionNumber(FName Name, int32 Index) const
{
	return Herd != nullptr ? Herd->GetActionNumber(*this, Name, Index, 0.0f) : 0.0f;
}

int32 UConsacAgentComponent::GetActionChoice(FName Name) const
{
	return Herd != nullptr ? static_cast<int32>(Herd->GetActionNumber(*this, Name, 0, -1.0f)) : -1;
}

bool UConsacAgentComponent::SetActionNumbers(FName Name, const TArray<float>& Values)
{
	return ConsacPlugin::EntryAnswer(Herd != nullptr ? Herd->SetAction(*this, Name, Values.GetData(), Values.Num()) : ConsacPlugin::NotTrained(), Name);
}

bool UConsacAgentComponent::SetActionChoice(FName Name, int32 Choice)
{
	return ConsacPlugin::EntryAnswer(Herd != nullptr ? Herd->SetActionChoice(*this, Name, Choice) : ConsacPlugin::NotTrained(), Name);
}

bool UConsacAgentComponent::SetChoiceAllowed(FName Name, int32 Choice, bool bAllowed)
{
	return Herd != nullptr && Herd->SetAllowed(*this, Name, Choice, bAllowed);
}

float UConsacAgentComponent::GetEpisodeReward() const
{
	return EpisodeReward;
}

int64 UConsacAgentComponent::GetEpisodeSteps() const
{
	return EpisodeSteps;
}

void UConsacAgentComponent::AddSensor(UConsacSensorComponent* Sensor)
{
	Sensors.AddUnique(Sensor);
}

void UConsacAgentComponent::RemoveSensor(UConsacSensorComponent* Sensor)
{
	Sensors.Remove(Sensor);
}

const TArray<TObjectPtr<UConsacSensorComponent>>& UConsacAgentComponent::GetSensors() const
{
	return Sensors;
}

void UConsacAgentComponent::BeginPlay()
{
	Super::BeginPlay();
	if (UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this))
	{
		Subsystem->AddAgent(this);
	}
}

void UConsacAgentComponent::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	if (Herd != nullptr)
	{
		if (EndPlayReason == EEndPlayReason::Destroyed || EndPlayReason == EEndPlayReason::RemovedFromWorld)
		{
			Herd->SayThatItLeaves(*this);
		}
		Herd->Leave(*this);
	}
	if (UConsacSubsystem* Subsystem = UConsacSubsystem::Of(this))
	{
		Subsystem->RemoveAgent(this);
	}
	Sensors.Reset();
	Super::EndPlay(EndPlayReason);
}
