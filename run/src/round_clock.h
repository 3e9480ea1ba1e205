#pragma once
// Takes the time of a training's rounds, part by part. A look at the clock takes as long as a part of a small world's
// round: of rounds that take microseconds and are all alike one in eight is looked at, and the time of the seven after
// it, which is known as a whole, is shared out as that one's.

#include <optional>
#include <utility>

#include "consac/base/hooks.h"
#include "consac/run/report.h"

namespace consac::run {

/// The time since the latest look at the clock belongs to what has been done since: one part's end is the next one's
/// beginning.
class RoundClock {
 public:
  /// `now` gives seconds.
  explicit RoundClock(double (*now)() = &Now) : now_(now) {}

  /// Time begins here.
  void Start() { looked_ = now_(); }
  /// A round begins.
  void BeginRound() {
    if (passed_over_ > 0) {
      --passed_over_;
      return;
    }
    Watch();
    whole_ = true;
  }
  /// What follows is looked at part by part, whatever the round: it is not what rounds before it did.
  void Watch() {
    if (watching_) return;
    watching_ = true;
    whole_ = false;
    passed_over_ = 0;
    const double passed = Lap();
    told_.world += passed * shares_.world;
    told_.wire += passed * shares_.wire;
    told_.inference += passed * shares_.inference;
    told_.other += passed * shares_.other;
  }
  /// Seconds since the latest look; 0, with no look, in a round that is passed over.
  double Lap() {
    if (!watching_) return 0.0;
    const double now = now_();
    return now - std::exchange(looked_, now);
  }
  /// Of this round; the caller adds what Lap gives.
  TimeSpent& spent() { return spent_; }
  /// When the clock was looked at last (s).
  double looked() const { return looked_; }

  /// A round ends: what rounds have come to since it last said, or nothing yet. `alike`: the next ones do just the
  /// same.
  std::optional<TimeSpent> EndRound(bool alike) {
    told_.rounds += std::exchange(spent_.rounds, 0);
    told_.agent_steps += std::exchange(spent_.agent_steps, 0);
    if (!watching_) return std::nullopt;
    const double sum = spent_.sum();
    if (alike && whole_ && spent_.learning == 0.0 && sum > 0.0 && sum < kBrief) {
      shares_ = {spent_.world / sum, spent_.wire / sum, spent_.inference / sum, 0.0, spent_.other / sum};
      passed_over_ = kPassedOver;
      watching_ = false;
    }
    told_.world += spent_.world;
    told_.wire += spent_.wire;
    told_.inference += spent_.inference;
    told_.learning += spent_.learning;
    told_.other += spent_.other;
    spent_ = {};
    return std::exchange(told_, {});
  }

 private:
  static constexpr double kBrief = 20e-6;  // s
  static constexpr int kPassedOver = 7;    // rounds after one that was looked at

  double (*now_)();
  double looked_ = 0.0;
  TimeSpent spent_;                      // of this round
  TimeSpent told_;                       // of what is to be told at the end of a round
  TimeSpent shares_;                     // of the round that was looked at, by its parts
  bool watching_ = true, whole_ = true;  // looks at the parts; has done so since the round's beginning
  int passed_over_ = 0;                  // rounds that are still to be
};

}  // namespace consac::run
