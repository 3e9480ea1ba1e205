// Models by the C interface: what they are, that they act as they do in C++, what they refuse.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "engines/c/test/c_engine.h"
#include "engines/host/test/in_process.h"
#include "tests/remembering.h"
#include "tests/support.h"

namespace consac::testing {
namespace {

/// Of a few steps of CartPole.
Policy PolePolicy() {
  host::TrainOptions options;
  options.total_steps = 512;
  return *Policy::Create(InProcess("cartpole-v1", 2, options, 0)->Snapshot(), 1);
}
std::vector<float> Poles(std::size_t rows) {
  std::vector<float> poles(rows * 4);
  Rng rng(5);
  for (float& number : poles) number = rng.Normal();
  return poles;
}

TEST(CModel, ActsAsThePolicyDoesForAnyNumberOfRows) {
  Policy policy = PolePolicy();
  const OwnedModel model = Handle(policy);
  for (const std::size_t rows : {1u, 7u, 1000u}) {
    const std::vector<float> seen = Poles(rows);
    std::vector<std::int32_t> expected(rows), done(rows, -1);
    Rng rng;
    for (std::size_t r = 0; r < rows; ++r) {
      policy.Act(reinterpret_cast<const std::byte*>(&seen[r * 4]), nullptr, 1, ActionMode::kDeterministic, rng,
                 reinterpret_cast<std::byte*>(&expected[r]));
    }
    ASSERT_TRUE(IsOk(consac_model_act(model.get(), seen.data(), rows * 16, done.data(), rows * 4)));
    EXPECT_EQ(done, expected);
  }
}

TEST(CModel, DrawsTheSameFromTheSameSeed) {
  const OwnedModel model = Handle(PolePolicy());
  const std::vector<float> seen = Poles(64);
  std::vector<std::int32_t> first(64), again(64), best(64);
  consac_acting acting{};
  acting.size = sizeof(acting);
  acting.observations = seen.data();
  acting.rows = 64;
  acting.sample = 1;
  for (std::vector<std::int32_t>* drawn : {&first, &again}) {
    ASSERT_TRUE(IsOk(consac_model_seed(model.get(), 9)));
    acting.actions = drawn->data();
    ASSERT_TRUE(IsOk(consac_model_act_rows(model.get(), &acting)));
  }
  ASSERT_TRUE(IsOk(consac_model_act(model.get(), seen.data(), 64 * 16, best.data(), 64 * 4)));
  EXPECT_EQ(first, again);
  EXPECT_NE(first, best);
}

// gSDE: an agent's noise is a function of what it sees, which stays until it begins anew.
TEST(CModel, ThatFollowsTheStateDrawsForEachAgent) {
  host::TrainOptions options;
  options.algorithm = "ppo";
  options.total_steps = 512;
  options.hyperparameters = {{"n_steps", "64"}, {"use_sde", "true"}};
  const OwnedModel model = Handle(*Policy::Create(InProcess("pendulum-v1", 2, options, 0)->Snapshot(), 1));
  ASSERT_TRUE(IsOk(consac_model_reserve(model.get(), 3)));
  const std::vector<float> seen = {0.6f, 0.8f, 1.0f, 0.6f, 0.8f, 1.0f};  // two rows of the same
  consac_acting acting{};
  acting.size = sizeof(acting);
  acting.observations = seen.data();
  acting.rows = 2;
  acting.sample = 1;
  const auto act = [&](std::vector<std::int32_t> agents, std::vector<std::uint8_t> begins = {0, 0}) {
    std::vector<float> torques(2);
    acting.agents = agents.data();
    acting.begins = begins.data();
    acting.actions = torques.data();
    EXPECT_TRUE(IsOk(consac_model_act_rows(model.get(), &acting)));
    return torques;
  };
  const std::vector<float> first = act({0, 2}, {1, 1});
  EXPECT_NE(first[0], first[1]) << "each has its own";
  EXPECT_EQ(act({2, 0}), (std::vector<float>{first[1], first[0]})) << "which goes with the agent, not with the row";
  const std::vector<float> anew = act({0, 2}, {1, 0});
  EXPECT_NE(anew[0], first[0]) << "an episode has noise of its own";
  EXPECT_EQ(anew[1], first[1]);
  std::vector<float> best(2);
  ASSERT_TRUE(IsOk(consac_model_act(model.get(), seen.data(), 24, best.data(), 8)));
  EXPECT_EQ(best[0], best[1]) << "the best action has none";
  std::vector<std::int32_t> far = {0, 3};
  acting.agents = far.data();
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &acting), CONSAC_INVALID_ARGUMENT,
                        "row 1 is agent 3; there is room for 3"));
}

