#include "round_clock.h"

#include <gtest/gtest.h>

namespace consac::run {
namespace {

double time_now = 0.0;
int looks = 0;

double TimeNow() {
  ++looks;
  return time_now;
}

/// A round of these parts (s), or of a longer world.
std::optional<TimeSpent> Round(RoundClock& clock, double world = 3e-6) {
  clock.BeginRound();
  time_now += 1e-6;
  clock.spent().inference += clock.Lap();
  time_now += world;
  clock.spent().world += clock.Lap();
  time_now += 1e-6;
  clock.spent().other += clock.Lap();
  ++clock.spent().rounds;
  clock.spent().agent_steps += 4;
  return clock.EndRound(true);
}

TEST(RoundClock, BriefRoundsThatAreAlikeAreTakenByOneInEight) {
  RoundClock clock(TimeNow);
  clock.Start();
  TimeSpent sum;
  looks = 0;
  for (int i = 0; i < 8 * 100; ++i) {
    const std::optional<TimeSpent> spent = Round(clock);
    EXPECT_EQ(spent.has_value(), i % 8 == 0) << i;
    if (!spent.has_value()) continue;
    sum.inference += spent->inference;
    sum.world += spent->world;
    sum.other += spent->other;
    sum.rounds += spent->rounds;
    sum.agent_steps += spent->agent_steps;
  }
  EXPECT_EQ(looks, 100 * 4 - 1);
  constexpr double kRounds = 8 * 99 + 1;  // the last seven are not told yet
  EXPECT_EQ(sum.rounds, kRounds);
  EXPECT_EQ(sum.agent_steps, 4 * kRounds);
  EXPECT_NEAR(sum.inference, 1e-6 * kRounds, 1e-12);
  EXPECT_NEAR(sum.world, 3e-6 * kRounds, 1e-12);
  EXPECT_NEAR(sum.other, 1e-6 * kRounds, 1e-12);
}

TEST(RoundClock, WhatIsNotAlikeIsTakenAsItIs) {
  RoundClock clock(TimeNow);
  clock.Start();
  EXPECT_TRUE(Round(clock).has_value());
  EXPECT_FALSE(Round(clock).has_value());
  EXPECT_FALSE(Round(clock).has_value());
  clock.BeginRound();
  time_now += 2e-6;
  clock.Watch();  // an update is due: what rounds took until here is shared out
  time_now += 5.0;
  clock.spent().learning += clock.Lap();
  const std::optional<TimeSpent> spent = clock.EndRound(true);
  ASSERT_TRUE(spent.has_value());
  EXPECT_NEAR(spent->learning, 5.0, 1e-9);
  EXPECT_NEAR(spent->sum(), 5.0 + 12e-6, 1e-9);
  EXPECT_NEAR(spent->world, 0.6 * 12e-6, 1e-9);
  EXPECT_EQ(spent->rounds, 2);
  EXPECT_TRUE(Round(clock, 1e-3).has_value()) << "long";
  EXPECT_TRUE(Round(clock).has_value());
  EXPECT_FALSE(Round(clock).has_value()) << "brief again";
}

TEST(RoundClock, WhoIsNotSureIsTakenRoundByRound) {
  RoundClock clock(TimeNow);
  clock.Start();
  for (int i = 0; i < 20; ++i) {
    clock.BeginRound();
    time_now += 1e-6;
    clock.spent().wire += clock.Lap();
    EXPECT_TRUE(clock.EndRound(false).has_value());
  }
}

}  // namespace
}  // namespace consac::run
