// Hindsight experience replay around every algorithm that learns from a replay, on bit flipping, whose reward says
// nothing but whether the goal was reached: it learns what it does not learn without, one seed is one result whatever
// the threads and wherever it is saved, and what it cannot do is said in one line.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "consac/run/training.h"
#include "learn/test/algo/training_harness.h"
#include "run/test/small_run.h"
#include "tests/support.h"
#include "worlds/registry.h"

namespace consac {
namespace {

using learn::Setting;
using learn::Settings;
using run::RunConfig;
using testing::kUntilItEnds;

std::unique_ptr<VectorEnv> Bits(const std::string& algorithm, std::int32_t copies) {
  return (*worlds::FindWorld(algorithm == "dqn" ? "bit-flipping-v0" : "bit-flipping-continuous-v0"))->create(copies);
}

const std::vector<std::string>& OffPolicyAlgorithms() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> found;
    for (const learn::Algorithm& algorithm : learn::Algorithms()) {
      const auto relabels = [](const learn::Hyperparameter& one) {
        return std::string_view(one.name) == "replay_buffer_class";
      };
      if (std::ranges::any_of(algorithm.hyperparameters, relabels)) found.emplace_back(algorithm.name);
    }
    return found;
  }();
  return names;
}

Setting Small(const std::string& algorithm, const char* strategy = "future", const char* form = "sb3") {
  return {algorithm,
          {{"replay_buffer_class", "HerReplayBuffer"},
           {"goal_selection_strategy", strategy},
           {"her_form", form},
           {"n_sampled_goal", "3"},
           {"buffer_size", "300"},
           {"learning_starts", "60"},
           {"batch_size", "300"},
           {"net_arch", "[12]"},
           {"norm_obs", "true"},
           {"norm_reward", "true"}},
          480,
          5};
}

std::uint64_t StateAfter(const Setting& setting) {
  const std::unique_ptr<VectorEnv> env = Bits(setting.algorithm, 4);
  const std::unique_ptr<learn::Learner> learner = learn::Make(*env, setting);
  BatchBuffer first(env->spec().behaviours[0]);
  learn::Begin(*env, *learner, first);
  while (learner->steps() < setting.steps) learn::Step(*env, *learner, first.batch().slots);
  EXPECT_GT(learner->updates(), 20) << setting.algorithm;
  EXPECT_TRUE(learner->health().ok());
  return HashState(*learner);
}

TEST(HindsightReplay, OneSeedIsOneResultWithAnyNumberOfThreads) {
  for (const std::string& algorithm : OffPolicyAlgorithms()) {
    Setting setting = Small(algorithm);
    const std::uint64_t alone = StateAfter(setting);
    int threads = 3;
    setting.executor = learn::Threads(threads);
    EXPECT_EQ(StateAfter(setting), alone) << algorithm;
    setting.executor = {};
    setting.values[0].second = "ReplayBuffer";
    EXPECT_NE(StateAfter(setting), alone) << algorithm;
  }
}

TEST(HindsightReplay, EveryStrategyOfEitherFormIsItsOwn) {
  std::set<std::uint64_t> states;
  for (const char* strategy : {"future", "final", "episode", "random"}) {
    for (const char* form : {"sb2", "sb3"}) states.insert(StateAfter(Small("dqn", strategy, form)));
  }
  EXPECT_EQ(states.size(), 8u);
}

TEST(HindsightReplay, ARestoredLearnerGoesOnToTheSameBits) {
  for (const std::string& algorithm : OffPolicyAlgorithms()) {
    for (const char* strategy : {"future", "episode", "random"}) {
      const Setting setting = Small(algorithm, strategy);
      for (const int cut : {3, 17, 110}) {  // before anything is learned; in an episode; when the ring is full
        SCOPED_TRACE(algorithm + " " + strategy + " cut after " + std::to_string(cut));
        learn::LearnerTwins twins(Bits(algorithm, 4), Bits(algorithm, 4), setting);
        twins.Step(cut);
        ASSERT_NO_FATAL_FAILURE(twins.Restore());
        twins.ExpectTheSameBitsAfter(40);
      }
    }
  }
}

// A world behind a connection may fail: then nothing has been drawn or learned, and health says why; where it is asked
// again, it goes on to the same bits.
TEST(HindsightReplay, APriceThatCannotBeHadLeavesNoTrace) {
  for (const std::string& algorithm : OffPolicyAlgorithms()) {
    const Setting setting = Small(algorithm);
    const std::unique_ptr<VectorEnv> env = Bits(algorithm, 4);
    int asked = 0, failed = 0;
    learn::LearnerOptions options = learn::OptionsOf(*env, setting);
    options.price_goals = [&, price = options.price_goals](const std::byte* rows, std::int64_t count, float* rewards) {
      return ++asked % 3 == 0 ? price(rows, count, rewards) : Status(StatusCode::kUnavailable, "the cable was pulled");
    };
    const std::unique_ptr<learn::Learner> learner = learn::Make(options, setting);
    BatchBuffer first(env->spec().behaviours[0]);
    learn::Begin(*env, *learner, first);
    while (learner->steps() < setting.steps) {
      learn::Step(*env, *learner, first.batch().slots, 0);
      while (learner->LearningDue()) {
        const std::int64_t updates = learner->updates();
        const bool more = learner->Learn({1});
        const Status health = learner->health();
        EXPECT_EQ(learner->updates(), updates + (health.ok() ? 1 : 0));
        if (health.ok()) continue;
        ++failed;
        EXPECT_TRUE(more) << "it is still due";
        EXPECT_EQ(health.message(), "the cable was pulled");
      }
    }
    EXPECT_GT(failed, 40);
    EXPECT_EQ(HashState(*learner), StateAfter(setting)) << algorithm;
  }
}

