#pragma once
// A world that lives in an engine's ticks. Its agents step all together, and a step takes as many ticks as the engine
// wants: whoever drives it (driver.h) asks for a step and goes on; the engine carries it out and offers what came of
// it. Used by the plug-ins for Unreal and Godot. Knows no engine, no connection and no learning.
//
//   driver->Poll(0.0);                       once a tick: never waits
//   switch (world->cue()) {
//     case Cue::kWait:  return;              nobody wants anything of the agents yet
//     case Cue::kReset: for every agent that Resets(): put it at its start
//     case Cue::kAct:   for every agent: carry out Action(), let ticks pass, AddReward(), perhaps EndEpisode();
//                       for every agent that is Ending(): write FinalObservation(), put it at its start
//   }
//   for every agent: write Observation();
//   world->Offer();

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/env/vector_env.h"

namespace consac::host {

/// An agent of a TickWorld: its row over all behaviours, from 0. Stays its own until it leaves.
using AgentId = std::int32_t;
/// No agent.
inline constexpr AgentId kNoAgent = -1;
/// No group, where the place of one in TickWorldOptions::groups is meant.
inline constexpr std::size_t kNoGroup = static_cast<std::size_t>(-1);

/// A named part of what an agent sees or does.
struct Entry {
  std::string name;  ///< unique within its list; not empty
  Space space;       ///< any, but Dict and Tuple
};

/// What a step pays that leads to an observation with goals.
enum class GoalReward : std::uint8_t {
  kNone,      ///< goals are not priced: nothing can be learned from those that were not meant
  kSparse,    ///< 0 where the achieved goal is within Goals::threshold of the desired one, else -1
  kDense,     ///< minus the distance between them
  kFunction,  ///< what Goals::price says
};

/// The goals of one kind of agent, as Gymnasium has them: entries "achieved_goal" and "desired_goal" of equal spaces,
/// whose distance is Euclidean, over all their numbers, in their own units. What learners of goals that were not meant
/// (hindsight experience replay) ask for, here and over a connection (protocol 2, section 13).
struct Goals {
  GoalReward reward = GoalReward::kNone;  ///< of a step, by the observation that it led to
  double threshold = 0.05;                ///< kSparse: 0 or more
  /// The world pays by it, and what AddReward brings is left out: what is paid and what is priced cannot differ. False:
  /// AddReward alone pays, and is to come to the same; a warning, once, names where it does not.
  bool pays = true;
  /// kFunction: writes what steps pay that lead to `observations`, [rows, observation row_bytes]; rewards [rows] out.
  /// Called by the world's thread alone: a training inside that learns at every step then learns there too. Follows
  /// from the two goals of a row.
  std::function<void(const std::byte* observations, std::int64_t rows, float* rewards)> price;
};

/// One kind of agent.
struct Offering {
  std::string name = "default";     ///< unique within the world
  std::vector<Entry> observations;  ///< one: the space is this entry's own; several: a Dict of them
  std::vector<Entry> actions;       ///< likewise
  std::int32_t agents = 1;          ///< room for so many at once
  bool masks_actions = false;       ///< the host writes ActionMask() at every step
  Goals goals;                      ///< where it has some
};

/// What a world is made of.
struct TickWorldOptions {
  std::string id;                      ///< "road-v0"; "" is no name
  std::vector<Offering> offerings;     ///< at least one
  std::int64_t max_episode_steps = 0;  ///< then an agent's episode is truncated; 0: never
  bool agents_leave = false;           ///< Join and Leave while it runs; false: every agent joins before the first cue
  std::vector<ParameterSpec> parameters;  ///< that a trainer may set; Parameter() says what an episode has of them
  bool notes = false;                     ///< the host calls Note(): a trainer's log has what it notes
  /// Agents that are rewarded together, by offering and place; with several offerings, whose agents share one world.
  /// None of an offering whose goals have a reward: what a group earns does not follow from goals.
  std::vector<GroupSpec> groups;
};

/// What the host is to do now.
enum class Cue : std::uint8_t {
  kWait,   ///< nothing
  kReset,  ///< begin episodes anew, then Offer their first observations
  kAct,    ///< carry out the actions, then Offer what came of them
};

/// How an agent's episode ended.
enum class EpisodeEnd : std::uint8_t {
  kTerminated,  ///< in a terminal state
  kTruncated,   ///< it was cut (time limit); its state is not terminal
};

/// What the world has seen so far, for people.
struct Tally {
  std::int64_t steps = 0;            ///< of single agents
  std::int64_t episodes = 0;         ///< that ended
  double mean_episode_reward = 0.0;  ///< of the last 100 that ended; NaN before the first
  double mean_episode_length = 0.0;  ///< likewise
};

/// Agents of an engine as a VectorEnv whose steps settle later. One behaviour: each agent is an environment of its own,
/// whose episodes begin and end by themselves. Several: one environment that holds all agents. One thread.
class TickWorld final : public VectorEnv {
 public:
  /// Checks the entries; the error names behaviour and entry. kResourceExhausted where the agents' rows would take
  /// more than 1 GiB.
  static Result<std::unique_ptr<TickWorld>> Create(TickWorldOptions options);
  ~TickWorld() override;

  // ---- the host's side

