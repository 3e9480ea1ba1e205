// What holds of every algorithm alike, whatever it computes: one seed is one result with any number of threads, what
// was saved anywhere goes on to the same bits, slots may step alone, and a model of the same network can be begun with.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <ostream>
#include <string>
#include <vector>

#include "learn/test/algo/training_harness.h"

namespace consac::learn {
namespace {

/// One algorithm, or one of its forms, with much of what it can do switched on.
struct LearnerCase {
  const char* name;       // of the form
  const char* algorithm;  // of the table
  Space actions;
  Settings values;
  Settings wide;            // besides: gradients of several blocks
  std::int64_t wide_steps;  // to train with those
  std::vector<int> cuts;    // steps after which it is saved
  Settings small;           // besides: more than twenty updates in a few hundred steps
  bool in_pieces = true;    // an update has several gradient steps
};
void PrintTo(const LearnerCase& row, std::ostream* out) {
  *out << row.name;
}

Settings With(Settings values, const Settings& more) {
  values.insert(values.end(), more.begin(), more.end());  // the later of two values holds
  return values;
}

const Settings kNormalised = {{"norm_obs", "true"}, {"norm_reward", "true"}};
const Settings kReplayed = With({{"buffer_size", "300"},
                                 {"learning_starts", "40"},
                                 {"batch_size", "100"},
                                 {"n_steps", "3"},
                                 {"gradient_steps", "3"}},
                                kNormalised);
const Settings kContinuous = With(kReplayed, {{"action_noise", "ornstein_uhlenbeck"}, {"net_arch", "[24, 16]"}});
const Settings kSac = With(
    kContinuous,
    {{"noise_std", "0.3"}, {"random_exploration", "0.1"}, {"ent_coef", "auto_0.1"}, {"target_update_interval", "2"}});
const Settings kWideReplayed = {{"batch_size", "1024"}};
const Settings kSmallReplayed = {
    {"learning_starts", "10"}, {"n_steps", "4"}, {"batch_size", "16"}, {"net_arch", "[8]"}};

std::vector<LearnerCase> LearnerRows() {
  const Space numbers = *Space::Box(-1, 1, {2}), choices = *Space::Discrete(3);
  return {
      {"ppo2",
       "ppo2",
       numbers,
       With({{"n_steps", "64"}, {"learning_rate", "lin_1e-3"}}, kNormalised),
       {{"n_steps", "256"}, {"nminibatches", "2"}},
       8192,
       {5, 63, 64, 100},
       {{"n_steps", "8"}}},
      {"ppo",
       "ppo",
       numbers,
       With({{"n_steps", "64"}, {"n_epochs", "3"}}, kNormalised),
       {{"n_steps", "256"}, {"batch_size", "1024"}},
       8192,
       {5, 63, 64, 100},
       {{"n_steps", "8"}}},
      {"a2c",
       "a2c",
       numbers,
       With({{"n_steps", "7"}, {"lr_schedule", "linear"}}, kNormalised),
       {{"n_steps", "64"}},
       8192,
       {5, 6, 7, 100},
       {},
       false},
      {"a2c_by_adam",
       "a2c",
       numbers,
       With({{"n_steps", "7"}, {"use_rms_prop", "false"}}, kNormalised),
       {{"n_steps", "64"}},
       4096,
       {5, 6, 7, 100},
       {},
       false},
      {"dqn",
       "dqn",
       choices,
       {{"learning_starts", "0"}, {"gradient_steps", "2"}},
       kWideReplayed,
       400,
       {1, 150},
       kSmallReplayed},
      {"dqn_with_everything",
       "dqn",
       choices,
       With(kReplayed, {{"prioritized_replay", "true"},
                        {"param_noise", "true"},
                        {"double_q", "true"},
                        {"target_update_interval", "90"},
                        {"tau", "0.5"},
                        {"dueling", "true"}}),
       kWideReplayed,
       1200,
       {1, 11, 12, 13, 14, 15, 100, 250},
       kSmallReplayed},
      {"sac", "sac", numbers, kSac, kWideReplayed, 400, {1, 11, 12, 13, 100}, kSmallReplayed},
      {"sac_with_a_value_network",
       "sac",
       numbers,
       With(kSac, {{"value_network", "true"}}),
       kWideReplayed,
       200,
       {1, 50},
       kSmallReplayed},
      {"sac_that_explores_by_the_state",
       "sac",
       numbers,
       With(kSac, {{"use_sde", "true"}, {"sde_sample_freq", "3"}, {"train_freq", "5"}, {"gradient_steps", "4"}}),
       kWideReplayed,
       200,
       {1, 12, 50},
       kSmallReplayed},
      {"ppo_that_explores_by_the_state",
       "ppo",
       numbers,
       With({{"n_steps", "64"}, {"n_epochs", "3"}, {"use_sde", "true"}, {"sde_sample_freq", "4"}}, kNormalised),
       {{"n_steps", "256"}, {"batch_size", "1024"}},
       8192,
       {5, 63, 64, 100},
       {{"n_steps", "8"}}},
      {"a2c_that_explores_by_the_state_and_squashes",
       "a2c",
       numbers,
       With({{"n_steps", "7"}, {"use_sde", "true"}, {"squash_output", "true"}, {"full_std", "false"}}, kNormalised),
       {{"n_steps", "64"}},
       4096,
       {5, 6, 7, 100},
       {},
       false},
      {"td3",
       "td3",
       numbers,
       With(kContinuous, {{"policy_delay", "2"}, {"random_exploration", "0.1"}}),
       kWideReplayed,
       400,
       {1, 11, 12, 13, 100},
       kSmallReplayed},
      {"td3_with_three_critics",
       "td3",
       numbers,
       With(kContinuous, {{"n_critics", "3"}}),
       kWideReplayed,
       200,
       {1, 50},
       kSmallReplayed},
      {"sac_with_four_critics",
       "sac",
       numbers,
       With(kSac, {{"n_critics", "4"}}),
       kWideReplayed,
       200,
       {1, 50},
       kSmallReplayed},
      {"ddpg",
       "ddpg",
       numbers,
       With(kContinuous, {{"param_noise", "true"},
                          {"param_noise_adaption_interval", "5"},
                          {"clip_norm", "0.5"},
                          {"action_layer", "1"},
                          {"critic_l2_reg", "0.01"},
                          {"normalize_returns", "true"},
                          {"enable_popart", "true"}}),
       kWideReplayed,
       400,
       {1, 11, 12, 13, 100},
       kSmallReplayed},
  };
}

std::string FormOf(const testing::TestParamInfo<LearnerCase>& info) {
  return info.param.name;
}

class EveryLearner : public testing::TestWithParam<LearnerCase> {
 protected:
  /// As far as saved states go; learning rates fall over more steps than are taken.
  Setting Saved() const { return {GetParam().algorithm, GetParam().values, 4096, 3}; }
};

TEST_P(EveryLearner, OneSeedIsOneResultWithAnyNumberOfThreads) {
  Setting setting{GetParam().algorithm, With(GetParam().values, GetParam().wide), GetParam().wide_steps, 7};
  const std::uint64_t alone = WeightsAfter(setting, GetParam().actions);
  for (int threads : {2, 5}) {
    setting.executor = Threads(threads);
    EXPECT_EQ(WeightsAfter(setting, GetParam().actions), alone) << threads;
  }
  setting.executor = {};
  setting.seed = 8;
  EXPECT_NE(WeightsAfter(setting, GetParam().actions), alone);
}

/// Two of them in worlds of their own.
LearnerTwins MakeTwins(const LearnerCase& row, const Setting& setting) {
  return {std::make_unique<IdentityEnv>(row.actions, 4), std::make_unique<IdentityEnv>(row.actions, 4), setting};
}

TEST_P(EveryLearner, RestoredItGoesOnToTheSameBits) {
  for (const int cut : GetParam().cuts) {
    SCOPED_TRACE(cut);
    LearnerTwins twins = MakeTwins(GetParam(), Saved());
    twins.Step(cut, 1);
    ASSERT_NO_FATAL_FAILURE(twins.Restore());
    twins.ExpectTheSameBitsAfter(200);
  }
}

class EveryLearnerInPieces : public EveryLearner {};

TEST_P(EveryLearnerInPieces, SavedInTheMiddleOfAnUpdateItGoesOnToTheSameBits) {
  LearnerTwins twins = MakeTwins(GetParam(), Saved());
  Learner& learner = *twins.learner;
  twins.Step(31);
  while (!learner.LearningDue()) {
    Batch batch = learner.Stage(twins.first.batch().slots);
    learner.Act(batch);
    twins.env->Step({&batch, 1});
    learner.Record(batch);
  }
  ASSERT_TRUE(learner.Learn({1})) << "gradient steps are left";
  ASSERT_NO_FATAL_FAILURE(twins.Restore());
  while (learner.Learn({})) {
  }
  while (twins.other->Learn({1})) {
  }
  twins.ExpectTheSameBitsAfter(200);
}

/// Any of the slots may step, and all begin again now and then.
TEST_P(EveryLearner, SlotsMayStepAloneAndBeginAgain) {
  IdentityEnv env(GetParam().actions, 4);
  const std::unique_ptr<Learner> learner =
      Make(env, {GetParam().algorithm, With(GetParam().values, GetParam().small), 1000});
  const Layout& seen = env.spec().behaviours[0].observation_layout;
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  Rng rng(1, 1);
  for (int i = 0; i < 400; ++i) {
    std::vector<std::int32_t> slots;
    for (std::int32_t slot = 0; slot < 4; ++slot) {
      if (rng.Below(2) == 0) slots.push_back(slot);
    }
    if (slots.empty()) continue;
    Batch batch = learner->Stage(slots);
    learner->Act(batch);
    for (std::size_t r = 0; r < slots.size(); ++r) {
      batch.rewards[r] = 1.0f;
      batch.terminated[r] = i % 7 == 0 ? 1 : 0;
      batch.truncated[r] = 0;
      SampleRow(seen, rng, batch.next_observations + r * seen.row_bytes);
    }
    std::memcpy(batch.final_observations, batch.next_observations, slots.size() * seen.row_bytes);
    learner->Record(batch);
    while (learner->Learn({})) {
    }
    if (i % 50 == 0) learner->Begin(first.batch());
  }
  EXPECT_GT(learner->updates(), 20);
  for (const float parameter : learner->Snapshot().parameters) ASSERT_TRUE(std::isfinite(parameter));
}

TEST_P(EveryLearner, StartsFromAModelOfTheSameNetwork) {
  IdentityEnv env(GetParam().actions, 2);
  const Settings settings =
      With(With(GetParam().values, GetParam().small), {{"net_arch", "[8]"}, {"norm_obs", "false"}});
  const auto make = [&](const Settings& values, std::uint64_t seed) {
    return Make(env, {GetParam().algorithm, values, 1000, seed});
  };
  const std::unique_ptr<Learner> learner = make(settings, 1), other = make(settings, 2),
                                 wider = make(With(settings, {{"net_arch", "[9]"}}), 2);
  EXPECT_NE(learner->Snapshot().parameters, other->Snapshot().parameters);
  ASSERT_TRUE(other->StartFrom(learner->Snapshot()).ok());
  EXPECT_EQ(learner->Snapshot().parameters, other->Snapshot().parameters);
  EXPECT_NE(wider->StartFrom(learner->Snapshot()).message().find("net_arch"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Learners, EveryLearner, testing::ValuesIn(LearnerRows()), FormOf);

std::vector<LearnerCase> LearnerRowsInPieces() {
  std::vector<LearnerCase> rows = LearnerRows();
  std::erase_if(rows, [](const LearnerCase& row) { return !row.in_pieces; });
  return rows;
}
INSTANTIATE_TEST_SUITE_P(Learners, EveryLearnerInPieces, testing::ValuesIn(LearnerRowsInPieces()), FormOf);

// A new algorithm is a row above.
TEST(EveryLearnerTable, TheRowsAreAllAlgorithms) {
  const std::vector<LearnerCase> rows = LearnerRows();
  for (const Algorithm& algorithm : Algorithms()) {
    EXPECT_TRUE(std::any_of(rows.begin(), rows.end(),
                            [&](const LearnerCase& row) { return std::string_view(row.algorithm) == algorithm.name; }))
        << algorithm.name << " has no row in every_learner_test.cpp";
  }
}

}  // namespace
}  // namespace consac::learn
