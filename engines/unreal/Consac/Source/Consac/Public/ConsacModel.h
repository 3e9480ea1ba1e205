// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "Templates/PimplPtr.h"
#include "UObject/Object.h"
#include "ConsacModel.generated.h"

struct FConsacModelState;

/** A trained model that acts in the game: no network, no other program. Load Model makes it. */
UCLASS(BlueprintType)
class CONSAC_API UConsacModel : public UObject
{
	GENERATED_BODY()

public:
	UConsacModel();

	/** The action for one observation. Fails when the observation has another number of values than the model wants.
	 *  @param Observation The numbers of all entries, one entry after the other in the alphabet's order of their names, whatever their order in
	 *  Observations and Sensors; Describe Model lists them. Predict By Names takes them in any order.
	 *  @param bDeterministic The best action; otherwise one drawn as the training did. */
	UFUNCTION(BlueprintCallable, Category="Consac|Model", meta=(DisplayName="Predict", ExpandEnumAsExecs="Result"))
	void Predict(const TArray<float>& Observation, bool bDeterministic, EConsacResult& Result, FConsacAction& Action, FString& Error);

	/** The same by the names of the entries, in any order. Fails when one is missing, is there twice, is unknown, or has another number of
	 *  values. An entry that is alone has no name in a model: it may have any, and an action that is alone is called action.
	 *  @param Actions An entry each, in the alphabet's order of their names. */
	UFUNCTION(BlueprintCallable, Category="Consac|Model", meta=(DisplayName="Predict By Names", ExpandEnumAsExecs="Result"))
	void PredictByNames(const TArray<FConsacNumbers>& Observations, bool bDeterministic, EConsacResult& Result, TArray<FConsacNumbers>& Actions, FString& Error);

	/** The actions for many observations in one go.
	 *  @param Observations One after the other, Get Observation Size numbers each, in the order that Predict takes.
	 *  @param Actions One after the other, Get Action Size numbers each. */
	UFUNCTION(BlueprintCallable, Category="Consac|Model", meta=(DisplayName="Predict Many", ExpandEnumAsExecs="Result"))
	void PredictMany(const TArray<float>& Observations, bool bDeterministic, EConsacResult& Result, TArray<float>& Actions, FString& Error);

	/** Only for models that remember: an agent's episode begins, and what the model remembers of it is forgotten. Predict and each row of
	 *  Predict Many have a memory of their own, row by row.
	 *  @param Agent The row, from 0, which is Predict's too; -1 for all of them. */
	UFUNCTION(BlueprintCallable, Category="Consac|Model", meta=(DisplayName="Begin Model Episode"))
	void BeginModelEpisode(int32 Agent = -1);

	/** Fails with the first difference when the model was trained for other spaces. */
	UFUNCTION(BlueprintCallable, Category="Consac|Model", meta=(DisplayName="Check Model Spaces", ExpandEnumAsExecs="Result"))
	void CheckModelSpaces(const FConsacSpace& ObservationSpace, const FConsacSpace& ActionSpace, EConsacResult& Result, FString& Error);

	/** Numbers in one observation; 0 without a model. */
	UFUNCTION(BlueprintPure, Category="Consac|Model", meta=(DisplayName="Get Observation Size"))
	int32 GetObservationSize() const;

	/** Numbers in one action; 0 without a model. */
	UFUNCTION(BlueprintPure, Category="Consac|Model", meta=(DisplayName="Get Action Size"))
	int32 GetActionSize() const;

	/** The behaviour, the spaces with their entries in the order that Predict takes, and how many parameters the network has, in a line. */
	UFUNCTION(BlueprintPure, Category="Consac|Model", meta=(DisplayName="Describe Model"))
	FString DescribeModel() const;

	/** Reads a file and lets the model test itself; false and Error when it is none, damaged, or fails its own test. */
	bool Load(const FString& Path, FString& Error);

	/** What was loaded; for the plugin's own code. */
	FConsacModelState* GetState() const;

	virtual void BeginDestroy() override;

private:
	TPimplPtr<FConsacModelState> State;
};
