// The whole way in a second or two: an engine serves the road, the trainer learns it over TCP, the saved model walks.
// The full proofs on five seeds are tests/slow/learning_proofs.cpp.
#include <gtest/gtest.h>

#include "consac/run/training.h"
#include "tests/support.h"

namespace consac {
namespace {

const std::atomic<bool> kNeverStop{false};

run::RunConfig RoadConfig(const std::string& directory, const std::string& world) {
  run::RunConfig config;
  config.world = world;
  config.directory = directory;
  config.name = "walker";
  config.seed = 1;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  for (auto& setting : worlds::SuggestedSettings(**worlds::FindWorld("road-v0"), "ppo2")) {
    config.hyperparameters.push_back(setting);
  }
  return config;
}

TEST(Learning, TheRoadOverTcpThenTheModelWalksToTheCoin) {
  testing::ScratchFolder scratch("learning");
  EnvServerOptions options;
  options.training_length = 20000;
  options.seed = 1;
  testing::ServedWorld engine("road-v0", options);
  const auto summary = run::Train(RoadConfig(scratch.path(), engine.url()), kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, 20000);
  Result<Policy> policy = Policy::Load(summary->models[0].path);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  EXPECT_GE(testing::RoadAccuracy(*policy), 0.97);
}

TEST(Learning, OneSeedGivesOneResultWithAnyNumberOfThreads) {
  testing::ScratchFolder scratch("threads");
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 2, 3}) {
    run::RunConfig config = RoadConfig(scratch.path(), "cartpole-v1");
    config.hyperparameters = {{"n_steps", "256"}, {"nminibatches", "2"}};
    config.name = "threads" + std::to_string(threads);
    config.steps = 8192;
    config.envs = 4;
    config.threads = threads;
    const auto summary = run::Train(config, kNeverStop);
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    hashes.push_back(summary->weights_hash);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace consac
