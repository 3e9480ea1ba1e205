// Reaching: how it moves, what pays, that it goes on when it is there, and what another goal would have paid.
#include "worlds/point_reach/point_reach.h"

#include <gtest/gtest.h>

#include "worlds/put.h"

namespace consac::worlds {
namespace {

template <class W>
struct Reaching {
  W world;
  Rng rng{1, 1};
  float seen[6] = {};
  void Put(std::vector<float> position, std::vector<float> goal) {
    worlds::Put(world, "position", position);
    worlds::Put(world, "goal", goal);
  }
  StepResult Move(float x, float y) {
    const float action[2] = {x, y};
    return world.Step(action, rng, seen);
  }
};

TEST(PointReach, AStepGoesATenthOfAMetreAndNothingPaysButTheGoal) {
  Reaching<PointReachSparse> walk;
  walk.Put({0.0f, 0.0f}, {0.2f, -0.05f});
  StepResult result = walk.Move(1.0f, -0.5f);
  const float expected[6] = {0.1f, -0.05f, 0.2f, -0.05f, 0.1f, -0.05f};
  for (int i = 0; i < 6; ++i) EXPECT_FLOAT_EQ(walk.seen[i], expected[i]) << i;
  EXPECT_EQ(result.reward, -1.0f);
  result = walk.Move(0.6f, 0.0f);
  EXPECT_EQ(result.reward, 0.0f) << "0.04 m from it";
  EXPECT_FALSE(result.terminated) << "it is to stay there";
  EXPECT_EQ(walk.Move(-0.2f, 0.0f).reward, -1.0f) << "0.06 m from it";
}

TEST(PointReach, SidesAndTheLargestSpeedHold) {
  Reaching<PointReachSparse> walk;
  walk.Put({0.95f, 0.0f}, {0.0f, 0.0f});
  (void)walk.Move(1.0f, -7.0f);
  EXPECT_EQ(walk.seen[0], 1.0f);
  EXPECT_FLOAT_EQ(walk.seen[1], -0.1f);
}

TEST(PointReach, TheDenseOnePaysTheDistance) {
  Reaching<PointReachDense> walk;
  walk.Put({0.0f, 0.0f}, {0.4f, 0.4f});
  EXPECT_FLOAT_EQ(walk.Move(1.0f, 0.0f).reward, -0.5f);
}

TEST(PointReach, PricesWhatItPays) {
  const float rows[12] = {0.5f, 0.5f, 0.5f, 0.54f, 0.0f, 0.0f, 0.5f, 0.5f, 0.5f, 0.2f, 0.5f, 0.5f};
  float rewards[2] = {};
  Batched<PointReachSparse> sparse(1);
  ASSERT_TRUE(sparse.prices_goals());
  ASSERT_EQ(sparse.spec().behaviours[0].observation_layout.row_bytes, sizeof(rows) / 2);
  sparse.PriceGoals(0, reinterpret_cast<const std::byte*>(rows), 2, rewards);
  EXPECT_EQ(rewards[0], 0.0f);
  EXPECT_EQ(rewards[1], -1.0f);
  Batched<PointReachDense>(1).PriceGoals(0, reinterpret_cast<const std::byte*>(rows), 2, rewards);
  EXPECT_NEAR(rewards[0], -0.04f, 1e-6f);
  EXPECT_FLOAT_EQ(rewards[1], -0.3f);
  const float edge[6] = {0.0f, 0.0f, PointReachSparse::kThreshold, 0.0f, 0.0f, 0.0f};
  EXPECT_EQ(PointReachSparse::Price(edge), 0.0f) << "at the threshold it is there, as Fetch's";
}

}  // namespace
}  // namespace consac::worlds
