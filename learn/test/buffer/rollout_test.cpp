// GAE's golden vector, and that trajectories of single slots equal the rectangle.
#include "consac/learn/buffer/rollout.h"

#include <gtest/gtest.h>

namespace consac::learn {
namespace {

BehaviourSpec Behaviour(std::int32_t slots) {
  return BehaviourSpec::Of("default", *Space::Box(0, 100, {1}), *Space::Discrete(2), slots);
}

TEST(EstimateAdvantages, GoldenVector) {
  Rollout rollout(Behaviour(1), 5, 1);
  const float rewards[] = {1, 0, 2, -1, 0.5f}, values[] = {0.5f, 0.4f, 0.3f, 0.2f, 0.1f};
  const std::int32_t slot = 0;
  for (std::size_t t = 0; t < 5; ++t) {
    const Batch batch = rollout.Stage({&slot, 1});
    rollout.rewards[t] = rewards[t];
    rollout.values[t] = values[t];
    rollout.ended[t] = t == 2 ? 1 : 0;
    rollout.Commit(batch);
  }
  EXPECT_TRUE(rollout.full());
  const float last_value = 0.7f;
  EstimateAdvantages(rollout, {&last_value, 1}, 0.99, 0.95);
  const double advantages[] = {2.302847, 1.49585, 1.7, -0.073033, 1.093},
               returns[] = {2.802847, 1.89585, 2.0, 0.126967, 1.193};
  for (std::size_t t = 0; t < 5; ++t) {
    EXPECT_NEAR(rollout.advantages[t], advantages[t], 1e-6) << t;
    EXPECT_NEAR(rollout.returns[t], returns[t], 1e-6) << t;
  }
}

TEST(Rollout, WorldsWriteInPlaceWhenAllSlotsStepTogether) {
  Rollout rollout(Behaviour(3), 4, 1);
  const std::int32_t slots[] = {0, 1, 2};
  for (int t = 0; t < 4; ++t) {
    const Batch batch = rollout.Stage(slots);
    EXPECT_EQ(batch.observations, rollout.observations(3 * t));
    EXPECT_EQ(batch.next_observations, rollout.observations(3 * (t + 1)));
    for (int i = 0; i < 3; ++i) reinterpret_cast<float*>(batch.next_observations)[i] = static_cast<float>(10 * t + i);
    rollout.Commit(batch);
  }
  EXPECT_TRUE(rollout.full());
  rollout.Restart();
  EXPECT_FALSE(rollout.full());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(*reinterpret_cast<float*>(rollout.observations(i)), static_cast<float>(30 + i));
}

TEST(Rollout, SlotsThatStepAloneKeepTheirOwnTrajectories) {
  Rollout rollout(Behaviour(3), 4, 1);
  const auto step = [&](std::vector<std::int32_t> slots, float value) {
    const Batch batch = rollout.Stage(slots);
    for (std::size_t i = 0; i < slots.size(); ++i) {
      rollout.rewards[static_cast<std::size_t>(rollout.RowOf(slots[i]))] = value;
      reinterpret_cast<float*>(batch.next_observations)[i] = value;
    }
    rollout.Commit(batch);
  };
  step({0, 2}, 1);
  step({2}, 2);
  step({0, 1, 2}, 3);
  EXPECT_EQ(rollout.length(0), 2);
  EXPECT_EQ(rollout.length(1), 1);
  EXPECT_EQ(rollout.length(2), 3);
  EXPECT_EQ(rollout.size(), 6);
  std::vector<std::int32_t> rows(12);
  ASSERT_EQ(rollout.ListRows(rows), 6);
  rows.resize(6);
  std::vector<float> rewards;
  for (const std::int32_t row : rows) rewards.push_back(rollout.rewards[static_cast<std::size_t>(row)]);
  EXPECT_EQ(rewards, (std::vector<float>{1, 3, 3, 1, 2, 3}));
  const std::int32_t two = 2;
  EXPECT_EQ(*reinterpret_cast<const float*>(rollout.Stage({&two, 1}).observations), 3.0f);
  step({2}, 4);
  EXPECT_TRUE(rollout.full());
}

}  // namespace
}  // namespace consac::learn
