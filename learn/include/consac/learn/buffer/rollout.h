#pragma once
// What an on-policy algorithm collects between two updates: a trajectory per slot in one slab [T, N]. When all slots
// step together, the slab is the batch: worlds write into it in place. When a part of the slots steps (engines that
// answer at their own pace), each slot's trajectory grows by itself and the batch is copied in.
// Not for replay: everything is thrown away after an update.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/archive.h"
#include "consac/env/buffer.h"
#include "consac/env/vector_env.h"

namespace consac::learn {

/// Storage of one rollout. A row of the slab is t * N + slot.
class Rollout {
 public:
  /// Room for `n_steps` transitions of every slot of `behaviour`; `raw_size` numbers of raw action each.
  Rollout(const BehaviourSpec& behaviour, std::int64_t n_steps, std::int64_t raw_size);

  /// First observations of slots: they stand at each slot's present time.
  void Begin(const Batch& batch);
  /// The batch that the next transition of `slots` is written to. In place when it is all of them in step.
  Batch Stage(std::span<const std::int32_t> slots);
  /// Takes the staged batch in and moves its slots on by one step.
  void Commit(const Batch& batch);
  /// The row of the slab that slot `slot` stands at.
  std::int64_t RowOf(std::int32_t slot) const { return time_[static_cast<std::size_t>(slot)] * slots_ + slot; }
  /// True when a slot has no room for another transition: time to learn.
  bool full() const { return full_; }
  /// Starts the next rollout: each slot's latest observation becomes its first.
  void Restart();

  /// Transitions collected.
  std::int64_t size() const;
  /// Transitions of slot `slot`.
  std::int64_t length(std::int32_t slot) const { return time_[static_cast<std::size_t>(slot)]; }
  /// Slots, N.
  std::int64_t slot_count() const { return slots_; }
  /// Longest trajectory, T.
  std::int64_t n_steps() const { return n_steps_; }
  /// Writes the slab rows of all transitions, slot after slot, into `rows` [N * T]; returns how many.
  std::int64_t ListRows(std::span<std::int32_t> rows) const;

  /// Observation rows in the world's own form: [(T + 1) * N, row_bytes].
  std::byte* observations(std::int64_t row) {
    return bytes_.data() + static_cast<std::size_t>(row) * observation_bytes_;
  }
  /// The same, to read.
  const std::byte* observations(std::int64_t row) const {
    return bytes_.data() + static_cast<std::size_t>(row) * observation_bytes_;
  }
  /// Legal-action masks [(T + 1) * N, mask_bytes], or null.
  std::uint8_t* masks(std::int64_t row) {
    return masks_.empty() ? nullptr : masks_.data() + static_cast<std::size_t>(row) * mask_bytes_;
  }
  /// The same, to read.
  const std::uint8_t* masks(std::int64_t row) const {
    return masks_.empty() ? nullptr : masks_.data() + static_cast<std::size_t>(row) * mask_bytes_;
  }

  std::vector<float> raw_actions;   // [T * N, raw_size] unclipped, as drawn
  std::vector<float> rewards;       // [T * N] as the learner sees them
  std::vector<float> values;        // [T * N] V(s_t) by the model that acted, found by the rollout's end
  std::vector<float> neglogp;       // [T * N] -log p(a_t | s_t) when it was acted upon
  std::vector<float> advantages;    // [T * N] filled by EstimateAdvantages
  std::vector<float> returns;       // [T * N] filled by EstimateAdvantages
  std::vector<std::uint8_t> ended;  // [T * N] 1: the episode ended with this transition

  /// Everything, a rollout in progress included.
  void Visit(Archive& archive);

 private:
  std::int64_t slots_, n_steps_;
  std::size_t observation_bytes_, action_bytes_, mask_bytes_;
  bool full_ = false;
  std::vector<std::int64_t> time_;                    // [N]
  std::vector<std::byte> bytes_;                      // observations [(T + 1) * N, row_bytes]
  std::vector<std::uint8_t> masks_;                   // [(T + 1) * N, mask_bytes]
  std::vector<std::byte> actions_;                    // [N, row_bytes] of the present step
  std::vector<std::byte> finals_;                     // [N, row_bytes] of the present step
  std::vector<float> step_rewards_;                   // [N] of the present step
  std::vector<std::uint8_t> terminated_, truncated_;  // [N] of the present step
  std::vector<std::int32_t> staged_;                  // slots of the staged batch
  BatchBuffer scratch_;                               // where a part of the slots is staged
};

/// Generalised advantage estimation over a rollout: fills advantages and returns. `last_values` [N] is V of each
/// slot's latest observation. Source: Schulman et al. 2016, arXiv:1506.02438, eq. 16.
void EstimateAdvantages(Rollout& rollout, std::span<const float> last_values, double gamma, double gae_lambda);

}  // namespace consac::learn