RunConfig Flipping(const std::string& directory, const std::string& algorithm, const Settings& settings) {
  RunConfig config = run::SmallRun(directory, "flipping");
  config.world = algorithm == "dqn" ? "bit-flipping-v0" : "bit-flipping-continuous-v0";
  config.algorithm = algorithm;
  config.steps = 1000;
  config.seed = 0;
  config.envs = 1;
  config.force = true;
  config.hyperparameters.clear();
  for (const auto& [name, value] : settings) config.hyperparameters.emplace_back(name, value);
  return config;
}

/// Mean return of the model: -4 is the best there is, -10 that of one that never gets there.
double ReturnOf(const RunConfig& config) {
  const auto summary = run::Train(config, kUntilItEnds);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  if (!summary.ok()) return -10.0;
  run::EvaluateOptions options;
  options.model = summary->models[0].path;
  options.world = config.world;
  options.episodes = 100;
  const auto verdict = run::Evaluate(options, kUntilItEnds);
  EXPECT_TRUE(verdict.ok()) << verdict.status().message();
  return verdict.ok() ? verdict->front().mean_reward : -10.0;
}

TEST(HindsightReplay, LearnsToFlipTenBitsAndWithoutItDoesNot) {
  testing::ScratchFolder scratch("her_learns");
  Settings settings = {{"replay_buffer_class", "HerReplayBuffer"},
                       {"learning_rate", "1e-3"},
                       {"batch_size", "128"},
                       {"train_freq", "1"},
                       {"gamma", "0.95"},
                       {"buffer_size", "20000"},
                       {"target_update_interval", "200"},
                       {"net_arch", "[64]"},
                       {"learning_starts", "200"},
                       {"exploration_fraction", "0.3"}};
  RunConfig config = Flipping(scratch.path(), "dqn", settings);
  config.steps = 3000;
  EXPECT_GE(ReturnOf(config), -4.6) << "9 of 10 times at least it gets there";
  config.hyperparameters[0].second = "ReplayBuffer";
  EXPECT_LT(ReturnOf(config), -9.5);
}

TEST(HindsightReplay, WhatItCannotDoIsSaidInOneLine) {
  testing::ScratchFolder scratch("her_refused");
  const auto why = [&](const std::string& world, Settings settings, bool text = false) {
    settings.insert(settings.begin(), {"replay_buffer_class", "HerReplayBuffer"});
    RunConfig config = Flipping(scratch.path(), "dqn", settings);
    config.world = world;
    config.connect_timeout_s = 0.0;
    if (text) config.protocol = "text1";
    const auto summary = run::Train(config, kUntilItEnds);
    EXPECT_FALSE(summary.ok());
    EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/flipping"));
    return summary.status().message();
  };
  EXPECT_NE(why("road-v0", {}).find("HerReplayBuffer needs a world that can say what other goals would have paid"),
            std::string::npos);
  EXPECT_NE(why("bit-flipping-v0", {{"prioritized_replay", "true"}}).find("leave out prioritized_replay"),
            std::string::npos);
  EXPECT_NE(why("bit-flipping-v0", {{"n_steps", "3"}}).find("n_steps is 3; leave it at 1"), std::string::npos);
  EXPECT_NE(why("bit-flipping-v0", {{"goal_selection_strategy", "past"}}).find("future|final|episode|random"),
            std::string::npos);
  EXPECT_NE(why("bit-flipping-v0", {{"buffer_size", "1e9"}}).find("lower buffer_size"), std::string::npos);
  // Where no world could help, before anybody listens.
  const std::string nobody = "tcp://127.0.0.1:" + std::to_string((*ListenTcp({"127.0.0.1", 0}))->port());
  EXPECT_NE(why(nobody, {{"prioritized_replay", "true"}}).find("leave out prioritized_replay"), std::string::npos);
  EXPECT_NE(why(nobody, {{"n_steps", "3"}}).find("n_steps is 3; leave it at 1"), std::string::npos);
  EXPECT_NE(why(nobody, {}, true).find("and text protocol 1 cannot (protocol 2's capability 'relabel')"),
            std::string::npos);
}

// The learner itself, for whoever embeds it without a run.
TEST(HindsightReplay, ALearnerWithoutPricesIsNotMade) {
  for (const std::string& algorithm : OffPolicyAlgorithms()) {
    const learn::Algorithm* row = *learn::FindAlgorithm(algorithm);
    learn::HyperparameterSet values(row->hyperparameters);
    ASSERT_TRUE(values.Set("replay_buffer_class", "HerReplayBuffer").ok());
    EXPECT_TRUE(learn::RelabelsGoals(*row, values));
    learn::LearnerOptions options;
    options.behaviour = Bits(algorithm, 1)->spec().behaviours[0];
    const auto learner = row->create(options, values);
    ASSERT_FALSE(learner.ok());
    EXPECT_NE(learner.status().message().find("choose ReplayBuffer"), std::string::npos);
  }
}

TEST(HindsightReplay, TellsWhatItsMemoryTakes) {
  for (const std::string& algorithm : OffPolicyAlgorithms()) {
    Setting setting = Small(algorithm);
    setting.values.push_back({"buffer_size", "16000"});
    const std::unique_ptr<VectorEnv> env = Bits(algorithm, 1);
    const std::int64_t with = learn::Make(*env, setting)->memory_bytes();
    setting.values[0].second = "ReplayBuffer";
    EXPECT_EQ(with - learn::Make(*env, setting)->memory_bytes(), 17000 * 24) << algorithm;
  }
}

}  // namespace
}  // namespace consac
