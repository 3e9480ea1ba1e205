// Copyright CONSAC authors. MIT License.
#include "ConsacSubsystem.h"

#include "ConsacAgentComponent.h"
#include "ConsacTrainer.h"
#include "ConsacWaitMessageAction.h"
#include "Containers/Ticker.h"
#include "Engine/Engine.h"
#include "Engine/World.h"
#include "UObject/UObjectGlobals.h"

UConsacSubsystem* UConsacSubsystem::Of(const UObject* WorldContextObject)
{
	const UWorld* World = GEngine != nullptr && WorldContextObject != nullptr
		? GEngine->GetWorldFromContextObject(WorldContextObject, EGetWorldErrorMode::LogAndReturnNull) : nullptr;
	return World != nullptr ? World->GetSubsystem<UConsacSubsystem>() : nullptr;
}

TArray<UConsacAgentComponent*> UConsacSubsystem::GetAgents() const
{
	TArray<UConsacAgentComponent*> Playing;
	for (const TWeakObjectPtr<UConsacAgentComponent>& Agent : Agents)
	{
		if (IsValid(Agent.Get()))
		{
			Playing.Add(Agent.Get());
		}
	}
	return Playing;
}

AConsacTrainer* UConsacSubsystem::GetTrainer() const
{
	for (const TWeakObjectPtr<AConsacTrainer>& Trainer : Trainers)
	{
		if (IsValid(Trainer.Get()))
		{
			return Trainer.Get();
		}
	}
	return nullptr;
}

void UConsacSubsystem::AddAgent(UConsacAgentComponent* Agent)
{
	Agents.AddUnique(Agent);
	if (AConsacTrainer* Trainer = GetTrainer())
	{
		Trainer->AgentCame(Agent);
	}
}

void UConsacSubsystem::RemoveAgent(UConsacAgentComponent* Agent)
{
	Agents.Remove(Agent);
}

void UConsacSubsystem::AddTrainer(AConsacTrainer* NewTrainer)
{
	Trainers.AddUnique(NewTrainer);
}

void UConsacSubsystem::RemoveTrainer(AConsacTrainer* OldTrainer)
{
	Trainers.Remove(OldTrainer);
}

void UConsacSubsystem::AddWaiting(UConsacWaitMessageAction* Action)
{
	if (bEnds)
	{
		Action->SetReadyToDestroy(); // without a pin: a graph that tries again on failure would do so for ever
		return;
	}
	Waiting.Add(Action);
}

bool UConsacSubsystem::Look(float DeltaSeconds)
{
	// What an event starts waiting is looked at in the next frame.
	const TArray<TWeakObjectPtr<UConsacWaitMessageAction>> Now = MoveTemp(Waiting);
	Waiting.Reset();
	for (const TWeakObjectPtr<UConsacWaitMessageAction>& Action : Now)
	{
		if (IsValid(Action.Get()) && !Action->Look(DeltaSeconds))
		{
			Waiting.Add(Action);
		}
	}
	return true;
}

bool UConsacSubsystem::DoesSupportWorldType(const EWorldType::Type WorldType) const
{
	return WorldType == EWorldType::Game || WorldType == EWorldType::PIE;
}

void UConsacSubsystem::Initialize(FSubsystemCollectionBase& Collection)
{
	Super::Initialize(Collection);
	Ticker = FTSTicker::GetCoreTicker().AddTicker(FTickerDelegate::CreateUObject(this, &UConsacSubsystem::Look), 0.0f);
}

void UConsacSubsystem::Deinitialize()
{
	FTSTicker::GetCoreTicker().RemoveTicker(Ticker);
	const TArray<TWeakObjectPtr<UConsacWaitMessageAction>> Last = MoveTemp(Waiting);
	Waiting.Reset();
	bEnds = true;
	for (const TWeakObjectPtr<UConsacWaitMessageAction>& Action : Last)
	{
		if (IsValid(Action.Get()))
		{
			Action->GiveUp();
		}
	}
	Agents.Reset();
	Trainers.Reset();
	Super::Deinitialize();
}
