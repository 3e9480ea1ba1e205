// Values of a rollout: each is V of what its step saw by the model that acted, to the bit, whenever it is found.
#include "collect/rollout_collector.h"

#include <gtest/gtest.h>

#include <cstring>

#include "consac/env/buffer.h"

namespace consac::learn {
namespace {

class RolloutCollectorTest : public testing::TestWithParam<const char*> {
 protected:
  static constexpr std::int64_t kSteps = 30;   // of each slot
  static constexpr std::int32_t kSlots = 3;    // 90 rows: more than wait at once
  static constexpr std::size_t kFeatures = 2;  // an observation is what the network sees

  static RolloutOptions Options() {
    RolloutOptions options;
    options.n_steps = kSteps;
    return options;
  }
  static ActorCritic Model(const BehaviourSpec& behaviour) {
    nn::ActorCriticOptions layers;
    layers.arch = *nn::ParseNetArch(GetParam());
    layers.observation_size = kFeatures;
    ActionHead head = *ActionHead::Create(behaviour.action_layout);
    layers.action_size = head.size();
    return {*nn::Network::Create(nn::ActorCritic(layers)), std::move(head), behaviour, 3, 0.0f, {}};
  }

  RolloutCollectorTest() {
    Draw(buffer_.batch());
    collector_.Begin(buffer_.batch());
  }

  void Draw(Batch& batch) {
    for (std::size_t i = 0; i < kSlots * kFeatures; ++i)
      reinterpret_cast<float*>(batch.next_observations)[i] = rng_.Normal();
    for (std::size_t i = 0; i < kSlots; ++i) {
      batch.rewards[i] = rng_.Normal();
      batch.terminated[i] = batch.truncated[i] = 0;
    }
  }
  void Act() {
    buffer_.Advance();
    collector_.Act(buffer_.batch());
  }
  void Record() {
    Draw(buffer_.batch());
    collector_.Record(buffer_.batch());
  }
  float ValueOf(const std::byte* observation) {
    return *model_.ValuesOf(reinterpret_cast<const float*>(observation), 1);
  }
  void ExpectValues() {
    for (std::int64_t row = 0; row < kSteps * kSlots; ++row) {
      const float expected = ValueOf(collector_.rollout().observations(row));
      EXPECT_EQ(collector_.rollout().values[static_cast<std::size_t>(row)], expected) << row;
    }
  }

  const BehaviourSpec behaviour_ = BehaviourSpec::Of("default", *Space::Box(-9, 9, {2}), *Space::Discrete(2), kSlots);
  ActorCritic model_ = Model(behaviour_);
  RolloutCollector collector_{behaviour_, Options(), model_, 5, {}};
  BatchBuffer buffer_{behaviour_};
  Rng rng_{7, 7};
};

TEST_P(RolloutCollectorTest, EveryRowHasTheValueOfWhatItsStepSaw) {
  while (!collector_.full()) {
    Act();
    if (collector_.steps() == 12) {
      StateHasher saving;
      collector_.Visit(saving);  // with a step under way
    }
    Record();
  }
  EXPECT_EQ(collector_.Finish().size(), static_cast<std::size_t>(kSteps * kSlots));
  ExpectValues();
}

TEST_P(RolloutCollectorTest, AStepUnderWayIsValuedByTheModelThatActed) {
  for (const bool before_finish : {true, false}) {
    while (!collector_.full()) {
      Act();
      Record();
    }
    if (before_finish) Act();
    collector_.Finish();
    if (!before_finish) Act();  // between two pieces of an update
    std::vector<float> expected;
    for (std::size_t i = 0; i < kSlots; ++i)
      expected.push_back(ValueOf(buffer_.batch().observations + i * kFeatures * sizeof(float)));
    for (float& parameter : model_.parameters()) parameter += 0.1f;
    collector_.Restart();
    model_.Publish();
    Record();
    for (std::size_t i = 0; i < kSlots; ++i) {
      EXPECT_EQ(collector_.rollout().values[i], expected[i]) << i;
      EXPECT_NE(expected[i], ValueOf(buffer_.batch().observations + i * kFeatures * sizeof(float))) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(ApartAndShared, RolloutCollectorTest, testing::Values("[dict(pi=[8], vf=[8])]", "[8]"));

}  // namespace
}  // namespace consac::learn
