// The cart by hand; that it is Gymnasium's step by step is shown in tests/python/test_gymnasium.py.
#include "worlds/cartpole/cartpole.h"

#include <gtest/gtest.h>

namespace consac::worlds {
namespace {

struct CartWalk {
  CartPole cart;
  Rng rng{1, 1};
  float seen[4] = {};
  StepResult Push(std::int32_t action) { return cart.Step(&action, rng, seen); }
};

// 10 N on 1.1 kg; the pole, at rest and upright, falls the other way.
TEST(CartPole, OnePushFromRest) {
  for (const std::int32_t action : {0, 1}) {
    CartWalk walk;
    walk.cart.SetState({0, 0, 0, 0});
    const StepResult result = walk.Push(action);
    const float side = action == 1 ? 1.0f : -1.0f;
    EXPECT_EQ(result.reward, 1.0f);
    EXPECT_FALSE(result.terminated);
    EXPECT_EQ(walk.seen[0], 0.0f);
    EXPECT_NEAR(walk.seen[1], side * 0.19512195f, 1e-7f);
    EXPECT_EQ(walk.seen[2], 0.0f);
    EXPECT_NEAR(walk.seen[3], side * -0.29268293f, 1e-7f);
  }
}

TEST(CartPole, FallsBeyondTwelveDegreesAndLeavesBeyondTwoPointFourMetres) {
  constexpr double kTwelveDegrees = 12.0 * 3.141592653589793 / 180.0;
  CartWalk walk;
  walk.cart.SetState({0, 0, kTwelveDegrees - 1e-3, 0});
  EXPECT_FALSE(walk.Push(1).terminated);
  walk.cart.SetState({0, 0, kTwelveDegrees + 1e-3, 0});
  const StepResult fell = walk.Push(1);
  EXPECT_TRUE(fell.terminated);
  EXPECT_EQ(fell.reward, 1.0f) << "the last step counts";
  walk.cart.SetState({2.399, 0, 0, 0});
  EXPECT_FALSE(walk.Push(1).terminated);
  walk.cart.SetState({-2.401, 0, 0, 0});
  EXPECT_TRUE(walk.Push(1).terminated);
}

}  // namespace
}  // namespace consac::worlds
