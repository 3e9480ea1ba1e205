// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Containers/Ticker.h"
#include "Subsystems/GameInstanceSubsystem.h"
#include "UObject/Object.h"
#include "UObject/ObjectPtr.h"
#include "ConsacSubsystem.generated.h"

class AConsacTrainer;
class UConsacAgentComponent;
class UConsacWaitMessageAction;

/** Knows every agent and every trainer of a running game, and what waits for a message. One for each game. */
UCLASS()
class CONSAC_API UConsacSubsystem : public UGameInstanceSubsystem
{
	GENERATED_BODY()

public:
	/** The subsystem of an object's game; null where it belongs to none. */
	static UConsacSubsystem* Of(const UObject* WorldContextObject);

	/** Agents that play now. */
	UFUNCTION(BlueprintPure, Category="Consac|Training", meta=(DisplayName="Get Consac Agents"))
	TArray<UConsacAgentComponent*> GetAgents() const;

	/** The trainer that plays now; none when there is none. */
	UFUNCTION(BlueprintPure, Category="Consac|Training", meta=(DisplayName="Get Consac Trainer"))
	AConsacTrainer* GetTrainer() const;

	void AddAgent(UConsacAgentComponent* Agent);
	void RemoveAgent(UConsacAgentComponent* Agent);
	/** False when another trainer of the same world plays already. */
	bool AddTrainer(AConsacTrainer* NewTrainer);
	void RemoveTrainer(AConsacTrainer* OldTrainer);
	void AddWaiting(UConsacWaitMessageAction* Action);

	virtual void Initialize(FSubsystemCollectionBase& Collection) override;
	virtual void Deinitialize() override;

private:
	bool Look(float DeltaSeconds);

	UPROPERTY()
	TArray<TObjectPtr<UConsacAgentComponent>> Agents;

	UPROPERTY()
	TArray<TObjectPtr<UConsacWaitMessageAction>> Waiting;

	UPROPERTY()
	TObjectPtr<AConsacTrainer> Trainer;

	FTSTicker::FDelegateHandle Ticker;
};
