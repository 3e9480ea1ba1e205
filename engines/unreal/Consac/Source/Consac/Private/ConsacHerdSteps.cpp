// Copyright CONSAC authors. MIT License.
// A herd from one decision to the next: what its agents see, do and get.
#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacHerd.h"
#include "ConsacLog.h"
#include "ConsacSensorComponent.h"
#include "GameFramework/Actor.h"
#include "UObject/UObjectGlobals.h"
#include "VisualLogger/VisualLogger.h"

void FConsacHerd::BeginEpisode(consac::host::AgentId Id, int64 Seed)
{
	if (UConsacAgentComponent* Agent = Places[static_cast<std::size_t>(Id)].Agent.Get())
	{
		Agent->EpisodeSteps = 0;
		Agent->EpisodeReward = 0.0f;
		Places[static_cast<std::size_t>(Id)].Held.clear();
		for (UConsacSensorComponent* Sensor : Agent->Sensors)
		{
			if (IsValid(Sensor))
			{
				Sensor->ForgetLooks();
			}
		}
		Agent->OnEpisodeBegin.Broadcast(Agent, Seed);
	}
}

void FConsacHerd::Prepare(consac::host::AgentId Id)
{
	// A sensor of a latecomer among agents without any is no entry of theirs.
	const UConsacAgentComponent* Agent = bSenses ? Places[static_cast<std::size_t>(Id)].Agent.Get() : nullptr;
	// By number: what a sensor does may take another one away, or its agent.
	for (int32 Index = 0; IsValid(Agent) && Index < Agent->Sensors.Num(); ++Index)
	{
		UConsacSensorComponent* Sensor = Agent->Sensors[Index];
		if (IsValid(Sensor))
		{
			Sensor->Prepare();
		}
	}
}

void FConsacHerd::Observe(consac::host::AgentId Id)
{
	UConsacAgentComponent* Agent = Places[static_cast<std::size_t>(Id)].Agent.Get();
	if (Agent == nullptr)
	{
		return;
	}
	std::vector<std::uint8_t>& Allowed = Places[static_cast<std::size_t>(Id)].Allowed;
	std::fill(Allowed.begin(), Allowed.end(), std::uint8_t{1});
	// By number: what a sensor does may take another one away.
	for (int32 Index = 0; Index < Agent->Sensors.Num(); ++Index)
	{
		UConsacSensorComponent* Sensor = Agent->Sensors[Index];
		if (IsValid(Sensor))
		{
			Sensor->SenseStacked(Sensed);
			const consac::Status Status = SetObservation(*Agent, Sensor->ObservationName, Sensed.GetData(), Sensed.Num());
			if (!Status.ok())
			{
				ConsacPlugin::LogError(FString::Printf(TEXT("the sensor %s: %s"), *Sensor->GetName(), *ConsacPlugin::FromUtf8(Status.message())));
			}
		}
	}
	Agent->OnObserve.Broadcast(Agent);
}

// What was seen, as the world's row.
void FConsacHerd::Publish(consac::host::AgentId Id)
{
	FPlace& Taken = Places[static_cast<std::size_t>(Id)];
	if (!TheWorld->Joined(Id))
	{
		return;
	}
	Taken.bShown = true;
	std::memcpy(TheWorld->Observation(Id), Taken.Row.data(), Taken.Row.size());
	std::uint8_t* Mask = TheWorld->ActionMask(Id);
	if (Mask != nullptr)
	{
		std::memcpy(Mask, Taken.Allowed.data(), Taken.Allowed.size());
	}
}

consac::Status FConsacHerd::Offer()
{
	bActing = bJudged = false;
	bWaiting = bPipelined;
	++Offers;
	for (FPlace& Taken : Places)
	{
		Taken.Earned = std::exchange(Taken.Earning, 0.0f);
	}
	for (const std::unique_ptr<consac::host::Recorder>& Recorder : Recorders)
	{
		Recorder->Note();
	}
	return TheWorld->Offer();
}

consac::Status FConsacHerd::Begin()
{
	bWaiting = false;
	for (consac::host::AgentId Id = 0; Id < TheWorld->places(); ++Id)
	{
		if (TheWorld->Resets(Id))
		{
			// Without its sign, and otherwise as it is: seeds of neighbours differ in their last bit.
			constexpr std::uint64_t Largest = std::numeric_limits<int64>::max();
			const std::optional<std::uint64_t> Seed = TheWorld->Seed(Id);
			BeginEpisode(Id, Seed ? static_cast<int64>(*Seed & Largest) : -1);
		}
	}
	for (consac::host::AgentId Id = 0; Id < TheWorld->places(); ++Id)
	{
		if (TheWorld->Resets(Id))
		{
			Prepare(Id);
		}
	}
	for (consac::host::AgentId Id = 0; Id < TheWorld->places(); ++Id)
	{
		if (TheWorld->Resets(Id)) // the others are in the middle of an episode, and nobody asked what they see
		{
			Observe(Id);
			Publish(Id);
		}
	}
	return Offer();
}

