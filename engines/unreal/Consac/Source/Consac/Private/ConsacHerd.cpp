// Copyright CONSAC authors. MIT License.
#include "ConsacHerd.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacFarewell.h"
#include "ConsacLog.h"
#include "ConsacSensorComponent.h"
#include "GameFramework/Actor.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacPlugin
{

static consac::Status AddEntry(FName Name, const FConsacSpace& Space, std::vector<consac::host::Entry>& Into, TArray<FName>& Names)
{
	consac::Result<consac::Space> Converted = ToSpace(Space);
	const std::string Text = ToKey(Name);
	if (!Converted.ok())
	{
		return consac::Status(Converted.status().code(), "entry '" + Text + "': " + Converted.status().message());
	}
	if (Name == NAME_None || Names.Contains(Name))
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, "entry '" + Text + "' has no name of its own; every entry needs one");
	}
	Into.push_back({ Text, std::move(*Converted) });
	Names.Add(Name);
	return consac::Status::Ok();
}

// In whatever order: sensors are in that in which they began to play. A name is there once in either.
static bool SameEntries(const std::vector<consac::host::Entry>& Left, const std::vector<consac::host::Entry>& Right)
{
	return std::is_permutation(Left.begin(), Left.end(), Right.begin(), Right.end(),
		[](const consac::host::Entry& One, const consac::host::Entry& Other) { return One.name == Other.name && One.space == Other.space; });
}

static consac::host::Goals GoalsOf(const UConsacAgentComponent& Agent)
{
	consac::host::Goals Goals;
	Goals.reward = Agent.GoalReward == EConsacGoalReward::Sparse ? consac::host::GoalReward::kSparse :
		Agent.GoalReward == EConsacGoalReward::Dense ? consac::host::GoalReward::kDense : consac::host::GoalReward::kNone;
	Goals.threshold = static_cast<double>(Agent.GoalThreshold);
	Goals.pays = Agent.bGoalsPay;
	return Goals;
}

static bool SameGoals(const consac::host::Goals& Left, const consac::host::Goals& Right)
{
	return Left.reward == Right.reward && Left.threshold == Right.threshold && Left.pays == Right.pays;
}

// Whether the entry is a choice, and has this one.
static consac::Status CheckChoice(const consac::Leaf& Leaf, int32 Choice)
{
	if (Leaf.space.kind() != consac::SpaceKind::kDiscrete)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, "it is no choice but " + Leaf.space.ToString() + "; set its numbers");
	}
	const std::pair<double, double> Bounds = consac::ElementBounds(Leaf, 0);
	if (Choice < Bounds.first || Choice > Bounds.second)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, "there is no choice " + std::to_string(Choice) + " in " + Leaf.space.ToString());
	}
	return consac::Status::Ok();
}

static int32 IndexIn(const TArray<FName>& Names, FName Name)
{
	for (int32 Index = 0; Index < Names.Num(); ++Index)
	{
		if (Names[Index] == Name)
		{
			return Index;
		}
	}
	return -1;
}

}

FConsacHerd::~FConsacHerd()
{
	for (FPlace& Taken : Places)
	{
		// Also one that is garbage already: its end of play may still come. Not one that another herd has by now.
		UConsacAgentComponent* Agent = Taken.Agent.Get(true);
		if (Agent != nullptr && Agent->Herd == this)
		{
			Agent->Herd = nullptr;
			Agent->Place = -1;
		}
	}
}

consac::Result<FConsacHerd::FKind> FConsacHerd::KindOf(const UConsacAgentComponent& Agent)
{
	FKind Kind;
	Kind.Offering.name = ConsacPlugin::ToUtf8(Agent.Behaviour);
	Kind.Offering.agents = 0;
	Kind.Offering.masks_actions = Agent.bForbidsChoices;
	Kind.Offering.goals = ConsacPlugin::GoalsOf(Agent);
	consac::Status Status;
	for (const FConsacEntry& Entry : Agent.Observations)
	{
		Status = Status.ok() ? ConsacPlugin::AddEntry(Entry.Name, Entry.Space, Kind.Offering.observations, Kind.Seen) : Status;
	}
	for (UConsacSensorComponent* Sensor : Agent.Sensors)
	{
		if (Status.ok() && IsValid(Sensor))
		{
			const FString Fault = Sensor->GetFault();
			Status = !Fault.IsEmpty() ? consac::Status(consac::StatusCode::kFailedPrecondition, "the sensor " + ConsacPlugin::ToUtf8(Sensor->GetName()) + ": " + ConsacPlugin::ToUtf8(Fault)) :
				ConsacPlugin::AddEntry(Sensor->ObservationName, Sensor->BeginStack(), Kind.Offering.observations, Kind.Seen);
		}
	}
	for (const FConsacEntry& Entry : Agent.Actions)
	{
		Status = Status.ok() ? ConsacPlugin::AddEntry(Entry.Name, Entry.Space, Kind.Offering.actions, Kind.Done) : Status;
	}
	if (!Status.ok())
	{
		return consac::Status(Status.code(), "behaviour '" + Kind.Offering.name + "': " + Status.message());
	}
	return Kind;
}

