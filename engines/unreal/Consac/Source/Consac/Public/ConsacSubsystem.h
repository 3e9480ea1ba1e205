// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Containers/Ticker.h"
#include "Engine/EngineTypes.h"
#include "Subsystems/WorldSubsystem.h"
#include "UObject/Object.h"
#include "UObject/WeakObjectPtrTemplates.h"
#include "ConsacSubsystem.generated.h"

class AConsacTrainer;
class UConsacAgentComponent;
class UConsacWaitMessageAction;

/** Knows every agent and every trainer of a running world, and what waits for a message there. One for each world; it keeps
 *  none of them alive. */
UCLASS()
class CONSAC_API UConsacSubsystem : public UWorldSubsystem
{
	GENERATED_BODY()

public:
	/** The subsystem of an object's world; null where it belongs to none that runs. */
	static UConsacSubsystem* Of(const UObject* WorldContextObject);

	/** Agents that play now. */
	UFUNCTION(BlueprintPure, Category="Consac|Training", meta=(DisplayName="Get Consac Agents"))
	TArray<UConsacAgentComponent*> GetAgents() const;

	/** The trainer whose turn it is: the first that came of those that play now; none when there is none. */
	UFUNCTION(BlueprintPure, Category="Consac|Training", meta=(DisplayName="Get Consac Trainer"))
	AConsacTrainer* GetTrainer() const;

	void AddAgent(UConsacAgentComponent* Agent);
	void RemoveAgent(UConsacAgentComponent* Agent);
	/** It waits for its turn, which comes when those before it have gone. */
	void AddTrainer(AConsacTrainer* NewTrainer);
	void RemoveTrainer(AConsacTrainer* OldTrainer);
	/** Looked at in every frame until it is done; what has a game keeps itself alive. */
	void AddWaiting(UConsacWaitMessageAction* Action);

	virtual void Initialize(FSubsystemCollectionBase& Collection) override;
	virtual void Deinitialize() override;

protected:
	virtual bool DoesSupportWorldType(const EWorldType::Type WorldType) const override;

private:
	bool Look(float DeltaSeconds);

	TArray<TWeakObjectPtr<UConsacAgentComponent>> Agents;
	TArray<TWeakObjectPtr<AConsacTrainer>> Trainers;
	TArray<TWeakObjectPtr<UConsacWaitMessageAction>> Waiting;
	FTSTicker::FDelegateHandle Ticker;
	bool bEnds = false; // the world goes
};
