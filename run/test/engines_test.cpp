// Several engines that train one model, agents that come and go, and learning while the next step is under way.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "consac/run/training.h"
#include "session.h"
#include "small_run.h"
#include "tests/support.h"
#include "tests/swarm_world.h"

namespace consac::run {
namespace {

using ::testing::HasSubstr;

using Served = consac::testing::ServedWorld;

/// Engines are asked for some steps, or refuse to begin.
EnvServerOptions Asking(double min_step_s = 0.0) {
  EnvServerOptions options;
  options.training_length = 1000;
  options.min_step_s = min_step_s;
  return options;
}

std::unique_ptr<VectorEnv> Roads(std::int32_t copies) {
  return (*worlds::FindWorld("road-v0"))->create(copies);
}

RunConfig RunOn(const std::string& directory, const std::string& name, const std::string& world, std::int64_t steps) {
  RunConfig config = SmallRun(directory, name);
  config.world = world;
  config.envs = 1;
  config.steps = steps;
  return config;
}

TEST(Engines, WhoeverHasFinishedFirstGoesOn) {
  consac::testing::ScratchFolder scratch("several");
  const EnvServerOptions slow = Asking(0.01);
  const Served quick(Roads(2), Asking()), late(Roads(3), slow);
  const Result<RunSummary> summary =
      Train(RunOn(scratch.path(), "both", quick.url() + "," + late.url(), 2000), kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_GE(summary->steps, 2000);
  EXPECT_LT(summary->steps, 2000 + 5);
  EXPECT_EQ(summary->steps, quick.steps() + late.steps()) << "every step that an engine took is learned from";
  EXPECT_GT(quick.steps(), 2 * late.steps());
  EXPECT_GT(late.steps(), 0);
  EXPECT_TRUE(Policy::Load(summary->models[0].path).ok());
}

TEST(Engines, InLockStepTheyWaitForEachOtherToLearn) {
  consac::testing::ScratchFolder scratch("several_lockstep");
  const Served one(Roads(2), Asking()), other(Roads(2), Asking());
  RunConfig config = RunOn(scratch.path(), "both", one.url() + "," + other.url(), 2000);
  config.lockstep = true;
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, one.steps() + other.steps());
}

TEST(Engines, ThoseThatOfferSomethingElseAreRefused) {
  consac::testing::ScratchFolder scratch("several_other");
  const Served road(Roads(2), Asking()), pole((*worlds::FindWorld("cartpole-v1"))->create(2), Asking());
  const Result<RunSummary> summary =
      Train(RunOn(scratch.path(), "both", road.url() + "," + pole.url(), 1000), kNeverStop);
  ASSERT_FALSE(summary.ok());
  EXPECT_THAT(summary.status().message(), HasSubstr("must offer the same"));
  EXPECT_THAT(summary.status().message(), HasSubstr(std::to_string(pole.port())));
}

TEST(Engines, TheOthersGoOnWhenOneIsLostAndItMayComeBack) {
  consac::testing::ScratchFolder scratch("several_lost");
  const EnvServerOptions frames = Asking(0.002);
  const Served stays(Roads(2), frames);
  auto leaves = std::make_unique<Served>(Roads(2), frames);
  const int port = leaves->port();
  const std::string world = stays.url() + "," + leaves->url();
  std::unique_ptr<Served> back;
  std::thread fate([&] {
    while (leaves->steps() < 50) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    leaves.reset();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    back = std::make_unique<Served>(Roads(2), frames, port);
  });
  const Result<RunSummary> summary = Train(RunOn(scratch.path(), "both", world, 6000), kNeverStop);
  fate.join();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_GE(summary->steps, 6000);
  EXPECT_GT(back->steps(), 0) << "the engine that came back is used again";
}

TEST(Engines, AgentsThatComeAndGoAreLearnedFromOverAWireAsInProcess) {
  consac::testing::ScratchFolder scratch("swarm");
  for (const bool respawn : {false, true}) {
    const std::string kind = respawn ? "respawn" : "together";
    RunConfig config = RunOn(scratch.path(), "local_" + kind, "swarm-v0", 1500);
    config.hyperparameters = {{"n_steps", "16"}, {"nminibatches", "1"}};
    const Result<RunSummary> local =
        RunSession(config, Length::kOfCaller,
                   Only(MakeLocalLink(std::make_unique<consac::testing::Swarm>(3, 3, respawn))), kNeverStop);
    ASSERT_TRUE(local.ok()) << local.status().message();
    const Served engine(std::make_unique<consac::testing::Swarm>(3, 3, respawn), Asking());
    RunConfig remote = RunOn(scratch.path(), "remote_" + kind, engine.url(), 1500);
    remote.hyperparameters = config.hyperparameters;
    remote.lockstep = true;
    const Result<RunSummary> outside = Train(remote, kNeverStop);
    ASSERT_TRUE(outside.ok()) << outside.status().message();
    EXPECT_EQ(local->weights_hash, outside->weights_hash) << kind;
    EXPECT_EQ(local->steps, outside->steps);
    EXPECT_EQ(outside->steps, engine.steps());
    EXPECT_GT(local->models[0].updates, 5);
    // Mean return of agents that live 2, 4 and 6 steps and earn their age at each.
    if (!respawn) {
      EXPECT_NEAR(local->models[0].mean_episode_reward, (3.0 + 10.0 + 21.0) / 3.0, 0.7);
    }
    // Each episode is whole, and its agent's own.
    std::ifstream monitor(local->directory + "/monitor.csv");
    std::string line;
    int row = 0;
    for (; std::getline(monitor, line); ++row) {
      if (row < 2) continue;
      const std::string known = line.substr(0, line.rfind(','));
      EXPECT_TRUE(known == "3.0,2" || known == "10.0,4" || known == "21.0,6") << line;
    }
    EXPECT_GT(row, 100);
    EXPECT_DOUBLE_EQ(local->models[0].mean_episode_reward, outside->models[0].mean_episode_reward);
  }
}

TEST(Engines, OneStepIsUnderWayWhileTheModelLearns) {
  consac::testing::ScratchFolder scratch("overlap");
  const EnvServerOptions frames = Asking(0.004);
  double seconds[2] = {};
  for (const bool lockstep : {false, true}) {
    const Served engine(Roads(4), frames);
    RunConfig config = RunOn(scratch.path(), lockstep ? "lockstep" : "overlap", engine.url(), 1200);
    config.lockstep = lockstep;
    const Result<RunSummary> summary = Train(config, kNeverStop);
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->steps, 1200);
    EXPECT_EQ(engine.steps(), 1200) << "no step is lost or taken in vain";
    seconds[lockstep ? 1 : 0] = summary->seconds;
  }
  RecordProperty("overlapping_ms", static_cast<int>(1e3 * seconds[0]));
  RecordProperty("lockstep_ms", static_cast<int>(1e3 * seconds[1]));
}

}  // namespace
}  // namespace consac::run