TEST(CModel, DoesWhatItsMaskLeaves) {
  const OwnedModel model = Handle(PolePolicy());
  const std::vector<float> seen = Poles(2);
  std::vector<std::uint8_t> masks = {1, 0, 0, 1};
  std::int32_t done[2] = {-1, -1};
  consac_acting acting{};
  acting.size = sizeof(acting);
  acting.observations = seen.data();
  acting.actions = done;
  acting.rows = 2;
  acting.masks = masks.data();
  ASSERT_TRUE(IsOk(consac_model_act_rows(model.get(), &acting)));
  EXPECT_EQ(done[0], 0);
  EXPECT_EQ(done[1], 1);
  masks = {1, 1, 0, 0};
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &acting), CONSAC_INVALID_ARGUMENT,
                        "row 1 of the masks has nothing legal"));
}

TEST(CModel, SaysWhatItIs) {
  const OwnedModel model = Handle(PolePolicy());
  EXPECT_STREQ(consac_model_behaviour(model.get()), "default");
  EXPECT_EQ(consac_model_remembers(model.get()), 0);
  EXPECT_EQ(consac_model_row_bytes(model.get(), CONSAC_OBSERVATION), 16u);
  EXPECT_EQ(consac_model_row_bytes(model.get(), CONSAC_ACTION), 4u);
  EXPECT_EQ(consac_model_row_bytes(model.get(), CONSAC_MASK), 2u);
  EXPECT_EQ(consac_model_leaf_count(model.get(), CONSAC_OBSERVATION), 1u);
  consac_leaf leaf{};
  leaf.size = sizeof(leaf);
  ASSERT_TRUE(IsOk(consac_model_leaf(model.get(), CONSAC_ACTION, 0, &leaf)));
  EXPECT_EQ(leaf.kind, CONSAC_DISCRETE);
  EXPECT_EQ(leaf.type, CONSAC_INT32);
  EXPECT_EQ(leaf.mask_count, 2);
  double low = 0.0, high = 0.0;
  ASSERT_TRUE(IsOk(consac_model_bounds(model.get(), CONSAC_OBSERVATION, 0, 2, &low, &high)));
  EXPECT_NEAR(high, 0.418879, 1e-6);
  EXPECT_EQ(low, -high);
}

TEST(CModel, AnOlderCallersSmallerStructIsEnough) {
  const OwnedModel model = Handle(PolePolicy());
  consac_leaf leaf{};
  leaf.size = offsetof(consac_leaf, count);
  leaf.count = -7;
  ASSERT_TRUE(IsOk(consac_model_leaf(model.get(), CONSAC_ACTION, 0, &leaf)));
  EXPECT_EQ(leaf.type, CONSAC_INT32);
  EXPECT_EQ(leaf.count, -7);
}

TEST(CModel, IsSavedAndLoadedAsItIs) {
  const ScratchFolder folder("c_model");
  const OwnedModel model = Handle(PolePolicy());
  const std::string path = folder.path() + "/pole.consac";
  ASSERT_TRUE(IsOk(consac_model_save(model.get(), path.c_str())));
  consac_model* loaded = nullptr;
  ASSERT_TRUE(IsOk(consac_model_load(path.c_str(), &loaded)));
  EXPECT_EQ(BytesOf(OwnedModel(loaded).get()), BytesOf(model.get()));
  std::size_t room = 10;
  char few[10];
  EXPECT_TRUE(FailsWith(consac_model_bytes(model.get(), few, &room), CONSAC_RESOURCE_EXHAUSTED, "room for 10"));
  EXPECT_EQ(room, std::filesystem::file_size(path));
}

