// The point mass: what a push does, what the wall does, what a step costs.
#include "worlds/point/point.h"

#include <gtest/gtest.h>

#include "worlds/put.h"

namespace consac::worlds {
namespace {

struct PointWalk {
  Point point;
  Rng rng{1, 1};
  float seen[6] = {};
  void Put(std::vector<double> position, std::vector<double> velocity, std::vector<double> goal) {
    worlds::Put(point, "position", position);
    worlds::Put(point, "velocity", velocity);
    worlds::Put(point, "goal", goal);
  }
  StepResult Push(float x, float y) {
    const float action[2] = {x, y};
    return point.Step(action, rng, seen);
  }
};

TEST(Point, AStepCostsTheDistanceToTheGoalAndALittleOfThePush) {
  PointWalk walk;
  walk.Put({0.5, 0.0}, {0.0, 0.0}, {0.5, 1.0});
  StepResult result = walk.Push(0.0f, 1.0f);  // 2 m/s^2 for 0.1 s: 0.2 m/s, 0.02 m
  EXPECT_FLOAT_EQ(walk.seen[1], 0.02f);
  EXPECT_FLOAT_EQ(walk.seen[3], 0.2f);
  EXPECT_FLOAT_EQ(result.reward, -0.98f - 0.01f);
  walk.Put({0.3, 0.4}, {0.0, 0.0}, {0.0, 0.0});
  result = walk.Push(0.0f, 0.0f);
  EXPECT_FLOAT_EQ(result.reward, -0.5f);
  EXPECT_FALSE(result.terminated);
  walk.Put({0.0, 0.0}, {1.0, 0.0}, {0.095, 0.0});
  EXPECT_NEAR(walk.Push(0.0f, 0.0f).reward, 0.0f, 1e-7f) << "drag takes 0.5 of the speed a second";
}

TEST(Point, APushBeyondItsBoundsIsTheLargestOne) {
  PointWalk walk;
  walk.Put({0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0});
  const float far = walk.Push(5.0f, -9.0f).reward;
  walk.Put({0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0});
  EXPECT_EQ(walk.Push(1.0f, -1.0f).reward, far);
}

TEST(Point, TheWallStopsIt) {
  PointWalk walk;
  walk.Put({0.99, 0.0}, {2.0, 0.5}, {1.0, 0.0475});
  const StepResult result = walk.Push(1.0f, 0.0f);
  EXPECT_EQ(walk.seen[0], 1.0f);
  EXPECT_EQ(walk.seen[2], 0.0f);
  EXPECT_FLOAT_EQ(walk.seen[3], 0.475f) << "along the wall it goes on";
  EXPECT_NEAR(result.reward, -0.01f, 1e-7f);
}

}  // namespace
}  // namespace consac::worlds
