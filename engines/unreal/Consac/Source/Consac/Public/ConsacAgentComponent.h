// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "ConsacTypes.h"
#include "UObject/ObjectPtr.h"
#include "ConsacAgentComponent.generated.h"

class FConsacHerd;
class UConsacAgentComponent;
class UConsacSensorComponent;

DECLARE_DYNAMIC_MULTICAST_DELEGATE_OneParam(FConsacAgentEvent, UConsacAgentComponent*, Agent);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FConsacEpisodeEvent, UConsacAgentComponent*, Agent, int64, Seed);

/** One of many agents of a world. All agents with a Behaviour of the same name learn one model together. A Consac
 *  Trainer in the same world drives them. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac Agent"))
class CONSAC_API UConsacAgentComponent : public UActorComponent
{
	GENERATED_BODY()

public:
	UConsacAgentComponent();

	/** What kind of agent it is: agents of one name share their observations, their actions and their model. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	FString Behaviour = TEXT("default");

	/** What it sees; its sensors come after these. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent", meta=(TitleProperty="Name"))
	TArray<FConsacEntry> Observations;

	/** What it does. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent", meta=(TitleProperty="Name"))
	TArray<FConsacEntry> Actions;

	/** Ticks from one decision to the next. All agents of a world decide together: the longest period of those that are there when the
	 *  training begins counts. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent", meta=(ClampMin="1"))
	int32 DecisionPeriod = 1;

	/** After so many decisions its episode is truncated; 0: never. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent", meta=(ClampMin="0"))
	int64 MaxEpisodeSteps = 0;

	/** Set Choice Allowed says at every step which choices are legal. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	bool bForbidsChoices = false;

	/** What each decision pays, by what was seen after it: for an agent whose Observations have two of one space, named achieved_goal and
	 *  desired_goal. A learner can then learn from goals that were not meant, too (hindsight experience replay). */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	EConsacGoalReward GoalReward = EConsacGoalReward::None;

	/** Goal Reward Sparse: so near, in the units of these observations, the goal is reached. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent", meta=(ClampMin="0"))
	float GoalThreshold = 0.05f;

	/** Goal Reward alone pays, and what Add Reward brings is left out. Off: Add Reward pays, and is to come to the same. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	bool bGoalsPay = true;

	/** Agents of one name win and lose together: Add Group Reward pays all of them. None: it is in no group. A trainer is told of groups where agents of several
	 *  Behaviours share the world; agents of one Behaviour alone are paid as well, each in a world of its own. None where Goal Reward pays. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Agent")
	FName Group;

	/** Put the agent at its start. Seed is below 0 where the trainer did not give one. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Agent")
	FConsacEpisodeEvent OnEpisodeBegin;

	/** Say what the agent sees, with Set Observation Number, Numbers, Vector or Choice. Comes after its sensors have looked. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Agent")
	FConsacAgentEvent OnObserve;

	/** Carry out the action: Get Action Choice, Get Action Number. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Agent")
	FConsacAgentEvent OnAction;

	/** Where a person or rules play: say what to do, with Set Action Choice or Set Action Numbers. Comes before On Action. */
	UPROPERTY(BlueprintAssignable, Category="Consac|Agent")
	FConsacAgentEvent OnHeuristic;

	/** What the agent sees, for an entry of one number. False, and a line in the log, when there is no such entry. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Observation Number"))
	bool SetObservationNumber(FName Name, float Value);

	/** The same for an entry of several numbers. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Observation Numbers"))
	bool SetObservationNumbers(FName Name, const TArray<float>& Values);

	/** The same for an entry of three numbers. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Observation Vector"))
	bool SetObservationVector(FName Name, FVector Value);

	/** The same for an entry that is a choice. False, and a line in the log, also when it has no such choice. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Observation Choice"))
	bool SetObservationChoice(FName Name, int32 Choice);

	/** Adds to the reward of the latest decision: from its On Action until the On Observe after it. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Add Reward"))
	void AddReward(float Reward);

	/** The same for every agent of its Group, this one too. In no group: the agent alone. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Add Group Reward"))
	void AddGroupReward(float Reward);

	/** What the agent's episode has of one of the Consac Trainer's Environment Parameters; from On Episode Begin on. Its Default where no training has begun. 0, and a line in
	 *  the log, when there is no such parameter. */
	UFUNCTION(BlueprintPure, Category="Consac|Agent", meta=(DisplayName="Get Environment Parameter"))
	float GetEnvironmentParameter(FName Name) const;

	/** The agent's episode has ended; On Episode Begin follows. The first call before a decision counts. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="End Episode"))
	void EndEpisode(EConsacEpisodeEnd End);

	/** The choice that was made; -1 when there is no such entry or no action yet. */
	UFUNCTION(BlueprintPure, Category="Consac|Agent", meta=(DisplayName="Get Action Choice"))
	int32 GetActionChoice(FName Name) const;

	/** A number of the action; 0 when there is no such entry, no such number or no action yet. */
	UFUNCTION(BlueprintPure, Category="Consac|Agent", meta=(DisplayName="Get Action Number"))
	float GetActionNumber(FName Name, int32 Index = 0) const;

	/** All numbers of an entry of the action; none when there is no such entry or no action yet. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Agent", meta=(DisplayName="Get Action Numbers"))
	TArray<float> GetActionNumbers(FName Name) const;

	/** In On Heuristic: the choice. False, and a line in the log, when there is no such entry, it is no choice, or has no such one. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Action Choice"))
	bool SetActionChoice(FName Name, int32 Choice);

	/** In On Heuristic: the numbers; one beyond the bounds of its entry is taken as the bound. False, and a line in the log, when there
	 *  is no such entry, it takes another number of numbers, or one is not finite. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Action Numbers"))
	bool SetActionNumbers(FName Name, const TArray<float>& Values);

	/** In On Observe: whether a choice is legal at the coming decision; all are unless forbidden. False, and nothing is changed, when there is no
	 *  such entry or choice, or Forbids Choices is off.
	 *  @param Choice From 0 on. MultiDiscrete: those of all entries in one row, the second's after the first's. MultiBinary: 2 for each bit,
	 *  off and then on. */
	UFUNCTION(BlueprintCallable, Category="Consac|Agent", meta=(DisplayName="Set Choice Allowed"))
	bool SetChoiceAllowed(FName Name, int32 Choice, bool bAllowed);

	/** Reward of the episode so far. */
	UFUNCTION(BlueprintPure, Category="Consac|Agent", meta=(DisplayName="Get Episode Reward"))
	float GetEpisodeReward() const;

	/** Decisions of the episode so far. */
	UFUNCTION(BlueprintPure, Category="Consac|Agent", meta=(DisplayName="Get Episode Steps"))
	int64 GetEpisodeSteps() const;

	/** A sensor of the same actor; it becomes an observation of its name. */
	void AddSensor(UConsacSensorComponent* Sensor);

	/** It ends; unknown ones are passed over. */
	void RemoveSensor(UConsacSensorComponent* Sensor);

	/** Every sensor, in the order in which they began to play. */
	const TArray<TObjectPtr<UConsacSensorComponent>>& GetSensors() const;

	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;

private:
	friend class FConsacHerd;

	UPROPERTY(Transient, DuplicateTransient)
	TArray<TObjectPtr<UConsacSensorComponent>> Sensors;

	FConsacHerd* Herd = nullptr;
	int32 Place = -1;
	int64 EpisodeSteps = 0;
	float EpisodeReward = 0.0f;
};
