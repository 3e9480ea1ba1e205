#pragma once
// Takes the time of a training's rounds, part by part. A look at the clock takes as long as a part of a small world's
// round: of brief rounds that are alike one in eleven is looked at, and the time of the ten after it, which is known as
// a whole, is shared out as that of those looked at lately. What one of the ten does alone (a long reset, a flush of
// the logs) is shared out, too: the parts are those of common rounds. Private to run.

#include <cstdint>
#include <optional>
#include <utility>

#include "consac/base/hooks.h"
#include "consac/run/report.h"

namespace consac::run {

/// Whether the rounds after one do just the same.
enum class NextRounds : std::uint8_t { kAlike, kOfTheirOwn };

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
    told_.Add(common_, Lap() / common_.sum());
  }
  /// The time since the latest look goes to this part of the round.
  void Spend(double TimeSpent::*part) { spent_.*part += Lap(); }
  /// The same for two parts: `share` of it to the first.
  void Spend(double share, double TimeSpent::*part, double TimeSpent::*other) {
    const double passed = Lap();
    spent_.*part += share * passed;
    spent_.*other += (1.0 - share) * passed;
  }
  /// A step of a whole world has been taken by `agents` agents.
  void CountStep(std::int64_t agents) {
    ++told_.rounds;
    told_.agent_steps += agents;
  }
  /// When the clock was looked at last (s).
  double looked() const { return looked_; }

  /// A round ends: what rounds have come to since it last said, or nothing yet.
  std::optional<TimeSpent> EndRound(NextRounds next) {
    if (!watching_) return std::nullopt;
    if (whole_ && next == NextRounds::kAlike) {
      const double sum = spent_.sum();
      const bool learned = spent_.learning > 0.0, common = !learned && sum > 0.0 && sum < kBrief;
      if (common) {
        TimeSpent lately = spent_;
        lately.Add(common_, kKept);
        common_ = lately;
      }
      if (common || (learned && was_common_)) passed_over_ = kPassedOver;
      was_common_ = common;
    }
    watching_ = passed_over_ == 0 || next != NextRounds::kAlike;
    told_.Add(std::exchange(spent_, {}));
    return std::exchange(told_, {});
  }

 private:
  // s. A look takes 20 to 30 ns, and a round has four: half a percent of this.
  static constexpr double kBrief = 20e-6;
  // Rounds after one that was looked at, whatever comes between. Values are found every 64 / N rounds of N agents
  // (UnvaluedSteps), and rollouts have powers of two mostly: eleven divides none of these, so that each kind of round
  // is looked at as often as it comes.
  static constexpr int kPassedOver = 10;

  // Of the rounds looked at before: parts follow those of about a hundred rounds. Sums of rounds, since a long one
  // counts for more.
  static constexpr double kKept = 0.9;

  double (*now_)();
  double looked_ = 0.0;
  TimeSpent spent_;                      // of this round: seconds alone
  TimeSpent told_;                       // of what is to be told at the end of a round
  TimeSpent common_;                     // of the rounds that stand for those passed over: seconds alone
  bool watching_ = true, whole_ = true;  // looks at the parts; has done so since the round's beginning
  bool was_common_ = false;              // the latest round that was looked at as a whole
  int passed_over_ = 0;                  // rounds that are still to be

  // Seconds since the latest look; 0, with no look, in a round that is passed over.
  double Lap() {
    if (!watching_) return 0.0;
    const double now = now_();
    return now - std::exchange(looked_, now);
  }
};

}  // namespace consac::run
