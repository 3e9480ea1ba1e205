// PPO as a whole: it learns trivial tasks with every kind of action, in pieces and from batches under way at once. What
// holds of every algorithm is every_learner_test.cpp's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "learn/test/algo/off_policy_harness.h"

namespace consac::learn {
namespace {

// Stable Baselines' own learning test and its settings: 90 of 100.
TEST(Ppo2, LearnsTheIdentityOfTenStates) {
  EXPECT_GE(TrainedReward(*Space::Discrete(10), 1, {"ppo2", {{"learning_rate", "1.5e-3"}, {"lam", "0.8"}}, 20000}),
            0.9);
}

TEST(Ppo, LearnsTheIdentityOfEveryKindOfAction) {
  const Settings values = {{"n_steps", "64"}, {"gamma", "0.4"}, {"learning_rate", "2e-3"}, {"n_epochs", "4"}};
  EXPECT_GE(TrainedReward(*Space::Discrete(4), 4, {"ppo", values, 6000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::MultiDiscrete({3, 2}), 4, {"ppo", values, 12000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::MultiBinary(3), 4, {"ppo", values, 12000}), 0.9);
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 4, {"ppo", values, 20000}), 0.8);
  EXPECT_GE(TrainedReward(*Space::Dict({{"a", *Space::Discrete(2)}, {"b", *Space::Discrete(3, 5)}}), 4,
                          {"ppo", values, 12000}),
            0.9);
}

TEST(Ppo, LearnsTheIdentityByExploringByTheState) {
  Settings values = {{"n_steps", "64"},   {"gamma", "0.4"},         {"learning_rate", "2e-3"}, {"n_epochs", "4"},
                     {"use_sde", "true"}, {"sde_sample_freq", "4"}, {"log_std_init", "-1"}};
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 4, {"ppo", values, 20000}), 0.8);
  values.push_back({"squash_output", "true"});
  values.push_back({"ent_coef", "0.001"});
  EXPECT_GE(TrainedReward(*Space::Box(-1, 1, {1}), 4, {"ppo", values, 20000}), 0.8);
  EXPECT_GE(TrainedReward(*Space::Dict({{"a", *Space::Discrete(2)}, {"b", *Space::Box(-1, 1, {1})}}), 4,
                          {"ppo", values, 20000}),
            0.7)
      << "choices beside numbers";
}

TEST(Ppo, WhatCannotBeExploredByTheStateIsOneLine) {
  const auto error = [](const Space& actions, const Settings& settings) {
    return ErrorOf("ppo", BehaviourSpec::Of("arm", *Space::Box(-1, 1, {2}), actions, 1), settings, 1 << 30);
  };
  EXPECT_EQ(error(*Space::Box(-1, 1, {2}), {{"use_sde", "true"}, {"squash_output", "true"}}), "");
  EXPECT_NE(error(*Space::Discrete(3), {{"use_sde", "true"}}).find("use_sde is for Box actions, and those of 'arm'"),
            std::string::npos);
  EXPECT_NE(error(*Space::Box(-1, 1, {2}), {{"squash_output", "true"}}).find("squash_output goes with use_sde"),
            std::string::npos);
  EXPECT_NE(error(*Space::Box(-INFINITY, 1, {2}), {{"use_sde", "true"}, {"squash_output", "true"}})
                .find("between finite bounds"),
            std::string::npos);
  EXPECT_NE(error(*Space::Box(-1, 1, {1025}), {{"use_sde", "true"}, {"net_arch", "[1024]"}}).find("matrices"),
            std::string::npos);
}

TEST(Ppo, ABudgetBoundsTheWorkOfOneCall) {
  IdentityEnv env(*Space::Discrete(3), 2);
  const std::unique_ptr<Learner> learner =
      Make(env, {"ppo", {{"n_steps", "64"}, {"batch_size", "32"}, {"n_epochs", "2"}}, 1000});
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  EXPECT_FALSE(learner->Learn({}));
  for (int i = 0; i < 64; ++i) {
    Batch batch = learner->Stage(first.batch().slots);
    learner->Act(batch);
    env.Step({&batch, 1});
    learner->Record(batch);
  }
  ASSERT_TRUE(learner->LearningDue());
  int calls = 1;
  while (learner->Learn({1})) ++calls;
  EXPECT_EQ(calls, 8);  // 128 rows, 4 minibatches, 2 epochs
  EXPECT_FALSE(learner->LearningDue());
  EXPECT_EQ(learner->updates(), 1);
}

