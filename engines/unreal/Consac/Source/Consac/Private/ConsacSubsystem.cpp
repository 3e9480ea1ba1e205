// Copyright CONSAC authors. MIT License.
#include "ConsacSubsystem.h"

#include "ConsacAgentComponent.h"
#include "ConsacLog.h"
#include "ConsacTrainer.h"
#include "ConsacWaitMessageAction.h"
#include "Containers/Ticker.h"
#include "Engine/Engine.h"
#include "Engine/GameInstance.h"
#include "Engine/World.h"
#include "Logging/LogMacros.h"
#include "UObject/UObjectGlobals.h"

UConsacSubsystem* UConsacSubsystem::Of(const UObject* WorldContextObject)
{
	const UWorld* World = GEngine != nullptr && WorldContextObject != nullptr
		? GEngine->GetWorldFromContextObject(WorldContextObject, EGetWorldErrorMode::LogAndReturnNull) : nullptr;
	const UGameInstance* Game = World != nullptr ? World->GetGameInstance() : nullptr;
	return Game != nullptr ? Game->GetSubsystem<UConsacSubsystem>() : nullptr;
}

TArray<UConsacAgentComponent*> UConsacSubsystem::GetAgents() const
{
	TArray<UConsacAgentComponent*> Playing;
	for (UConsacAgentComponent* Agent : Agents)
	{
		if (IsValid(Agent))
		{
			Playing.Add(Agent);
		}
	}
	return Playing;
}

AConsacTrainer* UConsacSubsystem::GetTrainer() const
{
	return Trainer.Get();
}

void UConsacSubsystem::AddAgent(UConsacAgentComponent* Agent)
{
	Agents.AddUnique(Agent);
	if (IsValid(Trainer.Get()))
	{
		Trainer->AgentCame(Agent);
	}
}

void UConsacSubsystem::RemoveAgent(UConsacAgentComponent* Agent)
{
	Agents.Remove(Agent);
}

bool UConsacSubsystem::AddTrainer(AConsacTrainer* NewTrainer)
{
	if (IsValid(Trainer.Get()) && Trainer.Get() != NewTrainer)
	{
		return false;
	}
	Trainer = NewTrainer;
	return true;
}

void UConsacSubsystem::RemoveTrainer(AConsacTrainer* OldTrainer)
{
	if (Trainer.Get() == OldTrainer)
	{
		Trainer = nullptr;
	}
}

void UConsacSubsystem::AddWaiting(UConsacWaitMessageAction* Action)
{
	Waiting.Add(Action);
}

bool UConsacSubsystem::Look(float DeltaSeconds)
{
	// What an event starts waiting is looked at in the next frame.
	const TArray<TObjectPtr<UConsacWaitMessageAction>> Now = MoveTemp(Waiting);
	Waiting.Reset();
	for (UConsacWaitMessageAction* Action : Now)
	{
		if (IsValid(Action) && !Action->Look(DeltaSeconds))
		{
			Waiting.Add(Action);
		}
	}
	return true;
}

void UConsacSubsystem::Initialize(FSubsystemCollectionBase& Collection)
{
	Super::Initialize(Collection);
	Ticker = FTSTicker::GetCoreTicker().AddTicker(FTickerDelegate::CreateUObject(this, &UConsacSubsystem::Look), 0.0f);
}

void UConsacSubsystem::Deinitialize()
{
	FTSTicker::GetCoreTicker().RemoveTicker(Ticker);
	for (UConsacWaitMessageAction* Action : Waiting)
	{
		if (IsValid(Action))
		{
			Action->SetReadyToDestroy();
		}
	}
	Waiting.Reset();
	Agents.Reset();
	Trainer = nullptr;
	Super::Deinitialize();
}
