#pragma once
// How a read waits: spin for a bounded time, then sleep. Spinning saves the 40 us that waking a sleeper on another
// core costs, but two ends that share a core must not burn it, so a spin that did not help makes the next one
// shorter. Private to core/transport.

#include <algorithm>
#include <thread>

#include "consac/base/hooks.h"

namespace consac {

/// The present spin budget of one reader.
class SpinBudget {
 public:
  /// Tries `ready` until it says true or the budget is used up; true when it did. At most `limit_s`.
  template <class Ready>
  bool Spin(double limit_s, Ready&& ready) {
    const double start = Now();
    const double budget = std::min(limit_s, budget_s_);
    do {
      if (ready()) {
        budget_s_ = longest_s_;
        return true;
      }
    } while (Now() - start < budget);
    budget_s_ = std::max(budget_s_ * 0.5, kShortest);
    if (++sleeps_ % kRetryEvery == 0) budget_s_ = longest_s_;
    return false;
  }

 private:
  static constexpr double kShortest = 1e-6;
  static constexpr int kRetryEvery = 64;  // now and then a full spin, in case the peer has become fast

  // A single core has nothing to spin for.
  double longest_s_ = std::thread::hardware_concurrency() > 1 ? 50e-6 : 0.0;
  double budget_s_ = longest_s_;
  int sleeps_ = 0;
};

}  // namespace consac
