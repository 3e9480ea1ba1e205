// A disk that is full while saving: said aloud, nothing that was good is harmed, training goes on.
#if !defined(_WIN32)  // it forks
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#include <functional>

#include "small_run.h"

namespace consac::run {
namespace {

/// Runs `body` in a child process in which no file may grow past `bytes`: writes fail there as on a full disk.
int InChildWithFileLimit(rlim_t bytes, const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, bytes};
    setrlimit(RLIMIT_FSIZE, &limit);
    _exit(body());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 255;
}

TEST(Saving, AFullDiskStopsNeitherTrainingNorHarmsWhatIsThere) {
  consac::testing::ScratchFolder scratch("full");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 640;
  const Result<RunSummary> first = Train(config, kNeverStop);
  ASSERT_TRUE(first.ok()) << first.status().message();

  const int code = InChildWithFileLimit(4096, [&] {
    config.resume = true;
    config.steps = 1280;
    const Result<RunSummary> summary = Train(config, kNeverStop);
    return summary.ok() ? 0 : static_cast<int>(summary.status().code());
  });
  EXPECT_EQ(code, static_cast<int>(StatusCode::kResourceExhausted)) << "the end says that saving failed";

  EXPECT_TRUE(Policy::Load(first->models[0].path).ok()) << "the last good model is still there";
  config.resume = true;
  const Result<RunSummary> resumed = Train(config, kNeverStop);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  EXPECT_GE(resumed->steps, 640);
}

TEST(Saving, TheRunThatGoesOnAfterAFullDiskIsTheSameRun) {
  consac::testing::ScratchFolder scratch("same");
  const Result<RunSummary> whole = Train(SmallRun(scratch.path(), "whole"), kNeverStop);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  RunConfig config = SmallRun(scratch.path(), "hurt");
  config.checkpoint_every_updates = 4;
  config.steps = 1024;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  config.resume = true;
  config.steps = 4096;
  (void)InChildWithFileLimit(4096, [&] { return Train(config, kNeverStop).ok() ? 0 : 1; });
  const Result<RunSummary> resumed = Train(config, kNeverStop);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  EXPECT_EQ(resumed->weights_hash, whole->weights_hash);
}

// A checkpoint that could not be read again is refused before anything is trained, and one just below is resumed.
TEST(Saving, SoManyCopiesAreTakenAsACheckpointHolds) {
  consac::testing::ScratchFolder scratch("copies");
  RunConfig config = SmallRun(scratch.path(), "many");
  config.world = "cartpole-v1";
  config.hyperparameters = {{"n_steps", "1"}, {"nminibatches", "1"}, {"noptepochs", "1"}, {"net_arch", "[4]"}};
  config.envs = 40000;
  config.steps = 40000;
  const Result<RunSummary> refused = Train(config, kNeverStop);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.status().code(), StatusCode::kResourceExhausted);
  EXPECT_NE(refused.status().message().find("lower --envs"), std::string::npos) << refused.status().message();
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/many"));
  config.envs = 10000;
  config.steps = 10000;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  config.resume = true;
  config.steps = 20000;
  const Result<RunSummary> resumed = Train(config, kNeverStop);
  EXPECT_TRUE(resumed.ok()) << resumed.status().message();
}

}  // namespace
}  // namespace consac::run
#endif
