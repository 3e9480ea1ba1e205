// Copyright CONSAC authors. MIT License.
#include "ConsacHerd.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacFarewell.h"
#include "ConsacSensorComponent.h"
#include "UObject/UObjectGlobals.h"

namespace ConsacPlugin
{

static consac::Status AddEntry(FName Name, const FConsacSpace& Space, std::vector<consac::host::Entry>& Into, TArray<FName>& Names)
{
	consac::Result<consac::Space> Converted = ToSpace(Space);
	// A packaged game spells a name as whoever came first did: the same entry must be the same text everywhere.
	const std::string Text = ToUtf8(Name.ToString().ToLower());
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

static bool SameEntries(const std::vector<consac::host::Entry>& Left, const std::vector<consac::host::Entry>& Right)
{
	return std::equal(Left.begin(), Left.end(), Right.begin(), Right.end(),
		[](const consac::host::Entry& One, const consac::host::Entry& Other) { return One.name == Other.name && One.space == Other.space; });
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
		if (UConsacAgentComponent* Agent = Taken.Agent.Get())
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
	consac::Status Status;
	for (const FConsacEntry& Entry : Agent.Observations)
	{
		Status = Status.ok() ? ConsacPlugin::AddEntry(Entry.Name, Entry.Space, Kind.Offering.observations, Kind.Seen) : Status;
	}
	for (const UConsacSensorComponent* Sensor : Agent.Sensors)
	{
		if (Status.ok() && IsValid(Sensor))
		{
			Status = ConsacPlugin::AddEntry(Sensor->ObservationName, Sensor->GetSpace(), Kind.Offering.observations, Kind.Seen);
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

consac::Status FConsacHerd::Gather(const TArray<UConsacAgentComponent*>& Agents, int32 Room)
{
	bRoom = Room > 0;
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
	Options.agents_leave = bRoom;
	for (FKind& Kind : Kinds)
	{
		Kind.Offering.agents = Kind.Offering.agents < Room ? Room : Kind.Offering.agents;
		Options.offerings.push_back(Kind.Offering);
	}
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
			!ConsacPlugin::SameEntries(Shared.Offering.actions, Kind->Offering.actions) || Shared.Offering.masks_actions != Kind->Offering.masks_actions)
		{
			return consac::Status(consac::StatusCode::kInvalidArgument, "the agent " + ConsacPlugin::ToUtf8(Agent.GetName()) +
				" sees or does something else than others of behaviour '" + Shared.Offering.name + "'; give it a behaviour of its own");
		}
		// Where agents do not come and go, a place whose agent is gone is still joined: it is taken over.
		consac::host::AgentId Id = consac::host::kNoAgent;
		for (int32 Index = Shared.Place; !bRoom && Index < Shared.Place + Shared.Offering.agents && Id == consac::host::kNoAgent; ++Index)
		{
			Id = TheWorld->Joined(Index) && Places[static_cast<std::size_t>(Index)].Agent.Get() == nullptr ? Index : consac::host::kNoAgent;
		}
		const bool bTakesOver = Id != consac::host::kNoAgent;
		if (!bTakesOver)
		{
			const consac::Result<consac::host::AgentId> Joined = TheWorld->Join(B);
			if (!Joined.ok())
			{
				return Joined.status();
			}
			Id = *Joined;
		}
		const consac::BehaviourSpec& Behaviour = TheWorld->spec().behaviours[B];
		FPlace& Taken = Places[static_cast<std::size_t>(Id)];
		// The place has gone on without an agent: the newcomer begins an episode of its own.
		Taken.bGone = bTakesOver;
		Taken.Agent = &Agent;
		Taken.Row.assign(Behaviour.observation_layout.row_bytes, std::byte{0});
		Taken.Allowed.assign(static_cast<std::size_t>(Behaviour.masks_actions ? Behaviour.action_layout.mask_bytes : 0), std::uint8_t{1});
		Taken.bNew = true;
		Taken.bShown = false;
		Agent.Herd = this;
		Agent.Place = Id;
		return consac::Status::Ok();
	}
	return consac::Status(consac::StatusCode::kNotFound, "no agent of behaviour '" + Kind->Offering.name + "' was there when the training began");
}

consac::Status FConsacHerd::Join(UConsacAgentComponent& Agent)
{
	CONSAC_RETURN_IF_ERROR(Place(Agent));
	BeginEpisode(Agent.Place, -1);
	return consac::Status::Ok();
}

void FConsacHerd::Leave(UConsacAgentComponent& Agent)
{
	if (Knows(Agent))
	{
		FPlace& Left = Places[static_cast<std::size_t>(Agent.Place)];
		Left.Agent = nullptr;
		Left.bGone = !bRoom;
		if (bRoom)
		{
			TheWorld->Leave(Agent.Place);
		}
	}
	Agent.Herd = nullptr;
	Agent.Place = -1;
}

bool FConsacHerd::Knows(const UConsacAgentComponent& Agent) const
{
	return Agent.Place >= 0 && static_cast<std::size_t>(Agent.Place) < Places.size() && Places[static_cast<std::size_t>(Agent.Place)].Agent.Get() == &Agent;
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
	if (Knows(Agent) && IsActing() && !Places[static_cast<std::size_t>(Agent.Place)].bNew)
	{
		TheWorld->AddReward(Agent.Place, Reward);
		Agent.EpisodeReward += Reward;
	}
}

void FConsacHerd::EndEpisode(const UConsacAgentComponent& Agent, consac::host::EpisodeEnd End)
{
	if (Knows(Agent) && IsActing() && !bJudged && !Places[static_cast<std::size_t>(Agent.Place)].bNew)
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
	return Index >= 0 ? &TheWorld->ActionLeaf(TheWorld->BehaviourOf(Agent.Place), static_cast<std::size_t>(Index)) : nullptr;
}

consac::Status FConsacHerd::SetObservation(const UConsacAgentComponent& Agent, FName Name, const float* Values, int32 Count)
{
	const int32 Index = Knows(Agent) ? ConsacPlugin::IndexIn(Of(Agent.Place).Seen, Name) : -1;
	if (Index < 0)
	{
		return consac::Status(consac::StatusCode::kNotFound, "there is no such observation");
	}
	const consac::Leaf& Leaf = TheWorld->ObservationLeaf(TheWorld->BehaviourOf(Agent.Place), static_cast<std::size_t>(Index));
	return ConsacPlugin::WriteLeaf(Leaf, Places[static_cast<std::size_t>(Agent.Place)].Row.data(), Values, Count);
}

consac::Status FConsacHerd::SetAction(const UConsacAgentComponent& Agent, FName Name, const float* Values, int32 Count)
{
	const consac::Leaf* Leaf = ActionLeaf(Agent, Name);
	if (Leaf == nullptr || !IsActing())
	{
		return consac::Status(consac::StatusCode::kNotFound, "there is no such action, or none is wanted now");
	}
	return ConsacPlugin::WriteLeaf(*Leaf, TheWorld->Action(Agent.Place), Values, Count);
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
	const bool bThere = Leaf != nullptr && IsActing() && Index >= 0 && Index < Leaf->count;
	return bThere ? static_cast<float>(consac::ReadElement(*Leaf, TheWorld->Action(Agent.Place), Index)) : Otherwise;
}

bool FConsacHerd::GetAction(const UConsacAgentComponent& Agent, FName Name, TArray<float>& Values) const
{
	Values.Reset();
	const consac::Leaf* Leaf = ActionLeaf(Agent, Name);
	if (Leaf == nullptr || !IsActing())
	{
		return false;
	}
	ConsacPlugin::ReadLeaf(*Leaf, TheWorld->Action(Agent.Place), Values);
	return true;
}
