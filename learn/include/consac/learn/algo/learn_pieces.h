#pragma once
// Learning in pieces, between which somebody looks whether to stop.

#include <cstdint>

#include "consac/learn/algo/learner.h"

namespace consac::learn {

/// How large the pieces of an update are: one optimiser step at first, then more where steps are quick, so that whoever
/// asks it to stop waits for a moment, or where a step takes longer for that one. Results do not depend on it.
class LearnPieces {
 public:
  /// For Learner::Learn.
  LearnBudget budget() const { return {steps_}; }
  /// A whole piece has been learned; `now` in s.
  void Look(double now) {
    if (latest_ > 0.0) {
      const double took = now - latest_;
      if (took > kLonger && steps_ > 1) steps_ /= 2;
      if (took < kShorter && steps_ < kMost) steps_ *= 2;
    }
    latest_ = now;
  }

 private:
  static constexpr double kShorter = 0.005, kLonger = 0.05;  // s
  static constexpr std::int64_t kMost = 64;

  std::int64_t steps_ = 1;
  double latest_ = 0.0;  // time of the latest look, s; 0: none yet
};

}  // namespace consac::learn
