#pragma once
// The acting half of every on-policy algorithm: it acts by an ActorCritic, keeps a trajectory per slot, normalises,
// carries on the value of episodes that were cut, and lets agents come and go. What the trajectories are learned by is
// the algorithm's. Private to learn.

#include <optional>
#include <vector>

#include "collect/actor_critic.h"
#include "collect/slot_exploration.h"
#include "collect/step_memory.h"
#include "collect/unvalued_steps.h"
#include "collect/vec_normalise.h"
#include "consac/learn/buffer/rollout.h"

namespace consac::learn {

/// What becomes of an episode that was cut by a time limit: its value goes on (Stable Baselines3), or it counts as
/// ended (Stable Baselines 2).
enum class Truncation : std::uint8_t { kBootstrap, kTerminal };

/// How an on-policy algorithm collects.
struct RolloutOptions {
  std::int64_t n_steps = 128;                      ///< transitions per slot and rollout, T
  double gamma = 0.99;                             ///< discount per step
  double gae_lambda = 0.95;                        ///< decay of generalised advantages
  Truncation truncation = Truncation::kBootstrap;  ///< of episodes that were cut
  VecNormaliseOptions normalise;                   ///< its gamma is this one's
};

/// One rollout after another. `Stage`, `Begin`, `Act` and `Record` are a Learner's.
class RolloutCollector {
 public:
  /// Collects for `behaviour`, acting by `model`, which must outlive it.
  RolloutCollector(const BehaviourSpec& behaviour, const RolloutOptions& options, ActorCritic& model,
                   std::uint64_t seed, const Communicator& ranks);

  /// As Learner::StartFrom.
  Status StartFrom(const PolicyData& model);
  /// As Learner::Stage.
  Batch Stage(std::span<const std::int32_t> slots) {
    CONSAC_ASSERT(!full());
    return rollout_.Stage(slots);
  }
  /// As Learner::Begin: what a slot had of an episode is cut there.
  void Begin(const Batch& batch);
  /// As Learner::Act: actions are drawn.
  void Act(Batch& batch);
  /// As Learner::Record.
  void Record(const Batch& batch);
  /// A slot has no room left: time to learn.
  bool full() const { return rollout_.full(); }

  /// Fills advantages and returns of what was collected and lists its rows, slot after slot.
  std::span<std::int32_t> Finish();
  /// Starts the next rollout where this one ends, with what the other ranks saw in the moments. Before the model's
  /// parameters change: steps under way are valued by those that acted.
  void Restart() {
    FindValues();
    normalise_.Share();
    rollout_.Restart();
  }

  /// What was collected; its values are all there after Finish.
  const Rollout& rollout() const { return rollout_; }
  /// Writes the network inputs that row `row` was acted upon by, [F]. For any thread.
  void Encode(std::size_t row, float* features) const;
  /// The normaliser that acts.
  const ObservationNormaliser& normaliser() const { return normalise_.frozen(); }
  /// Agent steps recorded so far.
  std::int64_t steps() const { return steps_; }
  /// 1 - Var(returns - values) / Var(returns) over `rows`; NaN where the returns are all alike.
  double ExplainedVariance(std::span<const std::int32_t> rows) const;

  /// Everything, a rollout in progress included.
  void Visit(Archive& archive);

  /// Bytes that one transition of one agent takes, with raw actions of `raw_size` elements.
  static std::int64_t BytesOfTransition(const BehaviourSpec& behaviour, const RolloutOptions& options,
                                        std::int64_t raw_size);
  /// Those of them that Visit saves.
  static std::int64_t StateBytesOfTransition(const BehaviourSpec& behaviour, const RolloutOptions& options,
                                             std::int64_t raw_size);

 private:
  float ValueOf(const std::byte* observation);
  void BootstrapTruncated(const Batch& batch);
  void FindValues();

  const BehaviourSpec behaviour_;
  const RolloutOptions options_;
  const std::size_t feature_count_, raw_size_;
  ActorCritic& model_;
  VecNormalise normalise_;
  StepMemory memory_;
  Rollout rollout_;
  Rng action_rng_;
  SlotExploration exploration_;            // where the head follows the state
  std::optional<UnvaluedSteps> unvalued_;  // none: values are found with the actions
  std::int64_t steps_ = 0;
  std::vector<float> slab_features_;  // [T * N, F] network inputs as they were acted upon; empty: of the observations
  std::vector<float> step_rewards_;   // [N] of the batch under way
  std::vector<float> work_features_;  // [N, F]
  std::vector<float> last_values_;    // [N] of each slot's latest observation
  std::vector<std::int32_t> rows_;    // [T * N] of Finish
};

}  // namespace consac::learn
