// A2C as a whole: it learns trivial tasks with every kind of action, and its first update is the equations' by hand.
// What holds of every algorithm is every_learner_test.cpp's.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "consac/learn/buffer/rollout.h"
#include "learn/test/algo/training_harness.h"

namespace consac::learn {
namespace {

// Golden vector: r = [1, 0, 2, -1, 0.5], an episode's end at index 2, V after the last 0.7, gamma 0.99. With lambda 1
// the returns are A2C's. Computed from R_t = r_t + gamma (1 - d_t) R_(t+1).
TEST(A2c, ReturnsAreDiscountedSums) {
  const BehaviourSpec behaviour = BehaviourSpec::Of("default", *Space::Box(-1, 1, {1}), *Space::Discrete(2), 1);
  Rollout rollout(behaviour, 5, 1);
  const float rewards[] = {1.0f, 0.0f, 2.0f, -1.0f, 0.5f}, values[] = {0.5f, 0.4f, 0.3f, 0.2f, 0.1f};
  const std::vector<std::int32_t> slot{0};
  for (std::size_t t = 0; t < 5; ++t) {
    const Batch batch = rollout.Stage(slot);
    rollout.rewards[t] = rewards[t];
    rollout.values[t] = values[t];
    rollout.ended[t] = t == 2 ? 1 : 0;
    rollout.Commit(batch);
  }
  EstimateAdvantages(rollout, std::vector<float>{0.7f}, 0.99, 1.0);
  const double expected[] = {2.9602, 1.98, 2.0, 0.18107, 1.193};
  for (std::size_t t = 0; t < 5; ++t) EXPECT_NEAR(rollout.returns[t], expected[t], 1e-6) << t;
}

/// The first update of a learner whose network is one bias-like layer each, beside the equations in float64.
void ExpectFirstUpdateByHand(const char* optimizer, const char* use_rms_prop) {
  const IdentityEnv env(*Space::Discrete(2), 1);
  const Settings settings = {{"n_steps", "3"},          {"gamma", "0.9"},
                             {"vf_coef", "0.25"},       {"ent_coef", "0.05"},
                             {"max_grad_norm", "none"}, {"net_arch", "[dict(pi=[], vf=[])]"},
                             {"optimizer", optimizer},  {"use_rms_prop", use_rms_prop},
                             {"learning_rate", "0.1"}};
  const std::unique_ptr<Learner> learner = Make(env, {"a2c", settings, 100, 4});
  BatchBuffer own(env.spec().behaviours[0]);
  std::memset(own.batch().next_observations, 0, sizeof(std::int32_t));
  learner->Begin(own.batch());
  const std::vector<float> before = learner->Snapshot().parameters;
  // pi/head: w [2, 2], b [2]; vf/head: w [1, 2], b [1]. Every observation is 0: the one-hot (1, 0).
  const auto at = [&](int i) { return static_cast<double>(before[static_cast<std::size_t>(i)]); };
  const double z[] = {at(0) + at(4), at(2) + at(5)}, v = at(6) + at(8);
  const double largest = std::max(z[0], z[1]);
  const double sum = std::exp(z[0] - largest) + std::exp(z[1] - largest);
  const double p[] = {std::exp(z[0] - largest) / sum, std::exp(z[1] - largest) / sum};
  const double entropy = -(p[0] * std::log(p[0]) + p[1] * std::log(p[1]));
  int actions[3];
  const double rewards[] = {1.0, -0.5, 2.0};
  for (int t = 0; t < 3; ++t) {
    own.Advance();
    Batch& batch = own.batch();
    learner->Act(batch);
    std::memcpy(&actions[t], batch.actions, sizeof(int));
    batch.rewards[0] = static_cast<float>(rewards[t]);
    batch.terminated[0] = batch.truncated[0] = 0;
    std::memset(batch.next_observations, 0, sizeof(std::int32_t));
    learner->Record(batch);
  }
  while (learner->Learn({})) {
  }
  double gradient[9] = {}, next = v;
  for (int t = 2; t >= 0; --t) {
    next = rewards[t] + 0.9 * next;
    const double advantage = next - v;
    for (int j = 0; j < 2; ++j) {
      const double d_z =
          (advantage * (p[j] - (actions[t] == j ? 1.0 : 0.0)) + 0.05 * p[j] * (std::log(p[j]) + entropy)) / 3.0;
      gradient[2 * j] += d_z;
      gradient[4 + j] += d_z;
    }
    const double d_v = 0.25 * 2.0 * (v - next) / 3.0;
    gradient[6] += d_v;
    gradient[8] += d_v;
  }
  const std::vector<float> after = learner->Snapshot().parameters;
  const bool tensorflow = std::string(optimizer) == "tensorflow", rms = std::string(use_rms_prop) == "true";
  for (int i = 0; i < 9; ++i) {
    const double g = gradient[i];
    const double root = tensorflow ? std::sqrt(0.99 + 0.01 * g * g + 1e-5) : std::sqrt(0.01 * g * g) + 1e-5;
    const double adam_root = std::fabs(g) + (tensorflow ? 1e-5 / std::sqrt(0.001) : 1e-5);
    const double expected = at(i) - 0.1 * g / (rms ? root : adam_root);
    EXPECT_NEAR(after[static_cast<std::size_t>(i)], expected, 2e-5) << optimizer << " parameter " << i;
  }
}

TEST(A2c, TheFirstUpdateIsTheEquationsByHand) {
  ExpectFirstUpdateByHand("tensorflow", "true");
  ExpectFirstUpdateByHand("pytorch", "true");
  ExpectFirstUpdateByHand("pytorch", "false");
  ExpectFirstUpdateByHand("tensorflow", "false");
}

// Stable Baselines 2's learning test and its settings: 90 of 100.
TEST(A2c, LearnsTheIdentityOfTenStates) {
  EXPECT_GE(TrainedReward(*Space::Discrete(10), 1,
                          {"a2c",
                           {{"learning_rate", "1e-3"},
                            {"n_steps", "1"},
                            {"gamma", "0.7"},
                            {"ent_coef", "0.01"},
                            {"vf_coef", "0.25"},
                            {"optimizer", "tensorflow"}},
                           20000}),
            0.9);
}

TEST(A2c, LearnsTheIdentityOfEveryKindOfAction) {
  const Settings values = {{"gamma", "0.4"}, {"learning_rate", "2e-3"}};
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 4, {"a2c", values, 12000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::MultiDiscrete({3, 2}), 4, {"a2c", values, 24000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::MultiBinary(3), 4, {"a2c", values, 24000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 4, {"a2c", values, 60000}), 0.8);
  Settings by_state = values;
  for (const auto& setting : Settings{{"use_sde", "true"}, {"log_std_init", "-1"}}) by_state.push_back(setting);
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 4, {"a2c", by_state, 60000}), 0.8);
}

/// The learning rate of an update after `steps` of 1000 steps.
double RateAfter(const char* schedule, std::int64_t steps) {
  IdentityEnv env(*Space::Discrete(3), 1);
  const std::unique_ptr<Learner> learner = Make(
      env,
      {"a2c", {{"n_steps", "1"}, {"learning_rate", "1"}, {"lr_schedule", schedule}, {"max_grad_norm", "1e-9"}}, 1000});
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  while (learner->steps() < steps) Step(env, *learner, first.batch().slots);
  for (const Metric& metric : learner->metrics()) {
    if (metric.table_key == "train/learning_rate") return metric.value;
  }
  return -1.0;
}

// Stable Baselines 2, common/schedules.py, at q = (steps - 1) / 1000.
TEST(A2c, NamedSchedulesAreAsCoded) {
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("constant", 600)), 1.0f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("linear", 600)), 0.401f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("double_linear_con", 300)), 0.402f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("double_linear_con", 600)), 0.125f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("middle_drop", 200)), 0.801f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("middle_drop", 300)), 0.075f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("double_middle_drop", 600)), 0.075f);
  EXPECT_FLOAT_EQ(static_cast<float>(RateAfter("double_middle_drop", 900)), 0.125f);
}

