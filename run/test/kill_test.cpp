// SIGKILL at random moments: a child process trains, dies, is resumed, dies again, until it finishes; its weights must
// be those of a run that nobody touched, bit for bit.
#if !defined(_WIN32)  // it forks
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <random>
#include <thread>

#include "consac/base/file.h"
#include "small_run.h"

namespace consac::run {
namespace {

using Clock = std::chrono::steady_clock;

/// Trains in a child process; true when it was left alone long enough to finish.
bool TrainThenKill(const RunConfig& config, std::chrono::microseconds life) {
  const pid_t child = fork();
  if (child == 0) {
    const Result<RunSummary> summary = Train(config, kNeverStop);
    if (!summary.ok()) std::fprintf(stderr, "%s\n", summary.status().message().c_str());
    _exit(summary.ok() ? 0 : 1);
  }
  std::this_thread::sleep_for(life);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status)) {
    EXPECT_EQ(WEXITSTATUS(status), 0) << "the child failed by itself";
  }
  return WIFEXITED(status);
}

bool RunExists(const RunConfig& config) {
  return std::filesystem::exists(config.directory + "/" + config.name + "/config.yaml");
}

/// Kills trainings like `small` for `seconds` at least.
void ExpectKillsToLoseNothing(RunConfig (*small)(const std::string&, const std::string&), int seconds) {
  testing::ScratchFolder scratch("kill");
  const auto began = Clock::now();
  const Result<RunSummary> whole = Train(small(scratch.path(), "whole"), kNeverStop);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  const auto length = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - began);

  std::mt19937 random(20210531);
  int kills = 0, runs = 0, models = 0;
  const auto end = Clock::now() + std::chrono::seconds(seconds);
  while (runs == 0 || kills < 5 || Clock::now() < end) {
    RunConfig config = small(scratch.path(), "killed" + std::to_string(runs));
    config.checkpoint_every_updates = 1 + random() % 3;
    // Lives grow with every death, so that a slow machine finishes too.
    std::uniform_int_distribution<std::int64_t> life(0, length.count());
    for (int deaths = 0;; ++deaths) {
      config.resume = RunExists(config);
      if (TrainThenKill(config, std::chrono::microseconds(life(random) * (1 + deaths / 20)))) break;
      ++kills;
      const std::string model = config.directory + "/" + config.name + "/model.consac";
      if (std::filesystem::exists(model)) {
        const Result<Policy> left = Policy::Load(model);
        EXPECT_TRUE(left.ok()) << left.status().message();
        EXPECT_FALSE(std::filesystem::is_empty(config.directory + "/" + config.name + "/checkpoints"));
        ++models;
      }
      ASSERT_LT(deaths, 500) << "never finished";
    }
    ++runs;
    config.resume = true;
    const Result<RunSummary> summary = Train(config, kNeverStop);
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_EQ(summary->steps, whole->steps);
    ASSERT_EQ(summary->weights_hash, whole->weights_hash) << "run " << runs << " after " << kills << " kills in all";
  }
  EXPECT_GT(models, 0) << "of " << kills << " killed trainings none had left a model";
  ::testing::Test::RecordProperty("kills", kills);
  std::printf("%d kills over %d runs, all ended in weights %016llx\n", kills, runs,
              static_cast<unsigned long long>(whole->weights_hash));
}

TEST(Kill, AtAnyMomentLosesNothing) {
  ExpectKillsToLoseNothing(SmallRun, 12);
}

TEST(Kill, AtAnyMomentLosesNothingOfAReplay) {
  ExpectKillsToLoseNothing(SmallReplayRun, 8);
}

TEST(Kill, AtAnyMomentLosesNothingOfNoiseThatRemembers) {
  ExpectKillsToLoseNothing(SmallDdpgRun, 8);
}

TEST(Kill, AtAnyMomentLosesNothingOfGoalsThatWereNotMeant) {
  ExpectKillsToLoseNothing(SmallHindsightRun, 8);
}

}  // namespace
}  // namespace consac::run
#endif
