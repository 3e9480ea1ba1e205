#pragma once
// A ReplayCollector of continuous actions, with the exploration that belongs to it: before learning_starts all actions
// are uniform, afterwards what the policy chose, with noise. Private to learn.

#include <utility>

#include "collect/continuous_exploration.h"
#include "collect/replay_collector.h"
#include "collect/slot_exploration.h"

namespace consac::learn {

/// `Begin`, `Act` and `Record` are a Learner's.
class ContinuousCollector final : public ReplayCollector {
 public:
  /// As ReplayCollector.
  ContinuousCollector(const BehaviourSpec& behaviour, ActionHead head, const ReplayCollectorOptions& options,
                      const ContinuousExplorationOptions& exploration, std::uint64_t seed, const Communicator& ranks)
      : ReplayCollector(behaviour, std::move(head), options, seed, ranks),
        exploration_(exploration, behaviour.slots, action_head().raw_size(), seed),
        slot_exploration_(action_head(), behaviour.slots, seed),
        policy_warms_up_(exploration.policy_warms_up) {}

  /// As Learner::Begin.
  void Begin(const Batch& batch) {
    ReplayCollector::Begin(batch);
    for (const std::int32_t slot : batch.slots) exploration_.Begin(slot);
  }
  /// As Learner::Act: `choose`(acting) writes the policy's raw actions, unless they are random anyway.
  template <class Choose>
  void Act(Batch& batch, Choose&& choose) {
    const Acting acting = BeginAct(batch);
    const bool random = warming_up() && !policy_warms_up_;
    if (!random) choose(acting);
    exploration_.Explore(batch.slots, random, acting.raw);
    FinishAct(batch);
  }
  /// What those slots explore by, for Act, where the head follows the state: drawn anew at the beginning of a round of
  /// collecting, and as often as the head says.
  SlotNoise ExploreByState(std::span<const std::int32_t> slots, const float* log_std) {
    return slot_exploration_.Act(action_head(), slots, log_std,
                                 [this](std::int32_t slot) { return round_steps(slot); });
  }
  /// As Learner::Record; true when a report is to be made.
  [[nodiscard]] bool Record(const Batch& batch) {
    exploration_.Record(batch);
    return ReplayCollector::Record(batch);
  }

  /// Everything.
  void Visit(Archive& archive) {
    ReplayCollector::Visit(archive);
    exploration_.Visit(archive);
    slot_exploration_.Visit(archive);
  }

 private:
  ContinuousExploration exploration_;
  SlotExploration slot_exploration_;
  bool policy_warms_up_;
};

}  // namespace consac::learn
