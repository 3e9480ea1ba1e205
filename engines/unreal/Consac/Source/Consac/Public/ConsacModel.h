// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTypes.h"
#include "Templates/PimplPtr.h"
#include "UObject/Object.h"
#include "UObject/ObjectPtr.h"
#include "ConsacModel.generated.h"

class UAssetImportData;
struct FConsacModelState;

/** A trained model that acts in the game: no network, no other program. An asset, by dragging a .consac file into the Content Browser, which is
 *  packed with the game; or made by Load Model. */
UCLASS(BlueprintType, HideCategories=(Object))
class CONSAC_API UConsacModel : public UObject
{
	GENERATED_BODY()

public:
	UConsacModel();

	/** The kind of agent that it was trained for. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	FString Behaviour;

	/** What it sees, an entry each, in the order that Predict takes. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Model")
	TArray<FString> Sees;

	/** What it does, likewise. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, Category="Consac|Model")
	TArray<FString> Does;

	/** Numbers in one observation. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	int32 ObservationSize = 0;

	/** Numbers in one action. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	int32 ActionSize = 0;

	/** Which algorithm made it; empty where its file does not say. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	FString Algorithm;

	/** Steps of single agents that it learned from; 0 where its file does not say. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	int64 TrainedSteps = 0;

	/** Parameters of its network. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	int64 Parameters = 0;

	/** Whether it remembers what it saw before. */
	UPROPERTY(VisibleAnywhere, BlueprintReadOnly, AssetRegistrySearchable, Category="Consac|Model")
	bool bRemembers = false;

#if WITH_EDITORONLY_DATA
	/** The file that it was imported from. */
	UPROPERTY(VisibleAnywhere, Instanced, Category="Consac|File")
	TObjectPtr<UAssetImportData> AssetImportData;
#endif

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
	 *  Predict Many have a memory of their own, row by row. An asset is one model for all who use it: agents that ask it one by one, and
	 *  not by a Consac Trainer, have a row each of Predict Many.
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

	/** For the plugin's own code: becomes the model that another object has loaded, which has none any more. */
	void TakeOver(UConsacModel& Loaded);

	/** For the plugin's own code: what the file holds, read when it is first asked for; null without one, or when it is damaged, which the
	 *  log says. */
	FConsacModelState* GetState() const;

	/** For the plugin's own code: the .consac file as it is; empty without one. */
	const TArray<uint8>& GetFile() const;

	virtual void BeginDestroy() override;

private:
	void Describe();

	UPROPERTY()
	TArray<uint8> File;

	TPimplPtr<FConsacModelState> State;
};
