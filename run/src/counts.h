#pragma once
// What a checkpoint counts with: looked at before anything goes on by it. Private to run.

#include <cstdint>

#include "consac/base/archive.h"

namespace consac::run {

/// Beyond what anybody can count to: at a thousand million a second it takes a hundred days.
inline constexpr std::int64_t kMostCounted = std::int64_t{1} << 53;

/// Whole numbers of 64 bits in what learners and logs save, and in what the run itself does, are counts, from 0 to
/// kMostCounted; those of a world are its own affair. kDataLoss names the first that is none, and its value.
Status CheckCounts(const StateMap& state);

}  // namespace consac::run
