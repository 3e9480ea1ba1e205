// Copyright CONSAC authors. MIT License.
// What a herd's agents see, do and earn, in words: for the screen and the Visual Logger.
#include "ConsacAgentComponent.h"
#include "ConsacConvert.h"
#include "ConsacHerd.h"
#include "GameFramework/Actor.h"

namespace ConsacPlugin
{

// An entry's numbers; of a long one, a picture for instance, the first and how many there are.
static void AddNumbers(const consac::Leaf& Leaf, FName Name, const std::byte* Row, std::string& Text)
{
	constexpr int64 Most = 8;
	Text += " " + ToUtf8(Name.ToString().ToLower());
	for (int64 Index = 0; Index < Leaf.count && Index < Most; ++Index)
	{
		Text += " " + ToUtf8(FString::Printf(TEXT("%.4g"), consac::ReadElement(Leaf, Row, Index)));
	}
	if (Leaf.count > Most)
	{
		Text += " ... of " + std::to_string(Leaf.count);
	}
}

}

FString FConsacHerd::DescribeOne(consac::host::AgentId Id) const
{
	const FPlace& Taken = Places[static_cast<std::size_t>(Id)];
	const UConsacAgentComponent* Agent = Taken.Agent.Get();
	if (Agent == nullptr)
	{
		return FString();
	}
	const std::size_t Behaviour = TheWorld->BehaviourOf(Id);
	const FKind& Kind = Kinds[Behaviour];
	std::string Text = ConsacPlugin::ToUtf8(Agent->GetOwner() != nullptr ? Agent->GetOwner()->GetName() : Agent->GetName()) + " (" + Kind.Offering.name + ") sees";
	for (int32 Entry = 0; Entry < Kind.Seen.Num(); ++Entry)
	{
		ConsacPlugin::AddNumbers(TheWorld->ObservationLeaf(Behaviour, static_cast<std::size_t>(Entry)), Kind.Seen[Entry], Taken.Row.data(), Text);
	}
	if (const std::byte* Row = ActionRow(Id))
	{
		Text += "; does";
		for (int32 Entry = 0; Entry < Kind.Done.Num(); ++Entry)
		{
			ConsacPlugin::AddNumbers(TheWorld->ActionLeaf(Behaviour, static_cast<std::size_t>(Entry)), Kind.Done[Entry], Row, Text);
		}
	}
	return FString::Printf(TEXT("%s; earned %.4g, in the episode %.4g in %lld steps"), *ConsacPlugin::FromUtf8(Text), static_cast<double>(Taken.Earned),
		static_cast<double>(Agent->EpisodeReward), Agent->EpisodeSteps);
}

std::vector<FString> FConsacHerd::Describe(int32 Most) const
{
	std::vector<FString> Lines;
	for (consac::host::AgentId Id = 0; Id < TheWorld->places() && static_cast<int32>(Lines.size()) < Most; ++Id)
	{
		FString Line = DescribeOne(Id);
		if (!Line.IsEmpty())
		{
			Lines.push_back(MoveTemp(Line));
		}
	}
	return Lines;
}
