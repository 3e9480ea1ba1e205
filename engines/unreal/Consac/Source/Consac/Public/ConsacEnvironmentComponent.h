// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "ConsacTypes.h"
#include "Templates/PimplPtr.h"
#include "ConsacEnvironmentComponent.generated.h"

class UConsacModel;
struct FConsacEnvironmentState;

DECLARE_DYNAMIC_MULTICAST_DELEGATE(FConsacTrainingCompletedEvent);

/** An environment with one agent, drawn as a graph: Begin Play -> Setup Environment; Tick -> Training Connection ->
 *  Training -> Step or Reset. For many agents see Consac Agent and Consac Trainer. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Environment"))
class CONSAC_API UConsacEnvironmentComponent : public UActorComponent
{
	GENERATED_BODY()

public:
	UConsacEnvironmentComponent();

	/** How long Training may wait for an answer, in seconds. 0: never, for one call in each tick. Above 0: for calls in
	 *  a loop within one tick; the game stands still meanwhile. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Environment", meta=(ClampMin="0", ClampMax="60"))
	float LoopWaitSeconds = 0.0f;

	/** While somebody trains, frames follow each other as fast as the computer can: no frame limit, no vertical synchronisation,
	 *  and the editor does not slow down in the background. All settings that this changes are put back at the end, and while
	 *  the game is paused, but for those that somebody else has changed meanwhile. A dedicated server keeps its own rate. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Environment")
	bool bFullSpeed = true;

	/** Numbers of this world that who trains may set, and vary from episode to episode; as they are when Setup Environment is called. Read by Get Training Parameter where
	 *  Training says Reset. Over text protocol 1 all are at their Default. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Environment", meta=(TitleProperty="Name"))
	TArray<FConsacParameter> EnvironmentParameters;

	/** The training has come to its end, and its port is closed. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Environment")
	FConsacTrainingCompletedEvent OnTrainingCompleted;

	/** Says what can be seen and done, how long to train, and where a trainer may connect. Ends what was under way; where it fails, that
	 *  goes on.
	 *  @param TrainingLength Steps; 0 together with a model name: the trainer only acts by that model; 0 without: the trainer decides.
	 *  @param Port The port; 0 for any that is free. */
	UFUNCTION(BlueprintCallable, Category="Consac|Environment",
		meta=(DisplayName="Setup Environment", ExpandEnumAsExecs="Result", AdvancedDisplay="Host,Port"))
	void SetupEnvironment(const FConsacSpace& ObservationSpace, const FConsacSpace& ActionSpace, int64 TrainingLength, const FString& ModelName,
		EConsacResult& Result, FString& Error, const FString& Host = TEXT("127.0.0.1"), int32 Port = 5005);

	/** Opens the port at the first call and sees whether a trainer is there. To be called in every tick. Fails on a client of a
	 *  network game: its server trains. */
	UFUNCTION(BlueprintCallable, Category="Consac|Environment", meta=(DisplayName="Training Connection", ExpandEnumAsExecs="Connection"))
	void TrainingConnection(EConsacConnection& Connection, FString& Error);

	/** Hands over what came of the latest action, or the first observation after a reset, and gets the next action.
	 *  @param Reward Of the latest action; not looked at after a reset.
	 *  @param bDone The episode ended; not looked at after a reset. */
	UFUNCTION(BlueprintCallable, Category="Consac|Environment", meta=(DisplayName="Training", ExpandEnumAsExecs="Training"))
	void Train(const TArray<float>& Observation, float Reward, bool bDone, EConsacTraining& Training, FConsacAction& Action, FString& Error);

	/** What the episode has of one of the Environment Parameters, or, where Training has said Reset, the one that begins. 0, and a line in the log, when there is no such
	 *  parameter. */
	UFUNCTION(BlueprintPure, Category="Consac|Environment", meta=(DisplayName="Get Training Parameter"))
	float GetTrainingParameter(FName Name) const;

	/** A number of the game's own: a trainer that speaks protocol 2 has the mean as game/NAME in its table, in progress.csv and in TensorBoard. The name in lower case. Nothing
	 *  before Setup Environment. */
	UFUNCTION(BlueprintCallable, Category="Consac|Environment", meta=(DisplayName="Record Training Stat"))
	void RecordTrainingStat(FName Name, float Value);

	/** Whether the training has come to its end. */
	UFUNCTION(BlueprintPure, Category="Consac|Environment", meta=(DisplayName="Training Completed"))
	bool IsTrainingCompleted() const;

	/** From now on a model chooses the actions, in the same graph: Training Connection is Connected, Training asks the
	 *  model. No network, no other program. Fails when the model was trained for other spaces; what was under way goes on then, and where nothing
	 *  was, Training Connection opens the port. */
	UFUNCTION(BlueprintCallable, Category="Consac|Environment", meta=(DisplayName="Model Connection", ExpandEnumAsExecs="Result"))
	void ModelConnection(UConsacModel* Model, EConsacResult& Result, FString& Error);

	/** Ends what is under way and closes the port; Training Connection begins anew. What is completed stays so until Setup
	 *  Environment or Model Connection. Stopping the game does the same. */
	UFUNCTION(BlueprintCallable, Category="Consac|Environment", meta=(DisplayName="Close Training"))
	void CloseTraining();

	/** How it stands. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Environment", meta=(DisplayName="Get Training Progress"))
	FConsacProgress GetTrainingProgress() const;

	/** The port that is open; 0 when none is. */
	UFUNCTION(BlueprintPure, Category="Consac|Environment", meta=(DisplayName="Get Training Port"))
	int32 GetTrainingPort() const;

	virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction) override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;
	virtual void BeginDestroy() override;

private:
	void Complete();

	TPimplPtr<FConsacEnvironmentState> State;
};
