// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "ConsacTrainerProgram.h"
#include "ConsacTypes.h"
#include "Kismet/BlueprintFunctionLibrary.h"
#include "ConsacBlueprintLibrary.generated.h"

class UConsacModel;
class UConsacSocket;

/** The nodes that belong to no object. */
UCLASS()
class CONSAC_API UConsacBlueprintLibrary : public UBlueprintFunctionLibrary
{
	GENERATED_BODY()

public:
	/** A socket; Open Socket opens it.
	 *  @param Host The address to listen on: 127.0.0.1 for trainers on this computer only.
	 *  @param Port The port; 0 for any that is free. */
	UFUNCTION(BlueprintCallable, Category="Consac|Socket", meta=(WorldContext="WorldContextObject", DisplayName="Create Socket"))
	static UConsacSocket* CreateConsacSocket(UObject* WorldContextObject, const FString& Host = TEXT("127.0.0.1"), int32 Port = 5005);

	/** What an agent sees, the reward of its latest action, and whether its episode ended, as a message. Fails when the
	 *  observation does not fit its space. */
	UFUNCTION(BlueprintCallable, Category="Consac|Message", meta=(DisplayName="Compile Environment Message", ExpandEnumAsExecs="Result"))
	static void CompileEnvironmentMessage(const FConsacSpace& ObservationSpace, const TArray<float>& Observation, float Reward, bool bDone,
		EConsacResult& Result, FString& Message, FString& Error);

	/** The first message to a trainer: what can be done and seen, how long to train, which model to use.
	 *  @param TrainingLength Steps; 0 together with a model name: only act. */
	UFUNCTION(BlueprintCallable, Category="Consac|Message", meta=(DisplayName="Compile Training Data", ExpandEnumAsExecs="Result"))
	static void CompileTrainingData(const FConsacSpace& ActionSpace, const FConsacSpace& ObservationSpace, int64 TrainingLength,
		const FString& ModelName, EConsacResult& Result, FString& Message, FString& Error);

	/** The action in a trainer's message. Fails when it does not fit the action space. */
	UFUNCTION(BlueprintCallable, Category="Consac|Message", meta=(DisplayName="Decode Action", ExpandEnumAsExecs="Result"))
	static void DecodeAction(const FConsacSpace& ActionSpace, const FString& Message, EConsacResult& Result, FConsacAction& Action, FString& Error);

	/** A trained model from a .consac file; a relative path is one below Saved/Consac of the project. The model tests itself;
	 *  one that fails, or is damaged, is refused. */
	UFUNCTION(BlueprintCallable, Category="Consac|Model",
		meta=(WorldContext="WorldContextObject", DisplayName="Load Model", ExpandEnumAsExecs="Result"))
	static void LoadConsacModel(UObject* WorldContextObject, const FString& Path, EConsacResult& Result, UConsacModel*& Model, FString& Error);

	/** Starts the program consac, which trains the environment that listens on Host and Port. */
	UFUNCTION(BlueprintCallable, Category="Consac|Program",
		meta=(WorldContext="WorldContextObject", DisplayName="Start Trainer Program", ExpandEnumAsExecs="Result", AutoCreateRefTerm="Settings"))
	static void StartTrainerProgram(UObject* WorldContextObject, const FConsacProgramSettings& Settings, EConsacResult& Result,
		UConsacTrainerProgram*& Program, FString& Error);

	/** A number of the game's own, goals in a match for instance: the mean of those since the line before is in the lines that the Consac Trainer
	 *  writes into the log, and a trainer elsewhere that speaks protocol 2 has it as game/NAME in its table, in progress.csv and in TensorBoard. Nothing where no training
	 *  has begun. The name in lower case; one of more than a line, or a number that is not finite, is refused, with a line in the log. */
	UFUNCTION(BlueprintCallable, Category="Consac|Training", meta=(WorldContext="WorldContextObject", DisplayName="Consac Record Stat"))
	static void RecordStat(UObject* WorldContextObject, FName Name, float Value);

	/** Adds to the reward of every agent whose Group this is, as their Add Reward does: for whoever judges a team, a game mode for instance. */
	UFUNCTION(BlueprintCallable, Category="Consac|Training", meta=(WorldContext="WorldContextObject", DisplayName="Consac Add Group Reward"))
	static void AddGroupReward(UObject* WorldContextObject, FName Group, float Reward);

	/** A space of Size numbers between Low and High. */
	UFUNCTION(BlueprintPure, Category="Consac|Space", meta=(DisplayName="Make Box Space"))
	static FConsacSpace MakeBoxSpace(int32 Size = 1, float Low = -1.0f, float High = 1.0f);

	/** A space of choices: 0, 1, ... up to one less than Choices. */
	UFUNCTION(BlueprintPure, Category="Consac|Space", meta=(DisplayName="Make Discrete Space"))
	static FConsacSpace MakeDiscreteSpace(int32 Choices = 2);

	/** For automation tests: an error that came less than a second ago is written to the log again. No node. */
	static void ForgetErrors();
};
