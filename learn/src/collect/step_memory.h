#pragma once
// What each slot is doing between Act and Record: what it saw, chose and expected, kept slot by slot, because batches
// under way may be recorded in another order than they were acted upon. Private to learn.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace consac::learn {

/// Columns of several rows, or of one.
struct StepRows {
  float* features = nullptr;  ///< [rows, F] network inputs
  float* raw = nullptr;       ///< [rows, raw] actions as drawn
  float* values = nullptr;    ///< [rows] V of what was seen, once it is found
  float* neglogp = nullptr;   ///< [rows] -log p of what was drawn
};

/// One row per slot, and room for a part of them while they act.
class StepMemory {
 public:
  /// For `slots` slots with `features` network inputs and `raw` numbers of raw action.
  StepMemory(std::int64_t slots, std::int64_t features, std::int64_t raw)
      : slots_(slots), kept_(slots, features, raw), part_(slots, features, raw), features_(features), raw_(raw) {}

  /// Where the rows of a batch of `slots` (ascending, unique) are to be written: the slots' own places where all act.
  StepRows Stage(std::span<const std::int32_t> slots) { return Whole(slots) ? kept_.At(0) : part_.At(0); }
  /// Files what was written for `slots` under each.
  void Keep(std::span<const std::int32_t> slots) {
    if (Whole(slots)) return;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const StepRows from = part_.At(static_cast<std::int64_t>(i)), to = Row(slots[i]);
      std::copy_n(from.features, features_, to.features);
      std::copy_n(from.raw, raw_, to.raw);
      *to.values = *from.values;
      *to.neglogp = *from.neglogp;
    }
  }
  /// What `slot` was doing.
  StepRows Row(std::int32_t slot) { return kept_.At(slot); }

 private:
  struct Columns {
    Columns(std::int64_t rows, std::int64_t f, std::int64_t r)
        : features(static_cast<std::size_t>(rows * f)),
          raw(static_cast<std::size_t>(rows * r)),
          values(static_cast<std::size_t>(rows)),
          neglogp(static_cast<std::size_t>(rows)),
          feature_count(f),
          raw_count(r) {}
    StepRows At(std::int64_t row) {
      return {features.data() + row * feature_count, raw.data() + row * raw_count, values.data() + row,
              neglogp.data() + row};
    }
    std::vector<float> features, raw, values, neglogp;  // [rows, F], [rows, raw], [rows], [rows]
    std::int64_t feature_count, raw_count;
  };
  // Ascending and unique, so when they are all, slot i is row i.
  bool Whole(std::span<const std::int32_t> slots) const { return static_cast<std::int64_t>(slots.size()) == slots_; }

  std::int64_t slots_;
  Columns kept_, part_;
  std::int64_t features_, raw_;
};

}  // namespace consac::learn