  /// An agent takes a free place of behaviour `b`; kResourceExhausted when there is none. While the world runs it takes
  /// part from the next Offer on.
  Result<AgentId> Join(std::size_t b);
  /// The same for a place of this group alone, or kNoGroup: of none.
  Result<AgentId> JoinGroup(std::size_t b, std::size_t group);
  /// Its place is free again; its episode, if one was under way, is truncated where it was last seen.
  void Leave(AgentId agent);
  /// Whether this agent is there.
  bool Joined(AgentId agent) const;
  /// Places, taken or not: agent ids are below this.
  std::int32_t places() const;
  /// Which behaviour a place belongs to.
  std::size_t BehaviourOf(AgentId agent) const;
  /// The leaf of entry `index` (of Offering::observations) in rows of Observation().
  const Leaf& ObservationLeaf(std::size_t b, std::size_t index) const;
  /// The leaf of entry `index` (of Offering::actions) in rows of Action().
  const Leaf& ActionLeaf(std::size_t b, std::size_t index) const;

  /// What is wanted of the host.
  Cue cue() const;
  /// kReset: whether this agent is to begin anew. Others go on as they are.
  bool Resets(AgentId agent) const;
  /// kReset: what to seed the agent's episode with; empty: go on with its own random numbers.
  std::optional<std::uint64_t> Seed(AgentId agent) const;
  /// What the agent's episode has of parameter `index` (of TickWorldOptions::parameters): of one that Resets, is Ending
  /// or has just joined, what its next one has. So it is read where the agent is put at its start, or at any time.
  double Parameter(AgentId agent, std::size_t index) const;
  /// What its next episode has, were it to begin now: for a host that begins one before it tells of the end.
  double NextParameter(AgentId agent, std::size_t index) const;
  /// Its place by name; kNotFound names the nearest.
  Result<std::size_t> ParameterNamed(std::string_view name) const { return FindParameter(spec().parameters, name); }
  /// A number for the trainer's log, which tells the mean of those since it told it last, and for the host's own
  /// (TakeMeans). kInvalidArgument for what is no name, kNonFinite; then nothing is noted. Without `notes` no trainer
  /// elsewhere hears of it.
  Status Note(std::string_view name, double value);
  /// For a line in the host's log, whoever drives: the mean of what was noted since the call before, of each name once.
  /// Names beyond NotedMeans::kMostNames are left out.
  std::vector<Statistic> TakeMeans();
  /// The group that a place is of; kNoGroup for none.
  std::size_t GroupOf(AgentId agent) const;
  /// What the agents of a group earn together since the latest Offer: AddReward to each of them that takes part.
  void AddGroupReward(std::size_t group, float reward);
  /// The same where the host pays each of them itself, by AddReward: who drives is told, and nobody is paid.
  void TellGroupReward(std::size_t group, float reward);
  /// kAct: what the agent is to do; [action row_bytes]. The host may write it, where a person plays.
  std::byte* Action(AgentId agent);
  /// Reward since the latest Offer is summed. Where goals pay (Goals::pays) it counts for nothing.
  void AddReward(AgentId agent, float reward);
  /// The agent's episode has ended; the first call before an Offer counts.
  void EndEpisode(AgentId agent, EpisodeEnd end);
  /// Whether the coming Offer ends the agent's episode, by EndEpisode or by the time limit.
  bool Ending(AgentId agent) const;
  /// The last observation of an episode that is Ending; [observation row_bytes].
  std::byte* FinalObservation(AgentId agent);
  /// What the agent sees, or sees first in its next episode; [observation row_bytes].
  std::byte* Observation(AgentId agent);
  /// Which actions are legal; [mask_bytes], null when the behaviour masks none.
  std::uint8_t* ActionMask(AgentId agent);
  /// kAct, its observations written: what the coming Offer pays the agent, by its goals where those pay.
  float Reward(AgentId agent) const;
  /// Everything is written: the cue is done with. kNonFinite names a NaN or infinity; it was offered as 0.
  /// A number beyond its bounds is offered as it is, with a warning once for each entry.
  /// kFailedPrecondition when nothing is wanted.
  Status Offer();
  /// What came of it so far.
  Tally tally() const;

  // ---- the driver's side (VectorEnv). Batches that were passed are written at Offer and must live until then.

  const EnvSpec& spec() const override;
  void Reset(std::uint64_t seed, std::span<Batch> batches) override;
  void Step(std::span<Batch> batches) override;
  bool ResetWorld(std::int32_t world, std::optional<std::uint64_t> seed, std::span<Batch> batches) override;
  bool steps_some() const override;
  std::span<const std::uint8_t> present(std::size_t b) const override;
  bool settled() const override;
  void SetParameters(std::int32_t world, std::span<const double> values) override;
  bool tells_statistics() const override;
  void TakeStatistics(std::vector<Statistic>* noted) override;
  std::span<const float> group_rewards() const override;
  /// True where some behaviour has a GoalReward, and each that has goals does.
  bool prices_goals() const override;
  /// Any thread may ask while the world lives, but of a GoalReward::kFunction.
  void PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) const override;
  /// Whether behaviour `b` has a GoalReward, and whether only the world's thread may ask for its prices.
  bool prices_goals_of(std::size_t b) const;
  bool prices_here_only(std::size_t b) const;
  /// Counts only: the engine's own state is the engine's.
  void Visit(Archive& archive) override;
  /// Forgets what was asked for: the cue is kWait, agents stay where they are.
  void Abandon() override;
  /// Ok when every place is taken, or agents may come and go; a driver begins only then.
  Status EveryoneJoined() const;

 private:
  friend class Recorder;
  struct State;
  bool Acts(AgentId agent) const;
  Status OfferPlace(std::size_t b, std::size_t index, std::size_t row, Batch& batch);
  void Count(struct Place& place);
  Result<AgentId> JoinOne(std::size_t b, std::optional<std::size_t> group);
  explicit TickWorld(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace consac::host