/// Answers a batch of an identity task by itself.
void Answer(Batch& batch, Rng& rng) {
  for (std::size_t r = 0; r < batch.slots.size(); ++r) {
    const std::int32_t seen = reinterpret_cast<std::int32_t*>(batch.observations)[r],
                       done = reinterpret_cast<std::int32_t*>(batch.actions)[r];
    batch.rewards[r] = seen == done ? 1.0f : 0.0f;
    batch.terminated[r] = batch.truncated[r] = 0;
    reinterpret_cast<std::int32_t*>(batch.next_observations)[r] = static_cast<std::int32_t>(rng.Below(3));
  }
}

// Two worlds that answer at their own pace, in batches of their own memory, are worth what one staged batch is.
TEST(Ppo, BatchesUnderWayAtOnceAreRecordedAsIfStaged) {
  const IdentityEnv env(*Space::Discrete(3), 4);
  BehaviourSpec half = env.spec().behaviours[0];
  half.slots = 2;
  const std::vector<std::int32_t> all{0, 1, 2, 3}, upper{2, 3};
  const auto begin = [&](Learner& learner, BatchBuffer& first) {
    std::memset(first.batch().next_observations, 0, 4 * sizeof(std::int32_t));
    learner.Begin(first.batch());
  };
  BatchBuffer first(env.spec().behaviours[0]), low(half), high(half);
  const Setting setting{"ppo2", {{"n_steps", "16"}}, 1000};
  const std::unique_ptr<Learner> staged = Make(env, setting), apart = Make(env, setting);
  begin(*staged, first);
  begin(*apart, first);
  std::memset(low.batch().next_observations, 0, 2 * sizeof(std::int32_t));
  std::memset(high.batch().next_observations, 0, 2 * sizeof(std::int32_t));
  Rng one(5, 5), other(5, 5);
  for (int step = 0; step < 16 * 4; ++step) {
    Batch batch = staged->Stage(all);
    staged->Act(batch);
    Answer(batch, one);
    staged->Record(batch);
    while (staged->Learn({})) {
    }
    low.Advance();
    high.Advance();
    Batch second = high.batch();
    second.slots = upper;
    apart->Act(low.batch());
    apart->Act(second);
    Answer(low.batch(), other);
    Answer(second, other);
    apart->Record(second);  // the one that was sent last comes back first
    apart->Record(low.batch());
    while (apart->Learn({})) {
    }
  }
  EXPECT_EQ(apart->updates(), 4);
  EXPECT_EQ(staged->Snapshot().parameters, apart->Snapshot().parameters);
}

TEST(Ppo, AStepThatWasUnderWayWhileItLearnedIsTheFirstOfTheNextRollout) {
  const IdentityEnv env(*Space::Discrete(3), 1);
  const std::unique_ptr<Learner> learner = Make(env, {"ppo2", {{"n_steps", "16"}, {"nminibatches", "4"}}, 100000});
  BatchBuffer own(env.spec().behaviours[0]);
  std::memset(own.batch().next_observations, 0, sizeof(std::int32_t));
  learner->Begin(own.batch());
  Rng rng(7, 7);
  double reward = 0.0;
  for (int step = 0; step < 16 * 300; ++step) {
    own.Advance();
    learner->Act(own.batch());
    while (learner->Learn({})) {  // between Act and Record
    }
    Answer(own.batch(), rng);
    learner->Record(own.batch());
    if (step >= 16 * 250) reward += own.batch().rewards[0];
  }
  EXPECT_EQ(learner->updates(), 299);
  EXPECT_EQ(learner->steps(), 16 * 300);
  EXPECT_GT(reward / (16 * 50), 0.9) << "it learns as it does in lock step";
}

// A state that is terminal has no value to bootstrap from, whatever else cut the episode there.
TEST(Ppo, TerminatedWinsWhereTruncatedIsSetToo) {
  std::vector<std::vector<float>> learned;
  for (const auto& [terminated, truncated] : {std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)}) {
    IdentityEnv env(*Space::Discrete(3), 2);
    const std::unique_ptr<Learner> learner = Make(env, {"ppo2", {{"n_steps", "16"}}, 1000});
    BatchBuffer first(env.spec().behaviours[0]);
    Begin(env, *learner, first);
    while (learner->updates() < 3) {
      Batch batch = learner->Stage(first.batch().slots);
      learner->Act(batch);
      env.Step({&batch, 1});
      for (std::int64_t r = 0; r < batch.rows(); ++r) {
        const bool ends = learner->steps() % 10 == 0;
        batch.terminated[r] = ends ? static_cast<std::uint8_t>(terminated) : 0;
        batch.truncated[r] = ends ? static_cast<std::uint8_t>(truncated) : 0;
        reinterpret_cast<std::int32_t*>(batch.final_observations)[r] = 1;
      }
      learner->Record(batch);
      while (learner->Learn({})) {
      }
    }
    learned.push_back(learner->Snapshot().parameters);
  }
  EXPECT_EQ(learned[0], learned[1]);
  EXPECT_NE(learned[0], learned[2]);
}