consac::Status FConsacHerd::Gather(const TArray<UConsacAgentComponent*>& Agents, int32 Room, const TArray<FConsacParameter>& Parameters)
{
	for (const UConsacAgentComponent* Agent : Agents)
	{
		consac::Result<FKind> Kind = KindOf(*Agent);
		if (!Kind.ok())
		{
			return Kind.status();
		}
		const auto Known = std::find_if(Kinds.begin(), Kinds.end(), [&Kind](const FKind& Other) { return Other.Offering.name == Kind->Offering.name; });
		const std::size_t At = static_cast<std::size_t>(Known - Kinds.begin());
		if (Known == Kinds.end())
		{
			Kinds.push_back(std::move(*Kind));
		}
		FKind& Shared = Kinds[At];
		++Shared.Offering.agents;
		Ticks = Agent->DecisionPeriod > Ticks ? Agent->DecisionPeriod : Ticks;
		bSenses = bSenses || !Agent->Sensors.IsEmpty();
	}
	consac::host::TickWorldOptions Options;
	Options.agents_leave = true; // any actor may be destroyed
	for (FKind& Kind : Kinds)
	{
		const consac::host::Goals& Goals = Kind.Offering.goals;
		bGoalsPay = bGoalsPay || (Goals.pays && Goals.reward != consac::host::GoalReward::kNone);
		Kind.Offering.agents = Kind.Offering.agents < Room ? Room : Kind.Offering.agents;
		Options.offerings.push_back(Kind.Offering);
	}
	consac::Result<std::vector<consac::ParameterSpec>> Settable = ConsacPlugin::ToParameters(Parameters);
	if (!Settable.ok())
	{
		return Settable.status();
	}
	Options.parameters = std::move(*Settable);
	Options.notes = true;
	Options.groups = GroupsOf(Agents);
	consac::Result<std::unique_ptr<consac::host::TickWorld>> Made = consac::host::TickWorld::Create(std::move(Options));
	if (!Made.ok())
	{
		return Made.status();
	}
	TheWorld = std::move(*Made);
	int32 First = 0; // no sum before the world has said that so many places can be
	for (FKind& Kind : Kinds)
	{
		Kind.Place = First;
		First += Kind.Offering.agents;
	}
	Places.resize(static_cast<std::size_t>(TheWorld->places()));
	for (UConsacAgentComponent* Agent : Agents)
	{
		CONSAC_RETURN_IF_ERROR(Place(*Agent));
	}
	return consac::Status::Ok();
}

consac::Status FConsacHerd::Place(UConsacAgentComponent& Agent)
{
	const consac::Result<FKind> Kind = KindOf(Agent);
	if (!Kind.ok())
	{
		return Kind.status();
	}
	for (std::size_t B = 0; B < Kinds.size(); ++B)
	{
		const FKind& Shared = Kinds[B];
		if (Shared.Offering.name != Kind->Offering.name)
		{
			continue;
		}
		if (!ConsacPlugin::SameEntries(Shared.Offering.observations, Kind->Offering.observations) ||
			!ConsacPlugin::SameEntries(Shared.Offering.actions, Kind->Offering.actions) || Shared.Offering.masks_actions != Kind->Offering.masks_actions ||
			!ConsacPlugin::SameGoals(Shared.Offering.goals, Kind->Offering.goals))
		{
			return consac::Status(consac::StatusCode::kInvalidArgument, "the agent " + ConsacPlugin::ToUtf8(Agent.GetName()) +
				" sees or does something else, or is paid otherwise, than others of behaviour '" + Shared.Offering.name + "'; give it a behaviour of its own");
		}
		if (Agent.Group != NAME_None && Shared.Offering.goals.reward != consac::host::GoalReward::kNone)
		{
			return consac::Status(consac::StatusCode::kInvalidArgument, "the agent " + ConsacPlugin::ToUtf8(Agent.GetName()) + " is in the group '" +
				ConsacPlugin::ToKey(Agent.Group) + "', and its goals say what it is paid; set Group to None, or Goal Reward");
		}
		const consac::Result<consac::host::AgentId> Id = PlaceFor(B, Agent.Group);
		if (!Id.ok())
		{
			return Id.status();
		}
		if (Agent.Herd != nullptr && Agent.Herd != this)
		{
			Agent.Herd->Leave(Agent); // of a trainer that dies in the event in which this one begins
		}
		const consac::BehaviourSpec& Behaviour = TheWorld->spec().behaviours[B];
		FPlace& Taken = Places[static_cast<std::size_t>(*Id)];
		Taken.Agent = &Agent;
		Taken.Group = Agent.Group;
		Taken.Kind = B;
		Taken.Row.assign(Behaviour.observation_layout.row_bytes, std::byte{0});
		Taken.Acts = Behaviour.action_layout.row_bytes;
		Taken.Allowed.assign(static_cast<std::size_t>(Behaviour.masks_actions ? Behaviour.action_layout.mask_bytes : 0), std::uint8_t{1});
		Taken.bNew = true;
		Taken.bShown = false;
		Taken.Held.clear();
		Taken.Earning = Taken.Earned = 0.0f;
		Agent.Herd = this;
		Agent.Place = *Id;
		return consac::Status::Ok();
	}
	return consac::Status(consac::StatusCode::kNotFound, "no agent of behaviour '" + Kind->Offering.name + "' was there when the training began");
}

