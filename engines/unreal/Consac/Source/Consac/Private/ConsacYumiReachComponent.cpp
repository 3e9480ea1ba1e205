// Copyright CONSAC authors. MIT License.
#include "ConsacYumiReachComponent.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacTwinComponent.h"
#include "ConsacTwinTable.h"
#include "ConsacTypes.h"
#include "GameFramework/Actor.h"
#include "Templates/PimplPtr.h"
#include "UObject/UObjectGlobals.h"

// Of a task that has begun.
struct FConsacYumiReachState
{
	std::optional<consac::worlds::RobotReach> World;
	consac::Rng Rng = consac::Rng(0, consac::StreamId("world"));
	consac::Layout Seen;
	TArray<float> Row; // what is seen, as Seen has it
};

namespace ConsacPlugin
{

static std::shared_ptr<const consac::worlds::ReachTask> ReachTask(bool bDense)
{
	return consac::worlds::YumiReachTask(bDense ? consac::worlds::YumiReach::kDense : consac::worlds::YumiReach::kPlain);
}

static consac::BehaviourSpec ReachSpec()
{
	return consac::worlds::RobotReach::Spec(*ReachTask(false), 1).behaviours[0];
}

// The numbers of a leaf that the world has by its name.
static TArray<float> ReachNumbers(const FConsacYumiReachState& State, FName Entry)
{
	TArray<float> Values;
	for (const consac::Leaf& Leaf : State.Seen.leaves)
	{
		if (FName(*FromUtf8(Leaf.name)) == Entry)
		{
			ReadLeaf(Leaf, reinterpret_cast<const std::byte*>(State.Row.GetData()), Values);
		}
	}
	return Values;
}

// The entries of its observations and actions; what is without bounds has none here either.
static FConsacEntry EntryOf(const consac::Leaf& Leaf, const TCHAR* Unnamed)
{
	FConsacEntry Entry;
	Entry.Name = Leaf.name.empty() ? FName(Unnamed) : FName(*FromUtf8(Leaf.name));
	Entry.Space.Size = static_cast<int32>(Leaf.count);
	if (std::isfinite(Leaf.space.low()[0]))
	{
		Entry.Space.Low.Add(static_cast<float>(Leaf.space.low()[0]));
		Entry.Space.High.Add(static_cast<float>(Leaf.space.high()[0]));
	}
	return Entry;
}

}

UConsacYumiReachComponent::UConsacYumiReachComponent()
	: State(MakePimpl<FConsacYumiReachState>())
{
}

void UConsacYumiReachComponent::SetUpReachAgent(UConsacAgentComponent* Agent)
{
	if (Agent == nullptr)
	{
		return;
	}
	const consac::BehaviourSpec Spec = ConsacPlugin::ReachSpec();
	Agent->MaxEpisodeSteps = consac::worlds::RobotReach::kSteps;
	Agent->GoalReward = EConsacGoalReward::Sparse; // for goals that were not meant; Step Reach pays
	Agent->GoalThreshold = static_cast<float>(ConsacPlugin::ReachTask(false)->threshold);
	Agent->bGoalsPay = false;
	Agent->Observations.Reset();
	Agent->Actions.Reset();
	for (const consac::Leaf& Leaf : Spec.observation_layout.leaves)
	{
		Agent->Observations.Add(ConsacPlugin::EntryOf(Leaf, TEXT("observation")));
	}
	for (const consac::Leaf& Leaf : Spec.action_layout.leaves)
	{
		Agent->Actions.Add(ConsacPlugin::EntryOf(Leaf, TEXT("tool")));
	}
}

void UConsacYumiReachComponent::BeginReach(int64 Seed)
{
	if (Seed >= 0)
	{
		State->Rng = consac::Rng(static_cast<std::uint64_t>(Seed), consac::StreamId("world"));
	}
	State->World.emplace(ConsacPlugin::ReachTask(bDense));
	State->Seen = ConsacPlugin::ReachSpec().observation_layout;
	State->Row.SetNum(ConsacPlugin::CountOf(State->Seen));
	State->World->Reset(State->Rng, State->Row.GetData());
	Show();
}

bool UConsacYumiReachComponent::StepReach(const TArray<float>& Action, float& Reward)
{
	Reward = 0.0f;
	const bool bFits = Action.Num() == 3 && std::all_of(Action.begin(), Action.end(), [](float Number) { return std::isfinite(Number); });
	if (!State->World || !bFits)
	{
		ConsacPlugin::LogError(bFits ? FString(TEXT("Step Reach: nothing has begun; call Begin Reach before"))
			: FString::Printf(TEXT("Step Reach: an action is three finite numbers, and this one has %d"), Action.Num()));
		return false;
	}
	Reward = State->World->Step(Action.GetData(), State->Rng, State->Row.GetData()).reward;
	Show();
	return true;
}

TArray<float> UConsacYumiReachComponent::GetReachObservation(FName Entry) const
{
	return ConsacPlugin::ReachNumbers(*State, Entry);
}

FVector UConsacYumiReachComponent::GetReachGoal() const
{
	const TArray<float> Goal = ConsacPlugin::ReachNumbers(*State, FName(TEXT("desired_goal")));
	consac::robot::Transform Frame;
	if (Goal.Num() == 3)
	{
		Frame.position = { static_cast<double>(Goal[0]), static_cast<double>(Goal[1]), static_cast<double>(Goal[2]) };
	}
	return ConsacPlugin::ToTransform(Frame).GetLocation();
}

// The twin's joints where the world's are; a twin without a robot becomes the world's arm.
void UConsacYumiReachComponent::Show()
{
	UConsacTwinComponent* Twin = GetOwner() != nullptr ? GetOwner()->FindComponentByClass<UConsacTwinComponent>() : nullptr;
	if (!IsValid(Twin))
	{
		return;
	}
	const consac::robot::Robot& Robot = State->World->task().robot;
	if (Twin->GetJointNames().IsEmpty())
	{
		FConsacTwinTable Table;
		Table.Robot = Robot;
		UConsacTwin* Arm = NewObject<UConsacTwin>(this);
		Arm->SetTable(Table);
		Twin->SetTwin(Arm);
	}
	for (std::size_t Number = 0; Number < Robot.position_joints.size(); ++Number)
	{
		const consac::robot::Joint& Joint = Robot.joints[static_cast<std::size_t>(Robot.position_joints[Number])];
		Twin->SetJoint(FName(*ConsacPlugin::FromUtf8(Joint.name)), ConsacPlugin::ToDegreesOrCentimetres(Joint, State->World->joints()[Number]));
	}
}

void UConsacYumiReachComponent::BeginDestroy()
{
	if (State.IsValid()) // a temporary object of Hot Reload has none
	{
		State->World.reset();
	}
	Super::BeginDestroy();
}
