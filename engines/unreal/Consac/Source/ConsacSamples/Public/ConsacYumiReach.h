// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"
#include "UObject/ObjectPtr.h"
#include "ConsacYumiReach.generated.h"

class UConsacAgentComponent;
class UConsacTwinComponent;
class UConsacYumiReachComponent;
class UStaticMeshComponent;

/** A robot's arm that learns to bring its tool to a point, or does so by a model of yumi-reach-v0. Shown by cubes, unless Robot has a twin of YuMi. */
UCLASS(Blueprintable, ClassGroup=(Consac), meta=(DisplayName="Consac YuMi Reach"))
class CONSACSAMPLES_API AConsacYumiReach : public AActor
{
	GENERATED_BODY()

public:
	AConsacYumiReach();

	/** What is seen of the arm. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Twin")
	TObjectPtr<UConsacTwinComponent> Robot;

	/** What it sees and does. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Twin")
	TObjectPtr<UConsacAgentComponent> Agent;

	/** Its task. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Twin")
	TObjectPtr<UConsacYumiReachComponent> Task;

	virtual void BeginPlay() override;

private:
	UFUNCTION()
	void Restart(UConsacAgentComponent* Which, int64 EpisodeSeed);

	UFUNCTION()
	void Observe(UConsacAgentComponent* Which);

	UFUNCTION()
	void Reach(UConsacAgentComponent* Which);

	UPROPERTY()
	TObjectPtr<UStaticMeshComponent> GoalMesh;

	bool bBound = false; // to its agent's events
};
