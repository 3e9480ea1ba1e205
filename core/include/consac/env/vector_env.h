#pragma once
// A world as the trainer and the server see it: many copies that step as one batch. Worlds in this process implement
// it (worlds/), the environment server serves it, tests judge it. A world behind a connection is not one of these,
// because a connection can fail and Step cannot: see server/env_client.h.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "consac/base/archive.h"
#include "consac/env/batch.h"
#include "consac/env/parameters.h"
#include "consac/space/layout.h"

namespace consac {

/// One kind of agent: what it sees and does, and how many there are. Learned by a learner of its own.
struct BehaviourSpec {
  std::string name = "default";  ///< unique within the environment
  Space observation_space;       ///< what an agent sees
  Space action_space;            ///< what an agent does
  Layout observation_layout;     ///< of observation_space
  Layout action_layout;          ///< of action_space
  bool masks_actions = false;    ///< the world says at every step which actions are legal; false: masks stay null
  std::int32_t slots = 1;        ///< agents of this behaviour over all worlds: slot ids are 0..slots-1
  std::vector<std::string> agents = {"agent"};  ///< of one world; slot = world * agents.size() + place in this list

  /// Fills the layouts from the spaces.
  static BehaviourSpec Of(std::string name, Space observation_space, Space action_space, std::int32_t slots);
};

/// Agents of one world that are rewarded together.
struct GroupSpec {
  /// An agent by its places in EnvSpec::behaviours and BehaviourSpec::agents.
  struct Member {
    std::size_t behaviour = 0, agent = 0;
  };
  std::string name;             ///< unique within the environment
  std::vector<Member> members;  ///< at least one; an agent is in one group at most
};

/// What an environment offers.
struct EnvSpec {
  std::string id;                         ///< "road-v0"; "" for a foreign engine that has not said
  std::vector<BehaviourSpec> behaviours;  ///< at least one
  std::int64_t max_episode_steps = 0;     ///< time limit that truncates; 0: none
  double reward_threshold =
      std::numeric_limits<double>::quiet_NaN();  ///< mean return at which the world counts as solved; NaN: none
  std::vector<ParameterSpec> parameters;         ///< that a trainer may set; none unless SetParameters works
  std::vector<GroupSpec> groups;                 ///< the same in every world; mostly none
  bool deterministic = true;                     ///< equal seeds, actions and parameters give equal results

  /// Copies of the world: the same for every behaviour.
  std::int32_t environments() const {
    return behaviours[0].slots / static_cast<std::int32_t>(behaviours[0].agents.size());
  }
};

/// A number per slot that people want to see beside the reward: a distance, a score.
struct InfoColumn {
  std::string name;               ///< unique within the environment
  std::span<const float> values;  ///< [slots of all behaviours, in their order]; NaN: nothing to tell
};

/// A number that the game has noted, for logs: their mean over a while is told.
struct Statistic {
  std::string name;
  double value = 0.0;
};

/// What a world looks like.
struct Picture {
  std::int32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< [height, width, 3], rows from the top
};

/// N copies of a world, stepped together. Autoreset in the same step: a row whose episode ended carries its last
/// observation in `final_observations` and the first of its next episode in `next_observations`.
///
/// Agents may come and go: `present` says which slots have an agent. A row that ended and is no longer present has no
/// next episode of its own; it comes back when the world puts an agent there, at the latest when every agent of its
/// copy has ended and the copy begins anew, in that same step. Observations of absent slots are left alone, their
/// actions are not looked at.
///
/// Not thread-safe; separate objects are independent.
class VectorEnv {
 public:
  virtual ~VectorEnv() = default;
  /// What it offers; constant for life.
  virtual const EnvSpec& spec() const = 0;
  /// Starts every world afresh, world i from `seed` + i, and writes the first observations into
  /// batches[b].next_observations (and next_action_masks), b counting behaviours; batches hold every slot.
  virtual void Reset(std::uint64_t seed, std::span<Batch> batches) = 0;
  /// One step of every world: reads actions, writes everything below them. Never fails, never allocates.
  virtual void Step(std::span<Batch> batches) = 0;
  /// Starts one world afresh, from `seed` or, without one, going on with its own random numbers, and writes the first
  /// observations of its slots. `batches` hold every slot. False when this environment cannot.
  virtual bool ResetWorld(std::int32_t world, std::optional<std::uint64_t> seed, std::span<Batch> batches) {
    (void)world, (void)seed, (void)batches;
    return false;
  }
  /// True when Step takes batches that hold some of the slots only: all of those of the worlds that are to be stepped.
  virtual bool steps_some() const { return false; }
  /// One byte per slot of behaviour `b`: whether an agent is there, so that its action counts at the next step. As of
  /// the latest Reset or Step. Empty: all, always.
  virtual std::span<const std::uint8_t> present(std::size_t b) const {
    (void)b;
    return {};
  }
  /// False while what Reset, ResetWorld and Step write is still to come: a world that lives in its engine's ticks
  /// answers some ticks later, into the batches that were passed, and but for a Reset, or a ResetWorld after another,
  /// nothing is asked of it until then. EnvServer::Poll goes on with such a world when it has settled; whoever else
  /// steps worlds wants those that always are.
  virtual bool settled() const { return true; }
  /// The batches that were passed are no more: what is still to come is written nowhere.
  virtual void Abandon() {}
  /// Columns as of the latest Step; their names and number never change.
  virtual std::span<const InfoColumn> infos() const { return {}; }
  /// True when TakeStatistics ever brings any.
  virtual bool tells_statistics() const { return false; }
  /// Adds what was noted since the call before, a name as often as it was, and forgets it.
  virtual void TakeStatistics(std::vector<Statistic>* noted) { (void)noted; }
  /// What each of spec().groups was paid in the latest Step, [worlds, groups]; the rewards of its agents hold it
  /// already. Worlds that were not stepped are not looked at. Empty: nothing.
  virtual std::span<const float> group_rewards() const { return {}; }
  /// True when Render works.
  virtual bool renders() const { return false; }
  /// Draws world `world` as it is.
  virtual void Render(std::int32_t world, Picture* picture) { (void)world, (void)picture; }
  /// What episodes of world `world` have that begin from now on: `values` of spec().parameters, in their order, each
  /// legal for it, or NaN to leave it as it was set last; to begin with all are at their defaults. An episode under way
  /// goes on with what it has.
  virtual void SetParameters(std::int32_t world, std::span<const double> values) { (void)world, (void)values; }
  /// True when PriceGoals works.
  virtual bool prices_goals() const { return false; }
  /// What steps of behaviour `b` would have paid had they led to `observations`, [rows, observation row_bytes], whose
  /// wanted goals others have been put in the place of; rewards [rows] out. For learners that learn from goals that
  /// were not meant (hindsight experience replay). Depends on nothing else, and nothing depends on it.
  virtual void PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) const {
    (void)b, (void)observations, (void)rows, (void)rewards;
  }
  /// Exact state of all worlds, generators included.
  virtual void Visit(Archive& archive) = 0;
};

/// Every parameter of every world is at its default, as before anybody set one.
void SetDefaultParameters(VectorEnv& env);

}  // namespace consac
