#pragma once
// Some rows of a batch as a batch of their own, for worlds whose agents come and go: gathered before a step, put back
// after it. Where every row is chosen nothing is copied.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/env/batch.h"
#include "consac/env/buffer.h"
#include "consac/env/vector_env.h"

namespace consac {

/// Rows chosen from a whole batch, in which row i is slot i. Never allocates once made.
class GatheredRows {
 public:
  /// Of the slots of `behaviour`.
  explicit GatheredRows(const BehaviourSpec& behaviour);
  /// Chooses the slots for which `present` is not 0; empty: all.
  void ChoosePresent(std::span<const std::uint8_t> present);
  /// Chooses the slots that are present, but were not among `others`.
  void ChooseArrivals(std::span<const std::uint8_t> present, const GatheredRows& others);
  /// The slots chosen.
  std::span<const std::int32_t> slots() const { return chosen_; }
  /// Observations and masks to act upon; the batch's actions are to be written. Valid until the next call here.
  Batch& TakeObservations(const Batch& whole);
  /// First observations and masks, for Learner::Begin. Valid until the next call here.
  Batch& TakeFirst(const Batch& whole);
  /// Puts the actions of the batch into their places in `whole`.
  void PutActions(Batch& whole) const;
  /// What came of the actions; the batch of TakeObservations is then complete.
  Batch& TakeOutcome(const Batch& whole);

 private:
  bool everyone() const { return chosen_.size() == slots_; }
  Batch& Part(const Batch& whole);

  std::size_t slots_, observation_bytes_, action_bytes_, mask_bytes_;
  BatchBuffer own_;
  std::vector<std::int32_t> chosen_;
  Batch batch_;
};

}  // namespace consac