consac::Status FConsacHerd::Join(UConsacAgentComponent& Agent)
{
	if (Knows(Agent)) // it ended to play and began anew within a tick, and was noted twice
	{
		return consac::Status::Ok();
	}
	CONSAC_RETURN_IF_ERROR(Place(Agent));
	BeginEpisode(Agent.Place, -1);
	return consac::Status::Ok();
}

void FConsacHerd::SayThatItLeaves(const UConsacAgentComponent& Agent)
{
	if (Knows(Agent) && !std::exchange(bSaidWhoLeft, true))
	{
		const AActor* Actor = Agent.GetOwner();
		UE_LOG(LogConsac, Display, TEXT("%s leaves the training: its place takes no part, and no step of it counts, until another agent of behaviour '%s' comes; said of the first that leaves"),
			Actor != nullptr ? *Actor->GetName() : *Agent.GetName(), *Agent.Behaviour);
	}
}

void FConsacHerd::Leave(UConsacAgentComponent& Agent)
{
	if (Knows(Agent))
	{
		FPlace& Taken = Places[static_cast<std::size_t>(Agent.Place)];
		Taken.Agent = nullptr;
		if (bJudged)
		{
			// What it saw in this step ends its episode, also where that has not been offered yet.
			std::memcpy(TheWorld->Observation(Agent.Place), Taken.Row.data(), Taken.Row.size());
		}
		TheWorld->Leave(Agent.Place);
	}
	Agent.Herd = nullptr;
	Agent.Place = -1;
}

bool FConsacHerd::Knows(const UConsacAgentComponent& Agent) const
{
	return Agent.Place >= 0 && static_cast<std::size_t>(Agent.Place) < Places.size() && At(Agent.Place).Agent.Get() == &Agent;
}

bool FConsacHerd::Acts(const UConsacAgentComponent& Agent) const
{
	return Knows(Agent) && IsActing() && !At(Agent.Place).bNew;
}

bool FConsacHerd::Earns(const UConsacAgentComponent& Agent) const
{
	return Knows(Agent) && (bWaiting || IsActing()) && !At(Agent.Place).bNew;
}

const std::byte* FConsacHerd::ActionRow(consac::host::AgentId Id) const
{
	const FPlace& Taken = At(Id);
	if (IsActing() && !Taken.bNew)
	{
		return TheWorld->Action(Id);
	}
	return Taken.Held.empty() ? nullptr : Taken.Held.data();
}

void FConsacHerd::Record()
{
	for (std::size_t B = 0; B < Kinds.size(); ++B)
	{
		Recorders.push_back(std::make_unique<consac::host::Recorder>(*TheWorld, B));
	}
}

std::vector<std::string> FConsacHerd::Behaviours() const
{
	std::vector<std::string> Names;
	for (const FKind& Kind : Kinds)
	{
		Names.push_back(Kind.Offering.name);
	}
	return Names;
}

void FConsacHerd::Release(FConsacFarewell& Into)
{
	Into.Behaviours = Behaviours();
	Into.World = std::move(TheWorld);
	Into.Recorders = std::move(Recorders);
}

void FConsacHerd::AddReward(UConsacAgentComponent& Agent, float Reward)
{
	if (Earns(Agent))
	{
		TheWorld->AddReward(Agent.Place, Reward);
		Agent.EpisodeReward += Reward;
		Places[static_cast<std::size_t>(Agent.Place)].Earning += Reward;
	}
}

void FConsacHerd::EndEpisode(const UConsacAgentComponent& Agent, consac::host::EpisodeEnd End)
{
	if (Earns(Agent) && !bJudged)
	{
		TheWorld->EndEpisode(Agent.Place, End);
	}
}

