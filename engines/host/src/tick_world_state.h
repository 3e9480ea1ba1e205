#pragma once
// What a TickWorld keeps for its agents. Private to host.

#include <vector>

#include "consac/env/noted_means.h"
#include "consac/host/tick_world.h"
#include "goal_prices.h"

namespace consac::host {

/// How the coming Offer leaves an agent's episode.
enum class Going : std::uint8_t { kOn, kTerminated, kTruncated };

/// One place for an agent.
struct Place {
  bool joined = false;       // an agent is there
  bool takes_part = false;   // and was at the latest Offer: what it does counts
  bool fresh = false;        // it came since then, perhaps to the place of one that took part
  bool has_final = false;    // its last observation was asked for, to be written
  bool resets = false;       // kReset: it is to begin anew
  Going going = Going::kOn;  // since the latest Offer
  float reward = 0.0f;       // since the latest Offer
  std::int64_t length = 0;   // steps of the episode under way
  double sum = 0.0;          // its rewards
  std::optional<std::uint64_t> seed;
};

/// Between which the numbers of a float32 leaf need no second look: its bounds, as far as they are finite.
struct Usual {
  explicit Usual(const Leaf& leaf);
  /// Whether all of a row's are. Without a branch for each: most numbers of most ticks are as they should be.
  bool Holds(const Leaf& leaf, const std::byte* row) const;
  /// From now on any finite number will do.
  void Widen();
  std::vector<float> low, high;  // [leaf.count]; empty for another type
};

/// The agents of one behaviour; rows by place.
struct Herd {
  explicit Herd(const BehaviourSpec& behaviour);
  std::size_t observation_bytes, action_bytes, mask_bytes;
  std::vector<std::size_t> observation_leaves, action_leaves;  // by entry
  AgentId first = 0;                                           // id of its place 0
  std::vector<Place> places;
  std::vector<std::uint8_t> present;  // [places] as of the latest Offer
  std::vector<std::byte> seen, last, done;
  std::vector<std::uint8_t> masks;
  std::vector<std::int64_t> choices;  // mask bytes of each choice; empty where nothing is masked
  std::vector<Usual> usual;           // [observation leaves]
  std::vector<std::uint8_t> outside;  // [observation leaves] a number beyond the bounds was told of
  GoalPrices goals;
  bool differed = false;  // what was paid and what goals are worth; it was told of
};

/// Mean over the latest 100 episodes.
class Window {
 public:
  Window() {
    rewards_.reserve(kEpisodes);
    lengths_.reserve(kEpisodes);
  }
  void Add(double reward, std::int64_t length);
  double mean_reward() const;
  double mean_length() const;
  std::int64_t count() const { return count_; }

 private:
  static constexpr std::size_t kEpisodes = 100;
  std::vector<double> rewards_, lengths_;
  std::int64_t count_ = 0;
};

/// All of it.
struct TickWorld::State {
  EnvSpec spec;
  std::int64_t max_episode_steps = 0;
  bool agents_leave = false;
  std::vector<Herd> herds;
  std::vector<std::size_t> behaviour_of;  // [places of all]
  Cue cue = Cue::kWait;
  std::vector<Batch> asked;  // one per behaviour while something is wanted
  std::int64_t steps = 0;
  Window window;
  std::vector<double> set;  // [environments, parameters] what episodes have that begin from now on
  std::vector<double> has;  // [agents, parameters] what those under way have
  bool notes = false;
  std::vector<Statistic> noted;       // for who drives
  NotedMeans means;                   // for the host's log
  std::vector<std::size_t> group_of;  // [places of all]
  std::vector<float> earned, paid;    // [groups] since the latest Offer; in the step that it ended

  Herd& HerdOf(AgentId agent) { return herds[behaviour_of[static_cast<std::size_t>(agent)]]; }
  std::size_t PlaceOf(AgentId agent) { return static_cast<std::size_t>(agent - HerdOf(agent).first); }
  Place& At(AgentId agent) { return HerdOf(agent).places[PlaceOf(agent)]; }
  std::size_t EnvironmentOf(AgentId agent) { return herds.size() == 1 ? PlaceOf(agent) : 0; }
  /// The episode that the agent begins has what is set by now.
  void TakeParameters(AgentId agent) {
    const std::size_t count = spec.parameters.size();
    for (std::size_t i = 0; i < count; ++i)
      has[static_cast<std::size_t>(agent) * count + i] = set[EnvironmentOf(agent) * count + i];
  }
  bool Known(AgentId agent) const { return agent >= 0 && static_cast<std::size_t>(agent) < behaviour_of.size(); }
};

}  // namespace consac::host