TEST(A2c, ReportsAtTheFirstUpdateAndEveryHundredthUnderTheKeysThatWereAskedFor) {
  for (const char* keys : {"sb2", "sb3"}) {
    IdentityEnv env(*Space::Box(-1, 1, {1}), 2);
    const std::unique_ptr<Learner> learner = Make(env, {"a2c", {{"log_keys", keys}}, 10000});
    BatchBuffer first(env.spec().behaviours[0]);
    Begin(env, *learner, first);
    std::vector<std::int64_t> reported;
    std::int64_t reports = learner->reports();
    EXPECT_EQ(reports, 0);
    while (learner->updates() < 250) {
      Step(env, *learner, first.batch().slots);
      if (learner->reports() == reports) continue;
      reports = learner->reports();
      reported.push_back(learner->updates());
    }
    EXPECT_EQ(reported, (std::vector<std::int64_t>{1, 100, 200}));
    std::vector<std::string> found;
    for (const Metric& metric : learner->metrics()) found.emplace_back(metric.table_key);
    const std::vector<std::string> sb2 = {"nupdates", "policy_entropy", "value_loss", "explained_variance"},
                                   sb3 = {"train/entropy_loss", "train/explained_variance", "train/learning_rate",
                                          "train/n_updates",    "train/policy_loss",        "train/std",
                                          "train/value_loss"};
    for (const std::string& key : std::string(keys) == "sb2" ? sb2 : sb3)
      EXPECT_NE(std::find(found.begin(), found.end(), key), found.end()) << key;
  }
}

// Stable Baselines3, A2C.__init__, and Stable Baselines 2.10.2's.
TEST(Tables, A2cHasBothGenerationsNamesAndDefaults) {
  HyperparameterSet values((*FindAlgorithm("a2c"))->hyperparameters);
  EXPECT_DOUBLE_EQ(values.Real("learning_rate"), 7e-4);
  EXPECT_EQ(values.Integer("n_steps"), 5);
  EXPECT_DOUBLE_EQ(values.Real("ent_coef"), 0.0);
  EXPECT_DOUBLE_EQ(values.Real("vf_coef"), 0.5);
  EXPECT_DOUBLE_EQ(values.Real("rms_prop_eps"), 1e-5);
  EXPECT_EQ(values.Text("optimizer"), "pytorch");
  EXPECT_EQ(LogStyleOf(**FindAlgorithm("a2c"), values), LogStyle::kStableBaselines3);
  values.UseDefaultsOf(Generation::kStableBaselines2);
  EXPECT_DOUBLE_EQ(values.Real("ent_coef"), 0.01);
  EXPECT_DOUBLE_EQ(values.Real("vf_coef"), 0.25);
  EXPECT_DOUBLE_EQ(values.Real("epsilon"), 1e-5);
  EXPECT_EQ(values.Text("optimizer"), "tensorflow");
  EXPECT_EQ(LogStyleOf(**FindAlgorithm("a2c"), values), LogStyle::kStableBaselines2);
}

}  // namespace
}  // namespace consac::learn
