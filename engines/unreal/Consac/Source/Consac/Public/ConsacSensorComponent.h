// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "Components/SceneComponent.h"
#include "ConsacTypes.h"
#include "ConsacSensorComponent.generated.h"

/** What an agent sees without a graph: put it on the actor that has a Consac Agent. For one of your own make a Blueprint class of this and
 *  override Get Seen Space and Look. */
UCLASS(Abstract, Blueprintable, ClassGroup=(Consac), meta=(BlueprintSpawnableComponent))
class CONSAC_API UConsacSensorComponent : public USceneComponent
{
	GENERATED_BODY()

public:
	/** Its name among the agent's observations; unique there. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor")
	FName ObservationName;

	/** How many looks the agent sees at once: this one and those before, the oldest first; at the beginning of an episode the first look
	 *  stands for those that there were not. A list of numbers is as many times longer, a picture has as many times more channels. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Sensor", meta=(ClampMin="1", ClampMax="64"))
	int32 Stack = 1;

	/** Looks anew, and gives the numbers, without those of before. */
	UFUNCTION(BlueprintCallable, Category="Consac|Sensor", meta=(DisplayName="Get Sensor Values"))
	TArray<float> GetSensorValues();

	/** For a Blueprint's own sensor: what it can see. Asked when the training begins, and for each agent that comes. */
	UFUNCTION(BlueprintNativeEvent, Category="Consac|Sensor", meta=(DisplayName="Get Seen Space"))
	FConsacSpace GetSeenSpace() const;

	/** For a Blueprint's own sensor: looks. As many numbers as Get Seen Space has; a choice is one. */
	UFUNCTION(BlueprintNativeEvent, Category="Consac|Sensor", meta=(DisplayName="Look"))
	void Look(TArray<float>& Values);

	/** What it can see. In C++ this is what to override, and costs no call of Blueprint's machine. */
	virtual FConsacSpace GetSpace() const;

	/** Why it cannot look in this game; empty where it can. A training does not begin with one that cannot. */
	virtual FString GetFault() const;

	/** It is about to look. All sensors of all agents are told so before the first looks: what takes its time elsewhere, on the
	 *  graphics card for instance, begins here. */
	virtual void Prepare();

	/** Looks: writes as many numbers as its space has. */
	virtual void Sense(TArray<float>& Values);

	/** For the plugin's own code: notes whether this is a picture, by which looks are stacked, and gives what an agent sees of it, with its looks of before. */
	FConsacSpace BeginStack();

	/** For the plugin's own code: looks, and gives this and the looks of before. */
	void SenseStacked(TArray<float>& Values);

	/** For the plugin's own code: an episode begins, and what was seen before is forgotten. */
	void ForgetLooks();

	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;

private:
	TArray<float> Past; // the latest looks, oldest first, without the one that is being taken
	TArray<float> Now;
	bool bLooked = false; // in this episode
	int32 PictureChannels = 0; // of one look; 0: a list of numbers
};
