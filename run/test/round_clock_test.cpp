#include "round_clock.h"

#include <gtest/gtest.h>

#include <optional>

namespace consac::run {
namespace {

constexpr double kMicro = 1e-6;

double time_now = 0.0;
int looks = 0;

double TimeNow() {
  ++looks;
  return time_now;
}

class RoundClockTest : public ::testing::Test {
 protected:
  RoundClockTest() { clock_.Start(); }

  void Pass(double seconds, double TimeSpent::*part) {
    time_now += seconds;
    clock_.Spend(part);
    truth_.*part += seconds;
  }
  /// A round of four agents; adds what is told to told_.
  bool Round(double inference = kMicro, double world = 3 * kMicro, NextRounds next = NextRounds::kAlike) {
    clock_.BeginRound();
    Pass(inference, &TimeSpent::inference);
    Pass(world, &TimeSpent::world);
    Pass(kMicro, &TimeSpent::other);
    return End(next);
  }
  bool End(NextRounds next = NextRounds::kAlike) {
    clock_.CountStep(4);
    truth_.rounds += 1;
    truth_.agent_steps += 4;
    const std::optional<TimeSpent> spent = clock_.EndRound(next);
    told_.Add(spent.value_or(TimeSpent()));
    return spent.has_value();
  }
  void ExpectTruth(double tolerance) {
    EXPECT_EQ(told_.rounds, truth_.rounds);
    EXPECT_EQ(told_.agent_steps, truth_.agent_steps);
    EXPECT_NEAR(told_.sum(), truth_.sum(), 1e-9) << "as a whole it is exact";
    for (double TimeSpent::*part : {&TimeSpent::world, &TimeSpent::inference, &TimeSpent::learning, &TimeSpent::other})
      EXPECT_NEAR(told_.*part, truth_.*part, tolerance * truth_.sum() + 1e-12);
  }

  RoundClock clock_{TimeNow};
  TimeSpent truth_, told_;
};

TEST_F(RoundClockTest, BriefRoundsThatAreAlikeAreTakenByOneInEleven) {
  looks = 0;
  for (int i = 0; i <= 11 * 100; ++i) EXPECT_EQ(Round(), i % 11 == 0) << i;
  EXPECT_EQ(looks, 101 * 4 - 1);
  ExpectTruth(1e-9);
}

// The critic is run every 64 / N rounds of N agents, counted from the beginning of a rollout.
TEST_F(RoundClockTest, WhatComesEverySoManyRoundsIsSeenAsOftenAsItComes) {
  for (const int rollout : {16, 128, 1000000}) {
    for (const int period : {64, 32, 21, 16, 12, 10, 9, 8, 7, 6, 5, 4, 3, 2}) {
      told_ = truth_ = {};
      for (int i = 0; i < 11 * 64 * 20; ++i) {
        const int step = i % rollout;
        const double inference = step % period == 0 && step > 0 ? 7 * kMicro : kMicro;
        if (step < rollout - 1) {
          Round(inference);
          continue;
        }
        clock_.BeginRound();
        Pass(inference, &TimeSpent::inference);
        Pass(3 * kMicro, &TimeSpent::world);
        clock_.Watch();
        Pass(kMicro, &TimeSpent::other);
        Pass(40 * kMicro, &TimeSpent::learning);
        End();
      }
      clock_.Watch();
      End();
      SCOPED_TRACE(::testing::Message() << period << " of " << rollout);
      ExpectTruth(0.04);
    }
  }
}

TEST_F(RoundClockTest, WhatIsNotAlikeIsTakenAsItIs) {
  EXPECT_TRUE(Round());
  EXPECT_FALSE(Round());
  EXPECT_FALSE(Round());
  clock_.BeginRound();
  Pass(2 * kMicro, &TimeSpent::inference);
  clock_.Watch();  // an update is due: what rounds took until here is shared out
  Pass(5.0, &TimeSpent::learning);
  clock_.Watch();  // an evaluation behind it
  Pass(7.0, &TimeSpent::other);
  EXPECT_TRUE(End());
  EXPECT_NEAR(told_.learning, 5.0, 1e-9);
  EXPECT_NEAR(told_.other, 7.0, 1e-5);
  ExpectTruth(1e-5);
  for (int i = 0; i < 7; ++i) EXPECT_FALSE(Round()) << i << ": ten after the one that was looked at, still";
  EXPECT_TRUE(Round(kMicro, 1e-3)) << "long";
  EXPECT_TRUE(Round());
  EXPECT_FALSE(Round()) << "brief again";
}

TEST_F(RoundClockTest, RoundsOfAnEngineAreAllLookedAt) {
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(Round(kMicro, kMicro, NextRounds::kOfTheirOwn));
  ExpectTruth(1e-9);
}

}  // namespace
}  // namespace consac::run
