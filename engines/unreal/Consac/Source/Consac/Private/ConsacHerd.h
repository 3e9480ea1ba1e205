// Copyright CONSAC authors. MIT License.
// All agents of a world as one TickWorld: who has which place, what each sees and does, and when.
#pragma once

#include "CoreMinimal.h"
#include "ConsacCoreInclude.h"
#include "ConsacTypes.h"
#include "UObject/WeakObjectPtrTemplates.h"

class UConsacAgentComponent;
struct FConsacFarewell;

/** Game thread only. Agents may come, go and be destroyed in any event. */
class FConsacHerd
{
public:
	~FConsacHerd();

	/** Gathers agents that have begun to play. The error names the agent or the entry that does not fit.
	 *  @param Room Places of each kind of agent where they come and go; 0: as many as there are now.
	 *  @param Parameters Numbers of the world that a trainer may set. */
	consac::Status Gather(const TArray<UConsacAgentComponent*>& Agents, int32 Room, const TArray<FConsacParameter>& Parameters = {});
	/** An agent more, unless it has a place already; kResourceExhausted when every place of its kind is taken. */
	consac::Status Join(UConsacAgentComponent& Agent);
	/** It has gone: its episode is truncated where it was last seen, and its place takes no part until another one has it. */
	void Leave(UConsacAgentComponent& Agent);
	/** For who leaves while the game goes on: a line in the log, once. */
	void SayThatItLeaves(const UConsacAgentComponent& Agent);

	/** What a driver drives. */
	consac::host::TickWorld& World() { return *TheWorld; }
	/** Ticks from one decision to the next. */
	int32 Period() const { return Ticks; }
	/** Names of the kinds of agents. */
	std::vector<std::string> Behaviours() const;
	/** Takes down every step from now on. */
	void Record();
	/** From now on what agents see decides what they do a tick later: what they earn meanwhile counts, and the action before can be read. */
	void Pipeline() { bPipelined = true; }
	/** Whether it is so. */
	bool IsPipelined() const { return bPipelined; }
	/** How often what the agents see was offered so far. */
	int64 Looks() const { return Offers; }
	/** Gives away what is no agent's; to be destroyed right after. */
	void Release(FConsacFarewell& Into);

	/** Begins the episodes that the world wants begun, and says what the agents see first. */
	consac::Status Begin();
	/** Hands the decision to the agents.
	 *  @param bByHand Their own event chooses. */
	void Act(bool bByHand);
	/** Whether a decision is being carried out. */
	bool IsActing() const { return bActing && TheWorld->cue() == consac::host::Cue::kAct; }
	/** What came of the decision; to be called when its ticks have passed. */
	consac::Status Settle();

	/** What each agent sees, does and earns, a line each; for at most so many. Costs memory: for people who look. */
	std::vector<FString> Describe(int32 Most) const;

	// What agents say and ask; each is safe at any time and for any name.
	void AddReward(UConsacAgentComponent& Agent, float Reward);
	void AddGroupReward(FName Group, float Reward);
	void EndEpisode(const UConsacAgentComponent& Agent, consac::host::EpisodeEnd End);
	consac::Result<double> GetParameter(const UConsacAgentComponent& Agent, FName Name) const;
	consac::Status SetObservation(const UConsacAgentComponent& Agent, FName Name, const float* Values, int32 Count);
	consac::Status SetObservedChoice(const UConsacAgentComponent& Agent, FName Name, int32 Choice);
	consac::Status SetAction(const UConsacAgentComponent& Agent, FName Name, const float* Values, int32 Count);
	consac::Status SetActionChoice(const UConsacAgentComponent& Agent, FName Name, int32 Choice);
	bool SetAllowed(const UConsacAgentComponent& Agent, FName Name, int32 Choice, bool bAllowed);
	/** One number of an action; `Otherwise` where there is none. */
	float GetActionNumber(const UConsacAgentComponent& Agent, FName Name, int32 Index, float Otherwise) const;
	bool GetAction(const UConsacAgentComponent& Agent, FName Name, TArray<float>& Values) const;

private:
	/** A kind of agent. */
	struct FKind
	{
		consac::host::Offering Offering;
		TArray<FName> Seen;   // names of the observations, the sensors' last
		TArray<FName> Done;   // names of the actions
		int32 Place = 0;      // the first place
	};
	/** A place of the world. */
	struct FPlace
	{
		TWeakObjectPtr<UConsacAgentComponent> Agent;
		FName Group;
		std::size_t Kind = 0;
		std::vector<std::byte> Row;         // what it sees
		std::vector<std::uint8_t> Allowed;  // its mask; empty where none is forbidden
		std::vector<std::byte> Held;        // pipelined: the action that stands until the next; empty where none does
		std::size_t Acts = 0;               // bytes of an action
		float Earning = 0.0f;               // by the latest decision, so far
		float Earned = 0.0f;                // by the one before
		bool bNew = true;                   // no decision was made for it yet
		bool bShown = false;                // what it sees was offered: a decision can be made for it
		bool bBegins = false;               // its episode ends with this step, and its last observation is written
	};

	std::vector<consac::GroupSpec> GroupsOf(const TArray<UConsacAgentComponent*>& Agents) const;
	consac::Result<consac::host::AgentId> PlaceFor(std::size_t Kind, FName Group);
	static consac::Result<FKind> KindOf(const UConsacAgentComponent& Agent);
	consac::Status Place(UConsacAgentComponent& Agent);
	const FPlace& At(consac::host::AgentId Id) const { return Places[static_cast<std::size_t>(Id)]; }
	const FKind& Of(consac::host::AgentId Id) const { return Kinds[At(Id).Kind]; }
	bool Knows(const UConsacAgentComponent& Agent) const;
	/** Whether it carries out the decision: no newcomer does. */
	bool Acts(const UConsacAgentComponent& Agent) const;
	/** Whether what it earns, or how its episode ends, counts now. */
	bool Earns(const UConsacAgentComponent& Agent) const;
	/** The action that the agent there carries out; null where there is none. */
	const std::byte* ActionRow(consac::host::AgentId Id) const;
	const consac::Leaf* ActionLeaf(const UConsacAgentComponent& Agent, FName Name) const;
	void BeginEpisode(consac::host::AgentId Id, int64 Seed);
	void Prepare(consac::host::AgentId Id);
	void Observe(consac::host::AgentId Id);
	void Publish(consac::host::AgentId Id);
	void Judge(consac::host::AgentId Id);
	void CutOff(consac::host::AgentId Id);
	void Turn(consac::host::AgentId Id);
	void Earn(consac::host::AgentId Id);
	FString DescribeOne(consac::host::AgentId Id) const;
	void NoteLength(const UConsacAgentComponent& Agent);
	consac::Status Offer();

	std::unique_ptr<consac::host::TickWorld> TheWorld;
	std::vector<FKind> Kinds;
	std::vector<FPlace> Places;
	std::vector<std::unique_ptr<consac::host::Recorder>> Recorders;
	TArray<float> Sensed;
	int32 Ticks = 1;
	bool bSenses = false;  // somebody has sensors
	bool bGoalsPay = false; // some goals pay
	bool bTimeIsUp = false; // for somebody, in this step
	int32 ShortOnes = 0;   // episodes in a row that ended with their first step
	bool bSaidShort = false;
	bool bSaidWhoLeft = false;
	bool bActing = false;
	int64 Offers = 0;
	bool bPipelined = false;
	bool bWaiting = false; // pipelined: between what was seen and what is to be done
	bool bJudged = false;  // which episodes end with this step is settled
};
