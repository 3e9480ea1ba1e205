// Predict and Predict Many beside the core's own policy, where an action is numbers.
#include "random_policy.h"
#include "tests/remembering.h"

namespace consac::testing {
namespace {

constexpr int kSeen = 5, kDone = 3, kRows = 200;
constexpr float kBound = 0.0625f;  // of an action's numbers

/// A policy with random weights that are large enough for some actions to meet their bounds.
Policy RandomPolicy() {
  Rng rng(4, 4);
  PolicyData data = RandomPolicyData(*Space::Box(-2, 2, {kSeen}), *Space::Box(-kBound, kBound, {kDone}), kSeen, kDone,
                                     {64, 64}, rng, 3.0f);
  data.log_std.assign(kDone, -1.0f);
  return *Policy::Create(std::move(data), 1);
}

TEST(Model, ActionsThatAreNumbersAreThePolicysBitForBit) {
  const ScratchFolder scratch("unreal_model");
  const std::string path = scratch.path() + "/box.consac";
  Policy policy = RandomPolicy();
  ASSERT_TRUE(policy.ToFile(1).Save(path).ok());
  Shim::Game game;
  EConsacResult result = EConsacResult::Failed;
  UConsacModel* model = nullptr;
  FConsacAction action;
  FString error;
  UConsacBlueprintLibrary::LoadConsacModel(nullptr, Text(path), result, model, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  Rng rng(1, 1);
  TArray<float> all, many;
  std::vector<float> expected;
  int at_a_bound = 0;
  for (int row = 0; row < kRows; ++row) {
    TArray<float> seen;
    for (int k = 0; k < kSeen; ++k) seen.Add(static_cast<float>(rng.Between(-2.0, 2.0)));
    float done[kDone];
    policy.Act(reinterpret_cast<const std::byte*>(seen.GetData()), nullptr, 1, ActionMode::kDeterministic, rng,
               reinterpret_cast<std::byte*>(done));
    model->Predict(seen, true, result, action, error);
    ASSERT_EQ(result, EConsacResult::Success) << Text(error);
    ASSERT_EQ(action.Values.Num(), kDone);
    ASSERT_EQ(std::memcmp(action.Values.GetData(), done, sizeof(done)), 0) << row;
    for (const float number : done) at_a_bound += std::abs(number) == kBound ? 1 : 0;
    expected.insert(expected.end(), done, done + kDone);
    for (int32 k = 0; k < kSeen; ++k) all.Add(seen[k]);
  }
  EXPECT_GT(at_a_bound, 0);
  EXPECT_LT(at_a_bound, kRows * kDone);
  model->PredictMany(all, true, result, many, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  ASSERT_EQ(static_cast<std::size_t>(many.Num()), expected.size());
  EXPECT_EQ(std::memcmp(many.GetData(), expected.data(), expected.size() * sizeof(float)), 0);
}

// Its action is the sum of what an agent saw since its episode began; each row is an agent.
TEST(Model, RemembersForEachRowUntilItsEpisodeBegins) {
  const ScratchFolder scratch("unreal_memory");
  const std::string path = scratch.path() + "/sum.consac";
  ASSERT_TRUE(Policy::Create(RememberingPolicy(), 1)->ToFile(1).Save(path).ok());
  Shim::Game game;
  EConsacResult result = EConsacResult::Failed;
  UConsacModel* model = nullptr;
  FConsacAction action;
  FString error;
  UConsacBlueprintLibrary::LoadConsacModel(nullptr, Text(path), result, model, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  TArray<float> one, many, actions;
  one.Add(1.0f);
  for (int i = 1; i <= 3; ++i) {
    model->Predict(one, true, result, action, error);
    ASSERT_EQ(action.Values[0], static_cast<float>(i));
  }
  for (int i = 0; i < 20; ++i) many.Add(2.0f);
  model->PredictMany(many, true, result, actions, error);
  ASSERT_EQ(actions.Num(), 20) << Text(error);
  EXPECT_EQ(actions[0], 5.0f) << "room for more rows forgets nothing";
  EXPECT_EQ(actions[19], 2.0f);
  model->BeginModelEpisode(0);
  model->BeginModelEpisode(99);
  model->PredictMany(many, true, result, actions, error);
  EXPECT_EQ(actions[0], 2.0f);
  EXPECT_EQ(actions[19], 4.0f);
  model->BeginModelEpisode();
  model->PredictMany(many, true, result, actions, error);
  EXPECT_EQ(actions[19], 2.0f);
}

}  // namespace
}  // namespace consac::testing
