// The road, rule by rule as the thesis has it.
#include "worlds/road/road.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

namespace consac::worlds {
namespace {

struct RoadWalk {
  Road road;
  Rng rng{3, 3};
  float seen[2] = {};
  StepResult Step(std::int32_t action) { return road.Step(&action, rng, seen); }
};

TEST(Road, StartsAtTenAndPaysForStepsThatComeNearer) {
  RoadWalk walk;
  walk.road.Reset(walk.rng, walk.seen);
  EXPECT_EQ(walk.seen[0], 10.0f);
  EXPECT_NE(walk.seen[1], 10.0f);
  for (int i = 0; i < 500; ++i) {
    const int actor = walk.road.actor(), coin = walk.road.coin();
    const int action = i % 3;
    const bool nearer = std::abs(coin - (actor + action - 1)) < std::abs(coin - actor);
    const StepResult result = walk.Step(action);
    EXPECT_EQ(result.reward, nearer ? 1.0f : 0.0f);
    if (result.terminated) walk.road.Reset(walk.rng, walk.seen);
  }
}

TEST(Road, LeavingEndsTheEpisodeAndBothGetNewPlaces) {
  RoadWalk walk;
  walk.road.Reset(walk.rng, walk.seen);
  StepResult result;
  int steps = 0;
  for (; !result.terminated && steps < 100; ++steps) result = walk.Step(0);
  EXPECT_EQ(steps, 11);  // from 10 over 0 to -1
  EXPECT_EQ(walk.seen[0], 0.0f);
  std::map<int, int> places;
  for (int i = 0; i < 2000; ++i) {
    walk.road.Reset(walk.rng, walk.seen);
    ++places[walk.road.actor()];
    ASSERT_NE(walk.road.actor(), walk.road.coin());
  }
  EXPECT_EQ(places.size(), 41u);
}

TEST(Road, TheCoinMovesOnArrivalAndAfterFiftySteps) {
  RoadWalk walk;
  walk.road.Reset(walk.rng, walk.seen);
  const int coin = walk.road.coin();
  for (int i = 0; i < 49; ++i) walk.Step(1);
  EXPECT_EQ(walk.road.coin(), coin);
  walk.Step(1);
  const int moved = walk.road.coin();
  while (walk.road.actor() != moved && walk.road.coin() == moved) walk.Step(moved > walk.road.actor() ? 2 : 0);
  EXPECT_EQ(walk.road.actor(), moved);
  EXPECT_NE(walk.road.coin(), moved);
}

}  // namespace
}  // namespace consac::worlds
