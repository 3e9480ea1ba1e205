#include "consac/env/gathered.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace consac {
namespace {

using ::testing::ElementsAre;

constexpr std::int32_t kSlots = 4;

struct Rows {
  Rows()
      : behaviour(BehaviourSpec::Of("default", *Space::Box(-100, 100, {1}), *Space::Discrete(5), kSlots)),
        buffer(behaviour),
        whole(buffer.batch()),
        gathered(behaviour) {
    for (std::int32_t i = 0; i < kSlots; ++i) {
      Number(whole.observations, i) = static_cast<float>(i);
      Number(whole.next_observations, i) = 10.0f + static_cast<float>(i);
      Number(whole.final_observations, i) = 20.0f + static_cast<float>(i);
      whole.rewards[i] = 30.0f + static_cast<float>(i);
      whole.terminated[i] = i == 1 ? 1 : 0;
      whole.truncated[i] = i == 3 ? 1 : 0;
      Action(whole, i) = 0;
    }
  }
  static float& Number(std::byte* rows, std::int32_t i) { return reinterpret_cast<float*>(rows)[i]; }
  static std::int32_t& Action(Batch& batch, std::int32_t i) {
    return reinterpret_cast<std::int32_t*>(batch.actions)[i];
  }
  BehaviourSpec behaviour;
  BatchBuffer buffer;
  Batch& whole;
  GatheredRows gathered;
};

TEST(GatheredRows, GoToAPartAndBack) {
  Rows rows;
  const std::uint8_t present[kSlots] = {0, 1, 0, 1};
  rows.gathered.ChoosePresent(present);
  EXPECT_THAT(rows.gathered.slots(), ElementsAre(1, 3));
  EXPECT_FALSE(rows.gathered.everyone());
  Batch part = rows.gathered.PartOf(rows.whole);
  ASSERT_NE(part.observations, rows.whole.observations);
  rows.gathered.TakeObservations(rows.whole, part);
  EXPECT_EQ(Rows::Number(part.observations, 1), 3.0f);
  Rows::Action(part, 0) = 2;
  Rows::Action(part, 1) = 4;
  rows.gathered.PutActions(part, rows.whole);
  EXPECT_EQ(Rows::Action(rows.whole, 1), 2);
  EXPECT_EQ(Rows::Action(rows.whole, 3), 4);
  EXPECT_EQ(Rows::Action(rows.whole, 0), 0);
  rows.gathered.TakeOutcome(rows.whole, part);
  EXPECT_EQ(part.rewards[1], 33.0f);
  EXPECT_EQ(part.terminated[0], 1);
  EXPECT_EQ(part.truncated[1], 1);
  EXPECT_EQ(Rows::Number(part.next_observations, 0), 11.0f);
  EXPECT_EQ(Rows::Number(part.final_observations, 1), 23.0f);
  Rows::Number(part.next_observations, 0) = -1.0f;
  rows.gathered.PutNext(part, rows.whole);
  EXPECT_EQ(Rows::Number(rows.whole.next_observations, 1), -1.0f);
}

TEST(GatheredRows, AreTheWholeWhereEveryoneIsChosen) {
  Rows rows;
  rows.gathered.ChoosePresent({});
  EXPECT_TRUE(rows.gathered.everyone());
  Batch part = rows.gathered.PartOf(rows.whole);
  EXPECT_EQ(part.observations, rows.whole.observations);
  rows.gathered.TakeOutcome(rows.whole, part);
  EXPECT_EQ(part.rewards[2], 32.0f);
}

TEST(GatheredRows, ArrivalsAreThoseThatWereNotThere) {
  Rows rows;
  const std::uint8_t before[kSlots] = {0, 1, 0, 1}, now[kSlots] = {1, 1, 1, 0};
  rows.gathered.ChoosePresent(before);
  GatheredRows arrivals(rows.behaviour);
  arrivals.ChooseArrivals(now, rows.gathered);
  EXPECT_THAT(arrivals.slots(), ElementsAre(0, 2));
  rows.gathered.ChoosePresent({});
  arrivals.ChooseArrivals(now, rows.gathered);
  EXPECT_TRUE(arrivals.slots().empty());
}

}  // namespace
}  // namespace consac
