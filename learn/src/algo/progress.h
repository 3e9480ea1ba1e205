#pragma once
// How far a training has come, as what falls over it (step sizes, epsilon, exponents) is read by. Private to learn.

#include <algorithm>
#include <cstdint>

namespace consac::learn {

/// The share of `total` steps that `steps` are: 0 at first, 1 at the end, more after it.
inline double ElapsedShare(std::int64_t steps, std::int64_t total) {
  return static_cast<double>(steps) / static_cast<double>(std::max<std::int64_t>(total, 1));
}
/// The share of `total` steps that is left after `steps`: 1 at first, 0 from the end on.
inline double RemainingShare(std::int64_t steps, std::int64_t total) {
  return std::max(0.0, 1.0 - ElapsedShare(steps, total));
}

}  // namespace consac::learn