const consac::Leaf* FConsacHerd::ActionLeaf(const UConsacAgentComponent& Agent, FName Name) const
{
	if (!Knows(Agent))
	{
		return nullptr;
	}
	const int32 Index = ConsacPlugin::IndexIn(Of(Agent.Place).Done, Name);
	return Index >= 0 ? &TheWorld->ActionLeaf(At(Agent.Place).Kind, static_cast<std::size_t>(Index)) : nullptr;
}

consac::Status FConsacHerd::SetObservation(const UConsacAgentComponent& Agent, FName Name, const float* Values, int32 Count)
{
	const int32 Index = Knows(Agent) ? ConsacPlugin::IndexIn(Of(Agent.Place).Seen, Name) : -1;
	if (Index < 0)
	{
		return consac::Status(consac::StatusCode::kNotFound, "there is no such observation");
	}
	const consac::Leaf& Leaf = TheWorld->ObservationLeaf(At(Agent.Place).Kind, static_cast<std::size_t>(Index));
	return ConsacPlugin::WriteLeaf(Leaf, Places[static_cast<std::size_t>(Agent.Place)].Row.data(), Values, Count);
}

consac::Status FConsacHerd::SetObservedChoice(const UConsacAgentComponent& Agent, FName Name, int32 Choice)
{
	const int32 Index = Knows(Agent) ? ConsacPlugin::IndexIn(Of(Agent.Place).Seen, Name) : -1;
	if (Index >= 0)
	{
		CONSAC_RETURN_IF_ERROR(ConsacPlugin::CheckChoice(TheWorld->ObservationLeaf(At(Agent.Place).Kind, static_cast<std::size_t>(Index)), Choice));
	}
	const float Number = static_cast<float>(Choice);
	return SetObservation(Agent, Name, &Number, 1);
}

consac::Status FConsacHerd::SetActionChoice(const UConsacAgentComponent& Agent, FName Name, int32 Choice)
{
	if (const consac::Leaf* Leaf = ActionLeaf(Agent, Name))
	{
		CONSAC_RETURN_IF_ERROR(ConsacPlugin::CheckChoice(*Leaf, Choice));
	}
	const float Number = static_cast<float>(Choice);
	return SetAction(Agent, Name, &Number, 1);
}

consac::Status FConsacHerd::SetAction(const UConsacAgentComponent& Agent, FName Name, const float* Values, int32 Count)
{
	const consac::Leaf* Leaf = ActionLeaf(Agent, Name);
	if (Leaf == nullptr || !Acts(Agent))
	{
		return consac::Status(consac::StatusCode::kNotFound, "there is no such action, or none is wanted now");
	}
	std::byte* Row = TheWorld->Action(Agent.Place);
	CONSAC_RETURN_IF_ERROR(ConsacPlugin::WriteLeaf(*Leaf, Row, Values, Count));
	for (int64 Index = 0; Index < Count; ++Index)
	{
		const std::pair<double, double> Bounds = consac::ElementBounds(*Leaf, Index);
		consac::WriteElement(*Leaf, Row, Index, std::clamp(consac::ReadElement(*Leaf, Row, Index), Bounds.first, Bounds.second));
	}
	return consac::Status::Ok();
}

bool FConsacHerd::SetAllowed(const UConsacAgentComponent& Agent, FName Name, int32 Choice, bool bAllowed)
{
	const consac::Leaf* Leaf = ActionLeaf(Agent, Name);
	if (Leaf == nullptr || Choice < 0 || Choice >= Leaf->mask_count)
	{
		return false;
	}
	std::vector<std::uint8_t>& Allowed = Places[static_cast<std::size_t>(Agent.Place)].Allowed;
	const std::size_t At = static_cast<std::size_t>(Leaf->mask_offset + Choice);
	if (At >= Allowed.size())
	{
		return false;
	}
	Allowed[At] = bAllowed ? 1 : 0;
	return true;
}

float FConsacHerd::GetActionNumber(const UConsacAgentComponent& Agent, FName Name, int32 Index, float Otherwise) const
{
	const consac::Leaf* Leaf = ActionLeaf(Agent, Name);
	const std::byte* Row = Leaf != nullptr ? ActionRow(Agent.Place) : nullptr;
	const bool bThere = Row != nullptr && Index >= 0 && Index < Leaf->count;
	return bThere ? static_cast<float>(consac::ReadElement(*Leaf, Row, Index)) : Otherwise;
}

bool FConsacHerd::GetAction(const UConsacAgentComponent& Agent, FName Name, TArray<float>& Values) const
{
	Values.Reset();
	const consac::Leaf* Leaf = ActionLeaf(Agent, Name);
	const std::byte* Row = Leaf != nullptr ? ActionRow(Agent.Place) : nullptr;
	if (Row == nullptr)
	{
		return false;
	}
	ConsacPlugin::ReadLeaf(*Leaf, Row, Values);
	return true;
}