TEST(Ppo, ImagesAreDividedBy255UnlessTheyAreNormalised) {
  const Algorithm* algorithm = *FindAlgorithm("ppo");
  LearnerOptions options;
  options.behaviour = BehaviourSpec::Of("default", *Space::Box(0, 255, {4, 4, 3}, DType::kU8), *Space::Discrete(2), 1);
  HyperparameterSet values(algorithm->hyperparameters);
  ASSERT_TRUE(values.Set("n_steps", "64").ok());
  for (const char* normalise : {"false", "true"}) {
    ASSERT_TRUE(values.Set("norm_obs", normalise).ok());
    const auto learner = algorithm->create(options, values);
    ASSERT_TRUE(learner.ok()) << learner.status().message();
    const PolicyData model = (*learner)->Snapshot();
    const nn::Block& first = model.network.blocks[0];
    EXPECT_EQ(first.attributes.Number("divide_by") == 255.0, std::string_view(normalise) == "false");
    EXPECT_TRUE(Policy::Create(model, 1).ok());
  }
}

TEST(Ppo, NamesTheHyperparameterThatDoesNotFit) {
  IdentityEnv env(*Space::Discrete(3), 3);
  const Algorithm* algorithm = *FindAlgorithm("ppo2");
  LearnerOptions options;
  options.behaviour = env.spec().behaviours[0];
  HyperparameterSet values(algorithm->hyperparameters);
  ASSERT_TRUE(values.Set("n_steps", "5").ok());
  const Status status = algorithm->create(options, values).status();
  EXPECT_NE(status.message().find("nminibatches"), std::string::npos) << status.message();
  ASSERT_TRUE(values.Set("n_steps", "40000000").ok());
  options.max_bytes = std::int64_t{1} << 30;
  const Status large = algorithm->create(options, values).status();
  EXPECT_EQ(large.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(large.message().find("more than the 1024 that are allowed"), std::string::npos) << large.message();
  // A minibatch of many blocks has 16 gradients, each as large as the parameters.
  ASSERT_TRUE(values.Set("n_steps", "4096").ok());
  ASSERT_TRUE(values.Set("nminibatches", "1").ok());
  ASSERT_TRUE(values.Set("net_arch", "[1024, 1024, 1024]").ok());
  options.max_bytes = std::int64_t{2'100'000} * 20 * 4;
  const Status wide = algorithm->create(options, values).status();
  EXPECT_EQ(wide.code(), StatusCode::kResourceExhausted) << wide.message();
  EXPECT_NE(wide.message().find("parameters"), std::string::npos) << wide.message();
  // What could be learned but not loaded.
  ASSERT_TRUE(values.Set("net_arch", "[1048576]").ok());
  options.max_bytes = std::int64_t{64} << 30;
  const Status unloadable = algorithm->create(options, values).status();
  EXPECT_NE(unloadable.message().find("at most 1048576 can act"), std::string::npos) << unloadable.message();
  ASSERT_TRUE(values.Set("n_steps", "4").ok());
  ASSERT_TRUE(values.Set("net_arch", "[64, dict(pi=[x])]").ok());
  EXPECT_NE(algorithm->create(options, values).status().message().find("net_arch"), std::string::npos);
}

TEST(Ppo2, ReportsEveryKeyOfStableBaselines) {
  IdentityEnv env(*Space::Discrete(3), 2);
  const std::unique_ptr<Learner> learner = Make(env, {"ppo2", {{"n_steps", "16"}}, 1000});
  BatchBuffer first(env.spec().behaviours[0]);
  Begin(env, *learner, first);
  while (learner->updates() == 0) Step(env, *learner, first.batch().slots);
  std::vector<std::string> keys, tags;
  for (const Metric& metric : learner->metrics()) {
    if (!metric.table_key.empty()) keys.emplace_back(metric.table_key);
    if (!metric.tensorboard_tag.empty()) tags.emplace_back(metric.tensorboard_tag);
  }
  for (const char* key :
       {"approxkl", "clipfrac", "explained_variance", "policy_entropy", "policy_loss", "value_loss"}) {
    EXPECT_NE(std::find(keys.begin(), keys.end(), key), keys.end()) << key;
  }
  for (const char* tag :
       {"loss/entropy_loss", "loss/policy_gradient_loss", "loss/value_function_loss",
        "loss/approximate_kullback-leibler", "loss/clip_factor", "loss/loss", "input_info/discounted_rewards",
        "input_info/learning_rate", "input_info/advantage", "input_info/clip_range", "input_info/clip_range_vf",
        "input_info/old_neglog_action_probability", "input_info/old_value_pred"}) {
    EXPECT_NE(std::find(tags.begin(), tags.end(), tag), tags.end()) << tag;
  }
}

}  // namespace
}  // namespace consac::learn
