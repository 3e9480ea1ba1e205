// Every algorithm learns the built-in identity world of every kind of action that it takes, and says so of the others.
#include <gtest/gtest.h>

#include "consac/run/training.h"
#include "tests/support.h"

namespace consac {
namespace {

const std::atomic<bool> kUntilTheEnd{false};

struct IdentityTask {
  const char* world;
  const char* algorithm;
  std::int64_t steps;
  std::vector<std::pair<std::string, std::string>> settings;
};

const std::vector<IdentityTask>& IdentityTasks() {
  using Values = std::vector<std::pair<std::string, std::string>>;
  const Values ppo = {{"n_steps", "64"}, {"gamma", "0.4"}, {"learning_rate", "2e-3"}, {"n_epochs", "4"}};
  const Values a2c = {{"gamma", "0.4"}, {"learning_rate", "2e-3"}};
  const Values dqn = {{"gamma", "0.1"},     {"learning_rate", "2e-3"},        {"buffer_size", "5000"},
                      {"train_freq", "1"},  {"learning_starts", "200"},       {"exploration_fraction", "0.5"},
                      {"batch_size", "32"}, {"target_update_interval", "200"}};
  const Values continuous = {
      {"gamma", "0.4"}, {"learning_rate", "1e-3"}, {"net_arch", "[64, 64]"}, {"action_noise", "normal"}};
  static const std::vector<IdentityTask> tasks = {
      {"identity-discrete-v0", "ppo", 20000, ppo},      {"identity-discrete-v0", "a2c", 40000, a2c},
      {"identity-discrete-v0", "dqn", 10000, dqn},      {"identity-multidiscrete-v0", "ppo", 20000, ppo},
      {"identity-multidiscrete-v0", "a2c", 40000, a2c}, {"identity-multibinary-v0", "ppo", 20000, ppo},
      {"identity-multibinary-v0", "a2c", 40000, a2c},   {"identity-box-v0", "ppo", 20000, ppo},
      {"identity-box-v0", "a2c", 40000, a2c},           {"identity-box-v0", "sac", 1200, continuous},
      {"identity-box-v0", "td3", 1200, continuous},     {"identity-box-v0", "ddpg", 1200, continuous},
  };
  return tasks;
}

Result<run::RunSummary> TrainIdentity(const IdentityTask& task, const std::string& directory) {
  run::RunConfig config;
  config.world = task.world;
  config.algorithm = task.algorithm;
  config.hyperparameters = task.settings;
  config.steps = task.steps;
  config.envs = std::string_view(task.algorithm) == "dqn" ? 1 : 4;
  config.directory = directory;
  config.name = "identity";
  config.force = true;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  return run::Train(config, kUntilTheEnd);
}

// Stable Baselines' own threshold: 90 of 100.
TEST(IdentityWorlds, EveryAlgorithmLearnsThem) {
  testing::ScratchFolder scratch("identity");
  for (const IdentityTask& task : IdentityTasks()) {
    const auto summary = TrainIdentity(task, scratch.path());
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    run::EvaluateOptions options;
    options.model = summary->models[0].path;
    options.world = task.world;
    options.episodes = 20;
    const auto verdict = run::Evaluate(options, kUntilTheEnd);
    ASSERT_TRUE(verdict.ok()) << verdict.status().message();
    EXPECT_GE(verdict->front().mean_reward, 90.0) << task.world << " by " << task.algorithm;
  }
}

TEST(IdentityWorlds, ActionsThatHaveNoValuesAreRefusedInOneLine) {
  testing::ScratchFolder scratch("identity_refused");
  for (const char* world : {"identity-box-v0", "identity-multidiscrete-v0", "identity-multibinary-v0"}) {
    const auto summary = TrainIdentity({world, "dqn", 100, {}}, scratch.path());
    EXPECT_NE(summary.status().message().find("choose ppo or a2c"), std::string::npos) << summary.status().message();
  }
}

}  // namespace
}  // namespace consac
