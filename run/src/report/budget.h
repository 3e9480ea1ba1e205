#pragma once
// Where the time of a run goes: the world, the wire to it, choosing actions, learning. Of about the last ten seconds.

#include <fmt/format.h>

#include "consac/run/report.h"

namespace consac::run {

/// The budget, live.
class Budget {
 public:
  /// Adds what one or several rounds took, at time `now`.
  void Add(const TimeSpent& rounds, double now);
  /// Of the last ten to twenty seconds, or less when there was less.
  TimeSpent recent() const;

 private:
  static constexpr double kWindow = 10.0;  // s
  TimeSpent last_, present_;
  double began_ = -1.0;
};

/// "a step takes 13.1 ms: engine 8.10 ms 62 %, wire 0.21 ms 2 %, inference 0.40 ms 3 %, learning 4.30 ms 33 %; that
/// allows 611 steps/s". `world` names what steps: "engine", "world".
void AppendBudget(const TimeSpent& spent, const char* world, fmt::memory_buffer* out);

}  // namespace consac::run
