// Copyright CONSAC authors. MIT License.
#pragma once

#include "CoreMinimal.h"
#include "Components/ActorComponent.h"
#include "Templates/PimplPtr.h"
#include "ConsacYumiReachComponent.generated.h"

class UConsacAgentComponent;
class UConsacTwinComponent;
struct FConsacYumiReachState;

/** The task of the program's world yumi-reach-v0, by the same code: the right arm of ABB's YuMi brings its tool to a point. What it sees, does and is paid
 *  is the world's to the bit, in metres, radians and the robot's own right-handed frame. A Consac Twin of the same actor shows it. */
UCLASS(ClassGroup=(Consac), meta=(BlueprintSpawnableComponent, DisplayName="Consac YuMi Reach"))
class CONSAC_API UConsacYumiReachComponent : public UActorComponent
{
	GENERATED_BODY()

public:
	UConsacYumiReachComponent();

	/** Paid by the distance, as yumi-reach-dense-v0 is, instead of -1 until the tool is within 5 cm. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category="Consac|Twin")
	bool bDense = false;

	/** The ready pose and another goal.
	 *  @param Seed Of this goal and those after it; below 0 they go on as they would. */
	UFUNCTION(BlueprintCallable, Category="Consac|Twin", meta=(DisplayName="Begin Reach"))
	void BeginReach(int64 Seed = -1);

	/** One step of 0.04 s. False, a line in the log and no step, when the action has not three finite numbers.
	 *  @param Action Where the tool goes, -1 to 1 along x, y and z of the robot; 1 is 5 cm.
	 *  @param Reward What the step pays. */
	UFUNCTION(BlueprintCallable, Category="Consac|Twin", meta=(DisplayName="Step Reach"))
	bool StepReach(const TArray<float>& Action, float& Reward);

	/** What the agent sees; none when there is no such entry.
	 *  @param Entry achieved_goal, desired_goal or observation. */
	UFUNCTION(BlueprintCallable, BlueprintPure=false, Category="Consac|Twin", meta=(DisplayName="Get Reach Observation"))
	TArray<float> GetReachObservation(FName Entry) const;

	/** Where the tool should be, as the twin sees it, in centimetres. */
	UFUNCTION(BlueprintPure, Category="Consac|Twin", meta=(DisplayName="Get Reach Goal"))
	FVector GetReachGoal() const;

	/** An agent that sees and does what the world's does, for episodes of its length. */
	UFUNCTION(BlueprintCallable, Category="Consac|Twin", meta=(DisplayName="Set Up Reach Agent"))
	static void SetUpReachAgent(UConsacAgentComponent* Agent);

	virtual void BeginDestroy() override;

private:
	void Show();

	TPimplPtr<FConsacYumiReachState> State;
};
