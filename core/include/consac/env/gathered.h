#pragma once
// Some rows of a whole batch, gathered into a batch of their own and put back: for worlds whose agents come and go.
// Where the part lies in the same memory as the whole, nothing is copied.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/env/batch.h"
#include "consac/env/buffer.h"
#include "consac/env/vector_env.h"

namespace consac {

/// Which slots are chosen, and how their rows go from a whole batch, in which row i is slot i, to a part, in which they
/// follow one another, and back. Never allocates once made.
class GatheredRows {
 public:
  /// Of the slots of `behaviour`; none are chosen.
  explicit GatheredRows(const BehaviourSpec& behaviour);
  /// Chooses the slots for which `present` is not 0; empty: all.
  void ChoosePresent(std::span<const std::uint8_t> present);
  /// Chooses the slots that are present, but not among `others`.
  void ChooseArrivals(std::span<const std::uint8_t> present, const GatheredRows& others);
  /// The slots chosen, ascending.
  std::span<const std::int32_t> slots() const { return chosen_; }
  /// Whether all are.
  bool everyone() const { return chosen_.size() == count_; }

  /// Memory for the chosen rows: that of `whole` where everyone is chosen, else this object's own, which the next part
  /// takes over. Its slots are the whole's.
  Batch PartOf(const Batch& whole);
  /// What is acted upon: observations and masks.
  void TakeObservations(const Batch& whole, Batch& part) const;
  /// What comes next: observations and masks.
  void TakeNext(const Batch& whole, Batch& part) const;
  /// The reverse of TakeNext, of observations alone.
  void PutNext(const Batch& part, Batch& whole) const;
  /// The actions, from the part to their places.
  void PutActions(const Batch& part, Batch& whole) const;
  /// What came of them: rewards, ends, final and next observations.
  void TakeOutcome(const Batch& whole, Batch& part) const;

 private:
  std::size_t count_, observation_bytes_, action_bytes_, mask_bytes_;
  BatchBuffer own_;
  std::vector<std::int32_t> chosen_;
};

}  // namespace consac
