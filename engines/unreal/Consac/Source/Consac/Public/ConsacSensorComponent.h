// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "Components/SceneComponent.h"
#include "ConsacTypes.h"
#include "ConsacSensorComponent.generated.h"

/** What an agent sees without a graph: put it on the actor that has a Consac Agent. */
UCLASS(Abstract, ClassGroup=(Consac))
class CONSAC_API UConsacSensorComponent : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Its name among the agent's observations; unique there. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	FName ObservationName;

	/** Looks anew, and gives the numbers. */
	UFUNCTION(BlueprintCallable, Category="Consac|Sensor", meta=(DisplayName="Get Sensor Values"))
	TArray<float> GetSensorValues();

	/** What it can see. */
	virtual FConsacSpace GetSpace() const;

	/** Why it cannot look in this game; empty where it can. A training does not begin with one that cannot. */
	virtual FString GetFault() const;

	/** It is about to look. All sensors of all agents are told so before the first looks: what takes its time elsewhere, on the
	 *  graphics card for instance, begins here. */
	virtual void Prepare();

	/** Looks: writes as many numbers as its space has. */
	virtual void Sense(TArray<float>& Values);

	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;
};
