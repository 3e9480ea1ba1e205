// Images from a world to a model: what is learned of them does not depend on the way they came, and the model acts.
#include <gtest/gtest.h>

#include "consac/run/training.h"
#include "tests/support.h"

namespace consac {
namespace {

const std::atomic<bool> kNobodyStops{false};

run::RunConfig PixelConfig(const std::string& directory, const std::string& world, const char* algorithm) {
  run::RunConfig config;
  config.world = world;
  config.directory = directory;
  config.name = "pixels";
  config.algorithm = algorithm;
  config.steps = 320;
  config.force = true;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  if (std::string_view(algorithm) == "dqn")
    config.hyperparameters = {{"buffer_size", "1000"}, {"learning_starts", "100"}};
  if (std::string_view(algorithm) == "ppo") config.hyperparameters = {{"n_steps", "160"}, {"n_epochs", "1"}};
  return config;
}

TEST(Images, TheWayTheyComeChangesNothing) {
  testing::ScratchFolder scratch("images");
  EnvServerOptions options;
  options.training_length = 320;
  testing::ServedWorld engine("pixel-catch-v0", options);
  for (const char* algorithm : {"dqn", "ppo", "a2c"}) {
    std::vector<std::uint64_t> hashes;
    for (const std::string& world : {std::string("pixel-catch-v0"), engine.url()}) {
      run::RunConfig config = PixelConfig(scratch.path(), world, algorithm);
      config.protocol = "2";
      config.lockstep = true;
      const auto summary = run::Train(config, kNobodyStops);
      ASSERT_TRUE(summary.ok()) << summary.status().message();
      hashes.push_back(summary->weights_hash);
      run::EvaluateOptions judging;
      judging.model = summary->models[0].path;
      judging.world = world;
      judging.episodes = 3;
      const auto verdict = run::Evaluate(judging, kNobodyStops);
      ASSERT_TRUE(verdict.ok()) << verdict.status().message();
      EXPECT_GE(verdict->front().mean_reward, -10.0);
      EXPECT_LE(verdict->front().mean_reward, 10.0);
    }
    EXPECT_EQ(hashes[0], hashes[1]) << algorithm;
  }
}

}  // namespace
}  // namespace consac
