// Bit flipping: what flips, what pays, when it ends, and what another goal would have paid.
#include "worlds/bit_flipping/bit_flipping.h"

#include <gtest/gtest.h>

#include "worlds/put.h"

namespace consac::worlds {
namespace {

using Bits = std::vector<std::uint8_t>;

template <class W>
struct Flips {
  W world;
  Rng rng{1, 1};
  Bits seen = Bits(30);
  StepResult Step(const std::vector<typename W::Action>& action) { return world.Step(action.data(), rng, seen.data()); }
  Bits Part(int which) const { return {seen.begin() + 10 * which, seen.begin() + 10 * (which + 1)}; }
};

TEST(BitFlipping, AnActionFlipsItsBitAndTheLastOneEndsTheEpisode) {
  Flips<BitFlippingDiscrete> walk;
  Put(walk.world, "bits", Bits{1, 1, 1, 0, 1, 1, 1, 1, 1, 0});
  StepResult result = walk.Step({0});
  EXPECT_EQ(walk.Part(0), (Bits{0, 1, 1, 0, 1, 1, 1, 1, 1, 0})) << "achieved";
  EXPECT_EQ(walk.Part(1), Bits(10, 1)) << "desired";
  EXPECT_EQ(walk.Part(2), walk.Part(0)) << "observed";
  EXPECT_EQ(result.reward, -1.0f);
  EXPECT_FALSE(result.terminated);
  (void)walk.Step({0});
  (void)walk.Step({9});
  result = walk.Step({3});
  EXPECT_EQ(walk.Part(0), Bits(10, 1));
  EXPECT_EQ(result.reward, 0.0f);
  EXPECT_TRUE(result.terminated);
}

TEST(BitFlipping, OfNumbersThePositiveOnesFlip) {
  Flips<BitFlippingContinuous> walk;
  Put(walk.world, "bits", Bits{0, 0, 0, 1, 1, 1, 1, 1, 1, 1});
  StepResult result = walk.Step({0.1f, 1.0f, 0.0f, -0.2f, -1, -1, -1, -1, -1, -1});
  EXPECT_EQ(walk.Part(0), (Bits{1, 1, 0, 1, 1, 1, 1, 1, 1, 1})) << "0 flips nothing";
  EXPECT_EQ(result.reward, -1.0f);
  result = walk.Step({-1, -1, 0.5f, -1, -1, -1, -1, -1, -1, -1});
  EXPECT_EQ(result.reward, 0.0f);
  EXPECT_TRUE(result.terminated);
}

TEST(BitFlipping, PricesWhatItPays) {
  Batched<BitFlippingDiscrete> env(2);
  ASSERT_TRUE(env.prices_goals());
  ASSERT_EQ(env.spec().behaviours[0].observation_layout.row_bytes, 30u);
  Bits rows;
  for (const std::uint8_t desired : {1, 0}) {
    rows.insert(rows.end(), 10, std::uint8_t{0});
    rows.insert(rows.end(), 10, desired);
    rows.insert(rows.end(), 10, std::uint8_t{0});
  }
  float rewards[2] = {};
  env.PriceGoals(0, reinterpret_cast<const std::byte*>(rows.data()), 2, rewards);
  EXPECT_EQ(rewards[0], -1.0f);
  EXPECT_EQ(rewards[1], 0.0f) << "had that been wanted";
}

}  // namespace
}  // namespace consac::worlds
