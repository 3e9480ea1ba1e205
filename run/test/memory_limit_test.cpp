// max_memory_mib: what is learned from and learned has a limit, which is looked at before any of it is taken.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session.h"
#include "small_run.h"
#include "tests/two_worlds.h"

namespace consac::run {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

RunConfig ManyWorlds(const std::string& directory, std::int64_t mebibytes) {
  RunConfig config = SmallRun(directory, "many");
  config.envs = 2000;
  config.steps = 2000;
  config.hyperparameters.emplace_back("n_steps", "128");
  config.max_memory_mib = mebibytes;
  return config;
}

TEST(MaxMemory, ARolloutBeyondItIsRefusedBeforeAnythingIsWrittenAndMayBeRaised) {
  testing::ScratchFolder scratch("limit");
  const Status refused = Train(ManyWorlds(scratch.path(), 8), kNeverStop).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.message(), HasSubstr("256000 steps (n_steps times agents)"));
  EXPECT_THAT(refused.message(), HasSubstr("lower n_steps, or raise max_memory_mib (now 8)"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/many"));
  EXPECT_TRUE(Train(ManyWorlds(scratch.path(), 64), kNeverStop).ok());
}

TEST(MaxMemory, AHundredThousandEnvironmentsMeetTheLimitThatNobodySet) {
  testing::ScratchFolder scratch("default");
  RunConfig config = SmallRun(scratch.path());
  config.envs = 100000;
  config.hyperparameters.emplace_back("n_steps", "8192");
  EXPECT_THAT(Train(config, kNeverStop).status().message(), HasSubstr("max_memory_mib (now 8192)"));
}

// Less than the limit, but more than is read again.
TEST(MaxMemory, ARolloutThatNoCheckpointHoldsIsRefusedBeforeItIsMade) {
  for (const char* algorithm : {"ppo2", "a2c"}) {
    testing::ScratchFolder scratch("unsaved");
    RunConfig config = SmallRun(scratch.path());
    config.algorithm = algorithm;
    config.hyperparameters = {{"n_steps", "40000000"}};
    const std::string refused = Train(config, kNeverStop).status().message();
    EXPECT_THAT(refused, HasSubstr(" MiB for a rollout of 80000000 steps (n_steps times agents), of which"));
    EXPECT_THAT(refused, HasSubstr("at most 2016 are read again; lower n_steps or --envs"));
  }
}

TEST(MaxMemory, LayersThatCannotActAreToldAsThat) {
  testing::ScratchFolder scratch("layers");
  RunConfig config = SmallRun(scratch.path());
  for (const char* algorithm : {"ppo2", "dqn"}) {
    config.algorithm = algorithm;
    config.hyperparameters = {{"net_arch", "[1048576]"}};
    if (algorithm == std::string_view("dqn")) config.world = "cartpole-v1";
    const Status refused = Train(config, kNeverStop).status();
    EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
    EXPECT_THAT(refused.message(), HasSubstr("at most 1048576 can act; choose smaller layers"));
    EXPECT_THAT(refused.message(), Not(HasSubstr("max_memory_mib")));
  }
}

// 18 MiB of parameters, gradients and the optimiser's columns; 32 MiB of what 64 rows make of them, forward and back.
TEST(MaxMemory, CountsWhatAMinibatchMakesOfTheLayers) {
  for (const auto& small : {SmallRun, SmallReplayRun}) {
    testing::ScratchFolder scratch("activations");
    RunConfig config = small(scratch.path(), "small");
    config.steps = 16;
    config.hyperparameters.emplace_back("net_arch", "[65536]");
    config.max_memory_mib = 40;
    EXPECT_THAT(Train(config, kNeverStop).status().message(), HasSubstr("choose smaller layers"));
    config.max_memory_mib = 80;
    EXPECT_TRUE(Train(config, kNeverStop).ok()) << Train(config, kNeverStop).status().message();
  }
}

/// The least limit with which a run on this world begins.
std::int64_t LeastLimit(const std::vector<testing::Half>& halves) {
  for (std::int64_t mebibytes = 1; mebibytes < 200; ++mebibytes) {
    testing::ScratchFolder scratch("least");
    RunConfig config = SmallRun(scratch.path());
    config.world = "two-v0";
    config.steps = 10;
    config.hyperparameters.emplace_back("n_steps", "200000");
    config.max_memory_mib = mebibytes;
    const Status status =
        RunSession(config, Length::kOfCaller,
                   Only(MakeLocalLink(std::make_unique<testing::TwoWorlds>(halves[0], halves[1]))), kNeverStop)
            .status();
    if (status.ok()) return mebibytes;
    EXPECT_THAT(status.message(), HasSubstr("behaviour '")) << "which of them";
  }
  return 0;
}

TEST(MaxMemory, IsOfAllBehavioursTogether) {
  const std::int64_t one = LeastLimit({{"one", "road-v0", 2}, {"none", "road-v0", 1}});
  const std::int64_t two = LeastLimit({{"one", "road-v0", 2}, {"other", "road-v0", 2}});
  ASSERT_GT(one, 0);
  EXPECT_GT(two, one + one / 5);
}

}  // namespace
}  // namespace consac::run