TEST(CModel, ThatIsDamagedIsRefusedAtEveryByteThatWasCut) {
  const std::vector<char> bytes = BytesOf(Handle(PolePolicy()).get());
  for (std::size_t size = 0; size < bytes.size(); size += 97) {
    consac_model* model = nullptr;
    ASSERT_NE(consac_model_load_bytes(bytes.data(), size, &model), CONSAC_OK) << size;
    ASSERT_EQ(model, nullptr);
  }
  std::vector<char> turned = bytes;
  turned[turned.size() / 2] = static_cast<char>(turned[turned.size() / 2] ^ 0x40);
  consac_model* model = nullptr;
  EXPECT_TRUE(FailsWith(consac_model_load_bytes(turned.data(), turned.size(), &model), CONSAC_DATA_LOSS, ""));
}

TEST(CModel, RefusesWhatDoesNotFit) {
  const OwnedModel model = Handle(PolePolicy());
  float seen[8] = {};
  std::int32_t done[2] = {};
  const auto act = [&](std::size_t seen_bytes, std::size_t done_bytes) {
    return consac_model_act(model.get(), seen, seen_bytes, done, done_bytes);
  };
  EXPECT_TRUE(FailsWith(act(15, 4), CONSAC_INVALID_ARGUMENT, "observations has 15 bytes"));
  EXPECT_TRUE(FailsWith(act(16, 3), CONSAC_INVALID_ARGUMENT, "actions has 3 bytes"));
  EXPECT_TRUE(FailsWith(act(32, 4), CONSAC_INVALID_ARGUMENT, "2 rows of observations, but 1 of actions"));
  EXPECT_TRUE(IsOk(act(0, 0)));
  seen[5] = std::nanf("");
  EXPECT_TRUE(FailsWith(act(32, 8), CONSAC_NON_FINITE, "row 1"));
  EXPECT_TRUE(FailsWith(consac_model_reserve(model.get(), -1), CONSAC_INVALID_ARGUMENT, "-1 rows"));
  consac_acting acting{};
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &acting), CONSAC_INVALID_ARGUMENT, "acting.size is 0"));
  acting.size = sizeof(acting);
  acting.rows = 1;
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &acting), CONSAC_INVALID_ARGUMENT, "observations is NULL"));
  acting.rows = -3;
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &acting), CONSAC_INVALID_ARGUMENT, "-3 rows"));
  struct {
    consac_acting known;
    std::int64_t further;
  } newer{};
  newer.known.size = sizeof(newer);
  EXPECT_TRUE(IsOk(consac_model_act_rows(model.get(), &newer.known)));
  newer.further = 1;
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &newer.known), CONSAC_INVALID_ARGUMENT, "does not know"));
}

TEST(CModel, ThatRemembersKeepsWhatEachAgentHasSeen) {
  const OwnedModel model = Handle(*Policy::Create(RememberingPolicy(), 1));
  ASSERT_EQ(consac_model_remembers(model.get()), 1);
  ASSERT_TRUE(IsOk(consac_model_reserve(model.get(), 300)));
  const float ones[2] = {1.0f, 1.0f};
  float sums[2] = {};
  std::int32_t agents[2] = {299, 4};
  std::uint8_t begins[2] = {1, 1};
  consac_acting acting{};
  acting.size = sizeof(acting);
  acting.observations = ones;
  acting.actions = sums;
  acting.rows = 2;
  acting.agents = agents;
  acting.begins = begins;
  for (int step = 1; step <= 3; ++step) {
    ASSERT_TRUE(IsOk(consac_model_act_rows(model.get(), &acting)));
    begins[0] = 0;
  }
  EXPECT_EQ(sums[0], 3.0f);
  EXPECT_EQ(sums[1], 1.0f);
  agents[1] = 300;
  EXPECT_TRUE(FailsWith(consac_model_act_rows(model.get(), &acting), CONSAC_INVALID_ARGUMENT, "row 1 is agent 300"));
}

}  // namespace
}  // namespace consac::testing