void FConsacHerd::Act(bool bByHand)
{
	bActing = true;
	bWaiting = false;
	for (FPlace& Taken : Places)
	{
		Taken.bNew = Taken.bNew && !Taken.bShown; // before any event: what it does may be about another agent
	}
	for (consac::host::AgentId Id = 0, Count = TheWorld->places(); Id < Count; ++Id)
	{
		FPlace& Taken = Places[static_cast<std::size_t>(Id)];
		if (!Taken.bShown) // it came after this decision was asked for
		{
			continue;
		}
		if (UConsacAgentComponent* Agent = bByHand ? Taken.Agent.Get() : nullptr)
		{
			Agent->OnHeuristic.Broadcast(Agent);
		}
		if (UConsacAgentComponent* Agent = Taken.Agent.Get())
		{
			if (bPipelined)
			{
				Taken.Held.assign(TheWorld->Action(Id), TheWorld->Action(Id) + Taken.Acts);
			}
			UE_VLOG(Agent->GetOwner(), LogConsac, Log, TEXT("%s"), *DescribeOne(Id)); // asked for where the Visual Logger records alone
			Agent->OnAction.Broadcast(Agent);
		}
	}
}

// A step more for its agent, and what it sees.
void FConsacHerd::Judge(consac::host::AgentId Id)
{
	const FPlace& Taken = Places[static_cast<std::size_t>(Id)];
	UConsacAgentComponent* Agent = Taken.Agent.Get();
	if (Agent == nullptr)
	{
		TheWorld->Leave(Id); // also of one that was collected before its end of play
		return;
	}
	if (!Taken.bNew)
	{
		++Agent->EpisodeSteps;
	}
	bTimeIsUp = bTimeIsUp || (Agent->MaxEpisodeSteps > 0 && Agent->EpisodeSteps >= Agent->MaxEpisodeSteps);
	Observe(Id);
}

// Where time is up for its agent, and nobody has said how its episode ends.
void FConsacHerd::CutOff(consac::host::AgentId Id)
{
	const UConsacAgentComponent* Agent = Places[static_cast<std::size_t>(Id)].Agent.Get();
	if (Agent != nullptr && Agent->MaxEpisodeSteps > 0 && Agent->EpisodeSteps >= Agent->MaxEpisodeSteps)
	{
		TheWorld->EndEpisode(Id, consac::host::EpisodeEnd::kTruncated);
	}
}

// Something is likely wrong where no episode gets further than its first step.
void FConsacHerd::NoteLength(const UConsacAgentComponent& Agent)
{
	constexpr int32 Many = 20;
	ShortOnes = Agent.EpisodeSteps == 1 && Agent.MaxEpisodeSteps != 1 ? ShortOnes + 1 : 0;
	if (ShortOnes == Many && !std::exchange(bSaidShort, true))
	{
		UE_LOG(LogConsac, Warning, TEXT("%d episodes in a row ended with their first step, the latest of %s: does On Episode Begin put back all that ends an episode? A body that moves by physics keeps its speed, and Set Actor Location moves it with Teleport alone"),
			Many, *Agent.GetName());
	}
}

// What the goals of its agent pay, where those do.
void FConsacHerd::Earn(consac::host::AgentId Id)
{
	FPlace& Taken = Places[static_cast<std::size_t>(Id)];
	UConsacAgentComponent* Agent = Taken.Agent.Get();
	const consac::host::Goals& Goals = Kinds[Taken.Kind].Offering.goals;
	if (Agent == nullptr || Taken.bNew || !Goals.pays || Goals.reward == consac::host::GoalReward::kNone)
	{
		return;
	}
	const float Worth = TheWorld->Reward(Id);
	Agent->EpisodeReward += Worth - Taken.Earning;
	Taken.Earning = Worth;
}

// From an episode that ends to the next one.
void FConsacHerd::Turn(consac::host::AgentId Id)
{
	FPlace& Taken = Places[static_cast<std::size_t>(Id)];
	Taken.bBegins = TheWorld->Ending(Id);
	if (!Taken.bBegins && !bGoalsPay)
	{
		return;
	}
	if (!Taken.bBegins)
	{
		Publish(Id); // which the goals' worth is read off
		Earn(Id);
		return;
	}
	if (Taken.Agent.Get() == nullptr)
	{
		// It cannot look again: the episode ends with what was offered last.
		std::memcpy(TheWorld->FinalObservation(Id), TheWorld->Observation(Id), Taken.Row.size());
		return;
	}
	std::memcpy(TheWorld->FinalObservation(Id), Taken.Row.data(), Taken.Row.size());
	Earn(Id);
	NoteLength(*Taken.Agent.Get());
	BeginEpisode(Id, -1);
}

consac::Status FConsacHerd::Settle()
{
	const consac::host::AgentId Count = TheWorld->places();
	// All together, so that nobody's last observation shows another one at its new start.
	for (consac::host::AgentId Id = 0; bSenses && Id < Count; ++Id)
	{
		Prepare(Id);
	}
	bTimeIsUp = false;
	for (consac::host::AgentId Id = 0; Id < Count; ++Id)
	{
		Judge(Id);
	}
	for (consac::host::AgentId Id = 0; bTimeIsUp && Id < Count; ++Id)
	{
		CutOff(Id); // after every On Observe: any of them may end any episode
	}
	bJudged = true;
	for (consac::host::AgentId Id = 0; Id < Count; ++Id)
	{
		Turn(Id);
	}
	for (consac::host::AgentId Id = 0; bSenses && Id < Count; ++Id)
	{
		if (Places[static_cast<std::size_t>(Id)].bBegins)
		{
			Prepare(Id);
		}
	}
	for (consac::host::AgentId Id = 0; Id < Count; ++Id)
	{
		if (std::exchange(Places[static_cast<std::size_t>(Id)].bBegins, false))
		{
			Observe(Id);
		}
		Publish(Id);
	}
	return Offer();
}
