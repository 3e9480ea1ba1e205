// Copyright CONSAC authors. MIT License.
// Groups of agents, and the world's parameters.
#include "ConsacHerd.h"

#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"

// Those of the agents that are there from the start, as their places will be: each kind's in this order.
std::vector<consac::GroupSpec> FConsacHerd::GroupsOf(const TArray<UConsacAgentComponent*>& Agents) const
{
	std::vector<consac::GroupSpec> Groups;
	if (Kinds.size() == 1) // each of its agents is a world of its own
	{
		return Groups;
	}
	std::vector<std::size_t> Placed(Kinds.size());
	for (const UConsacAgentComponent* Agent : Agents)
	{
		const std::string Behaviour = ConsacPlugin::ToUtf8(Agent->Behaviour);
		const auto Kind = std::find_if(Kinds.begin(), Kinds.end(), [&Behaviour](const FKind& Other) { return Other.Offering.name == Behaviour; });
		const std::size_t B = static_cast<std::size_t>(Kind - Kinds.begin());
		const std::size_t Place = Placed[B]++;
		if (Agent->Group == NAME_None)
		{
			continue;
		}
		const std::string Name = ConsacPlugin::ToKey(Agent->Group);
		auto Group = std::find_if(Groups.begin(), Groups.end(), [&Name](const consac::GroupSpec& Other) { return Other.name == Name; });
		if (Group == Groups.end())
		{
			Group = Groups.insert(Groups.end(), consac::GroupSpec{ Name, {} });
		}
		Group->members.push_back({ B, Place });
	}
	return Groups;
}

// One of its group; where those are taken, or a trainer knows of no such group, one of none.
consac::Result<consac::host::AgentId> FConsacHerd::PlaceFor(std::size_t Kind, FName Group)
{
	const std::vector<consac::GroupSpec>& Groups = TheWorld->spec().groups;
	const std::string Name = ConsacPlugin::ToKey(Group);
	const auto Found = std::find_if(Groups.begin(), Groups.end(), [&Name](const consac::GroupSpec& Other) { return Other.name == Name; });
	if (Group != NAME_None && Found != Groups.end())
	{
		consac::Result<consac::host::AgentId> Id = TheWorld->JoinGroup(Kind, static_cast<std::size_t>(Found - Groups.begin()));
		if (Id.ok())
		{
			return Id;
		}
	}
	return TheWorld->JoinGroup(Kind, consac::host::kNoGroup);
}

void FConsacHerd::AddGroupReward(FName Group, float Reward)
{
	std::size_t Told = consac::host::kNoGroup;
	for (std::size_t Index = 0; Index < Places.size(); ++Index)
	{
		FPlace& Taken = Places[Index];
		UConsacAgentComponent* Agent = Taken.Group == Group ? Taken.Agent.Get() : nullptr;
		if (Agent == nullptr || !Earns(*Agent))
		{
			continue;
		}
		Agent->EpisodeReward += Reward;
		Taken.Earning += Reward;
		const std::size_t Theirs = TheWorld->GroupOf(Agent->Place);
		if (Theirs == consac::host::kNoGroup)
		{
			TheWorld->AddReward(Agent->Place, Reward);
		}
		Told = Theirs != consac::host::kNoGroup ? Theirs : Told;
	}
	if (Told != consac::host::kNoGroup)
	{
		TheWorld->AddGroupReward(Told, Reward);
	}
}

consac::Result<double> FConsacHerd::GetParameter(const UConsacAgentComponent& Agent, FName Name) const
{
	const consac::Result<std::size_t> At = TheWorld->ParameterNamed(ConsacPlugin::ToKey(Name));
	if (!At.ok())
	{
		return At.status();
	}
	return Knows(Agent) ? TheWorld->Parameter(Agent.Place, *At) : TheWorld->spec().parameters[*At].default_value;
}
