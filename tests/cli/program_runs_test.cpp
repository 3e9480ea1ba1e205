// The runs of the built program from outside: whatever ends them, nothing is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <limits>

#include "consac/server/env_client.h"
#include "tests/cli/program_fixture.h"
#include "tests/support.h"
#include "tests/two_worlds.h"

namespace consac {
namespace {

using testing::ExpectRefusal;
using testing::Outcome;
using testing::Program;
using testing::ProgramTest;
using testing::RunProgram;
using testing::TextOf;

TEST_F(ProgramTest, MoreMemoryThanThereIsIsRefusedNotTaken) {
#if defined(CONSAC_SANITIZED)
  GTEST_SKIP() << "sanitizers reserve more memory than there is";
#endif
  const std::string command = "cd " + folder() + " && ulimit -d 1000000 && " + CONSAC_PROGRAM +
                              " train cartpole-v1 --envs 100000 --set n_steps=300 --no-progress --no-table 2> memory";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 6);
  EXPECT_NE(TextOf(folder() + "/memory").find("memory"), std::string::npos) << TextOf(folder() + "/memory");
}

TEST_F(ProgramTest, AModelPlaysInAnEngineToo) {
  const std::string model = SmallRun("player");
  EnvServerOptions options;
  options.training_length = 1000;
  const testing::ServedWorld engine("road-v0", options);
  const Outcome outcome = RunProgram(folder(), {"play", model, engine.url(), "--steps", "5"});
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 5) << outcome.out;
}

/// The road, whose rewards are infinite.
class PricelessRoad final : public VectorEnv {
 public:
  const EnvSpec& spec() const override { return road_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { road_->Reset(seed, batches); }
  void Step(std::span<Batch> batches) override {
    road_->Step(batches);
    batches[0].rewards[0] = std::numeric_limits<float>::infinity();
  }
  void Visit(Archive& archive) override { archive("road", *road_); }

 private:
  std::unique_ptr<VectorEnv> road_ = (*worlds::FindWorld("road-v0"))->create(1);
};

TEST_F(ProgramTest, AReturnThatIsNoNumberIsNoSuccess) {
  const std::string model = SmallRun("judged");
  EnvServerOptions options;
  options.training_length = 1000;
  const testing::ServedWorld engine(std::make_unique<PricelessRoad>(), options);
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"eval", model, engine.url(), "--episodes", "1", "--max-episode-steps", "5"},
        std::vector<std::string>{"play", model, engine.url(), "--steps", "5", "--deadline", "20"}}) {
    const Outcome outcome = RunProgram(folder(), verb);
    EXPECT_EQ(outcome.code, 7) << verb[0] << ": " << outcome.out << outcome.error;
    EXPECT_NE(outcome.error.find("reward"), std::string::npos) << outcome.error;
  }
}

/// The road without its walker.
class DesertedRoad final : public VectorEnv {
 public:
  const EnvSpec& spec() const override { return road_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { road_->Reset(seed, batches); }
  void Step(std::span<Batch>) override {}
  std::span<const std::uint8_t> present(std::size_t) const override { return nobody_; }
  void Visit(Archive& archive) override { archive("road", *road_); }

 private:
  std::unique_ptr<VectorEnv> road_ = (*worlds::FindWorld("road-v0"))->create(1);
  const std::vector<std::uint8_t> nobody_ = {0};
};

TEST_F(ProgramTest, WhereNobodyTakesPartNothingIsPlayed) {
  const std::string model = SmallRun("alone");
  EnvServerOptions options;
  options.training_length = 1000;
  const testing::ServedWorld engine(std::make_unique<DesertedRoad>(), options);
  ExpectRefusal(RunProgram(folder(), {"play", model, engine.url(), "--steps", "5"}), 3,
                "no agent took part in 5 steps");
}

TEST_F(ProgramTest, ARunOfTwoBehavioursIsTrainedJudgedAndPlayedWhole) {
  EnvServerOptions options;
  options.training_length = 300;
  const testing::ServedWorld engine(std::make_unique<testing::TwoWorlds>(), options);
  const Outcome trained =
      RunProgram(folder(), {"train", engine.url(), "--name", "two", "--no-table", "--set", "n_steps=32"});
  ASSERT_EQ(trained.code, 0) << trained.error;
  EXPECT_NE(trained.out.find("models runs/two/walker.consac and runs/two/balancer.consac\n"), std::string::npos)
      << trained.out;
  const Outcome judged =
      RunProgram(folder(), {"eval", "two", engine.url(), "--episodes", "4", "--max-episode-steps", "50"});
  EXPECT_EQ(judged.code, 0) << judged.error;
  EXPECT_NE(judged.out.find("walker: 4 episodes: mean reward"), std::string::npos) << judged.out;
  EXPECT_NE(judged.out.find("balancer: 4 episodes: mean reward"), std::string::npos) << judged.out;
  const Outcome json =
      RunProgram(folder(), {"eval", "two", engine.url(), "--episodes", "4", "--max-episode-steps", "50", "--json"});
  EXPECT_EQ(json.out.rfind("{\"behaviours\":{\"balancer\":{\"episodes\":4,", 0), 0u) << json.out;
  const Outcome played = RunProgram(folder(), {"play", "two", engine.url(), "--steps", "2"});
  EXPECT_EQ(played.code, 0) << played.error;
  for (const char* line : {"   1  walker  observation", "   1  balancer  observation", "   2  balancer  observation"})
    EXPECT_NE(played.out.find(line), std::string::npos) << played.out;
  ExpectRefusal(RunProgram(folder(), {"play", "runs/two/walker.consac", engine.url()}), 2, "is one model");
  ExpectRefusal(RunProgram(folder(), {"inspect", "two"}), 2, "walker.consac");
}

TEST_F(ProgramTest, ARunThatExistsIsNeverOverwrittenUnasked) {
  const std::string model = SmallRun("mine");
  const std::string before = TextOf(model);
  ExpectRefusal(
      RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--name", "mine", "--no-table", "--no-progress"}), 2,
      "--resume");
  EXPECT_EQ(TextOf(model), before);
  EXPECT_EQ(RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--seed", "5", "--name", "mine", "--force",
                                  "--no-table", "--no-progress"})
                .code,
            0);
  EXPECT_NE(TextOf(model), before);
  ExpectRefusal(RunProgram(folder(), {"train", "--resume", "--name", "other"}), 2, "no run");
  ExpectRefusal(RunProgram(folder(), {"train", "road-v0", "--name", "../escape"}), 2, "'../escape'");
}

TEST_F(ProgramTest, DamagedCutAndForeignModelsAreRefused) {
  const std::string model = SmallRun("mine"), whole = TextOf(model);
  const auto write = [&](const std::string& text) { std::ofstream(folder() + "/bad.consac") << text; };
  write(whole.substr(0, whole.size() / 2));
  ExpectRefusal(RunProgram(folder(), {"play", "bad.consac"}), 6, "bad.consac");
  std::string flipped = whole;
  flipped[flipped.size() - 5] = static_cast<char>(flipped[flipped.size() - 5] ^ 1);
  write(flipped);
  ExpectRefusal(RunProgram(folder(), {"eval", "bad.consac"}), 6, "SHA-256");
  write("PK\x03\x04 this is a zip");
  ExpectRefusal(RunProgram(folder(), {"inspect", "bad.consac"}), 6, "not a usable model");
  ExpectRefusal(RunProgram(folder(), {"eval", "mien"}), 2, "'mine'");
  ExpectRefusal(RunProgram(folder(), {"eval", "mine", "cartpole-v1"}), 2, "(4,)");
}

TEST_F(ProgramTest, CtrlCSavesAndExits130AndTheRunGoesOn) {
  Program training(folder(),
                   {"train", "cartpole-v1", "--steps", "100000000", "--name", "long", "--no-table", "--no-progress"});
  const std::string progress = folder() + "/runs/long/progress.csv";
  for (int i = 0; i < 500 && TextOf(progress).empty(); ++i) usleep(20000);
  training.Signal(SIGINT);
  const Outcome outcome = training.Wait();
  EXPECT_EQ(outcome.code, 130) << outcome.error;
  EXPECT_NE(outcome.error.find("--resume"), std::string::npos);
  EXPECT_TRUE(Policy::Load(folder() + "/runs/long/model.consac").ok());
  Program resumed(folder(), {"train", "--resume", "--name", "long", "--no-table", "--no-progress"});
  usleep(500000);
  resumed.Signal(SIGTERM);
  EXPECT_EQ(resumed.Wait().code, 130);
}

TEST_F(ProgramTest, CtrlCDoesNotWaitForTheDelayBetweenTwoSteps) {
  ASSERT_EQ(RunProgram(folder(), {"train", "cartpole-v1", "--steps", "100", "--name", "mine", "--no-table"}).code, 0);
  for (const int heard : {SIGINT, SIGTERM, SIGHUP}) {
    Program play(folder(), {"play", "mine", "--delay", "3600"}, {.alarm_s = 60});
    for (int i = 0; i < 500 && play.out().empty(); ++i) usleep(20000);
    play.Signal(heard);
    EXPECT_EQ(play.Wait().code, 130);
  }
}

TEST_F(ProgramTest, AClosedTerminalSavesAsCtrlCDoes) {
  Program training(folder(),
                   {"train", "cartpole-v1", "--steps", "100000000", "--name", "long", "--no-table", "--no-progress"});
  for (int i = 0; i < 500 && TextOf(folder() + "/runs/long/progress.csv").empty(); ++i) usleep(20000);
  training.Signal(SIGHUP);
  training.Signal(SIGHUP);  // the terminal tells, and so does the shell
  const Outcome outcome = training.Wait();
  EXPECT_EQ(outcome.code, 130) << outcome.error;
  EXPECT_NE(outcome.error.find("everything is saved"), std::string::npos) << outcome.error;
  EXPECT_TRUE(Policy::Load(folder() + "/runs/long/model.consac").ok());
}

// As `| less` that nobody scrolls: the training goes on, and one signal ends it with everything saved.
TEST_F(ProgramTest, AReaderThatStandsStillStopsNothing) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_GT(fcntl(ends[1], F_SETPIPE_SZ, 4096), 0);
  Program training(folder(), {"train", "road-v0", "--steps", "100000000", "--name", "unread", "--set", "n_steps=64"},
                   {.out = ends[1]});
  close(ends[1]);
  const std::string progress = folder() + "/runs/unread/progress.csv";
  const auto lines = [&] {
    const std::string text = TextOf(progress);
    return std::count(text.begin(), text.end(), '\n');
  };
  for (int i = 0; i < 1500 && lines() < 100; ++i) usleep(20000);
  EXPECT_GE(lines(), 100) << "many more than the tables of which a pipe of 4 KiB has room for a few";
  training.Signal(SIGTERM);
  const Outcome outcome = training.Wait();
  close(ends[0]);
  EXPECT_EQ(outcome.code, 130) << outcome.error;
  EXPECT_NE(outcome.error.find("everything is saved"), std::string::npos) << outcome.error;
  EXPECT_TRUE(Policy::Load(folder() + "/runs/unread/model.consac").ok());
}

TEST_F(ProgramTest, ARunSaysThatItIsDoneWhateverElseItLeavesOut) {
  const Outcome first =
      RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--name", "quiet", "--no-table", "--no-progress"});
  EXPECT_NE(first.out.find("training completed: 300 steps"), std::string::npos) << first.out;
  const Outcome resumed = RunProgram(folder(), {"train", "--resume", "--name", "quiet", "--steps", "600"});
  EXPECT_NE(resumed.out.find("going on from step 300"), std::string::npos) << resumed.out;
  EXPECT_NE(resumed.out.find("training completed: 600 steps"), std::string::npos) << resumed.out;
  const Outcome json = RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--name", "json", "--json"});
  EXPECT_EQ(std::count(json.out.begin(), json.out.end(), '\n'), 1) << json.out;
  EXPECT_EQ(json.out[0], '{') << json.out;
}

TEST_F(ProgramTest, APipeInARunsFolderIsNamedAndNotWaitedFor) {
  SmallRun("piped");
  for (const char* file : {"progress.csv", "config.yaml"}) {
    const std::string path = folder() + "/runs/piped/" + file;
    std::filesystem::remove(path);
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    ExpectRefusal(RunProgram(folder(), {"train", "--resume", "--name", "piped", "--steps", "600"}), 6, file);
    std::filesystem::remove(path);
  }
}

TEST_F(ProgramTest, ALinkInARunsFolderIsNamedAndNotFollowed) {
  SmallRun("linked");
  const std::string theirs = folder() + "/theirs";
  for (const char* file : {"monitor.csv", "progress.csv"}) {
    const std::string path = folder() + "/runs/linked/" + file;
    std::filesystem::rename(path, theirs);
    const std::string before = TextOf(theirs);
    std::filesystem::create_symlink(theirs, path);
    ExpectRefusal(RunProgram(folder(), {"train", "--resume", "--name", "linked", "--steps", "600"}), 6, file);
    EXPECT_EQ(TextOf(theirs), before);
    std::filesystem::remove(path);
    std::filesystem::rename(theirs, path);
  }
}

TEST_F(ProgramTest, SeveralSettingsInOneGoAndAnotherAlgorithmsDefaults) {
  std::ofstream(folder() + "/run.yaml") << "world: road-v0\nalgorithm: ppo2\nsteps: 300\nn_steps: 17\n";
  const Outcome outcome = RunProgram(folder(), {"train", "--config", "run.yaml", "--name", "several", "--set",
                                                "gamma=0.5", "algorithm=ppo", "batch_size=32"});
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const std::string config = TextOf(folder() + "/runs/several/config.yaml");
  EXPECT_NE(config.find("algorithm: \"ppo\""), std::string::npos) << config;
  EXPECT_NE(config.find("  n_steps: 2048"), std::string::npos) << config;
  EXPECT_NE(config.find("  batch_size: 32"), std::string::npos) << config;
  EXPECT_NE(config.find("  gamma: 0.5"), std::string::npos) << config;
  EXPECT_NE(RunProgram(folder(), {"train", "--help"}).out.find("several may follow"), std::string::npos);
}

TEST_F(ProgramTest, SettingsOfAResumedRunAreOfItsOwnAlgorithm) {
  const Outcome began = RunProgram(folder(), {"train", "cartpole-v1", "--algo", "dqn", "--name", "q", "--steps", "200",
                                              "--set", "buffer_size=500", "--no-table", "--no-progress"});
  ASSERT_EQ(began.code, 0) << began.error;
  const auto resume = [&](const std::string& setting) {
    return RunProgram(folder(), {"train", "--resume", "--name", "q", "--steps", "300", "--set", setting});
  };
  ExpectRefusal(resume("buffer_size=600"), 2, "began with buffer_size = '500' and cannot go on with '600'");
  ExpectRefusal(resume("noptepochs=4"), 2, "algorithm dqn has no 'noptepochs'; ppo2, ppo have");
  const Outcome passed = RunProgram(folder(), {"train", "--resume", "--name", "q", "--steps", "150"});
  ExpectRefusal(passed, 2, "has 200 steps, and steps are counted from its beginning: 150 more are --steps 350");
  const Outcome whole = RunProgram(folder(), {"train", "--resume", "--name", "q"});
  EXPECT_EQ(whole.code, 0) << whole.error;
  EXPECT_NE(whole.out.find("the run has all of its 200 steps; --steps 400 trains as many more"), std::string::npos)
      << whole.out;
  const Outcome resumed = resume("buffer_size=500");
  EXPECT_EQ(resumed.code, 0) << resumed.error;
  EXPECT_NE(resumed.out.find("going on from step 200"), std::string::npos) << resumed.out;
}

TEST_F(ProgramTest, WhatTheFontsLackIsNotTheUsersBusiness) {
  setenv("FONTCONFIG_FILE", "/nonexistent", 1);
  const Outcome outcome =
      RunProgram(folder(), {"train", "road-v0", "--steps", "300", "--name", "plain", "--no-table", "--no-progress"});
  unsetenv("FONTCONFIG_FILE");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.error, "");
  EXPECT_FALSE(TextOf(folder() + "/runs/plain/curve.png").empty());
}

TEST_F(ProgramTest, ANetworkInTheMakingIsLeftAtTheFirstCtrlC) {
  Program training(folder(), {"train", "cartpole-v1", "--name", "wide", "--set", "net_arch=[3000,3000]"});
  usleep(1500000);
  const double start = Now();
  training.Signal(SIGINT);
  const Outcome outcome = training.Wait();
  EXPECT_LT(Now() - start, 3.0) << "which making it takes longer than";
  ExpectRefusal(outcome, 130, "nothing is lost");
  EXPECT_FALSE(std::filesystem::exists(folder() + "/runs/wide"));
}

TEST_F(ProgramTest, AFullDiskIsLoudAndTheLastGoodFilesStay) {
  const std::string model = SmallRun("mine"), before = TextOf(model);
  const Outcome outcome =
      Program(folder(), {"train", "--resume", "--name", "mine", "--steps", "2000", "--no-table", "--no-progress"},
              {.limits = {{RLIMIT_FSIZE, 8192}}})
          .Wait();
  EXPECT_EQ(outcome.code, 6) << outcome.out << outcome.error;
  EXPECT_EQ(TextOf(model), before);
  EXPECT_EQ(RunProgram(folder(), {"play", "mine", "--steps", "3"}).code, 0);
}

TEST_F(ProgramTest, AnEngineAsksForAModelToActAndForeverServesBoth) {
  SmallRun("walker");
  Program engine(folder(),
                 {"serve", "road-v0", "--port", "0", "--port-file", "port", "--model", "walker", "--sessions", "1"});
  for (int i = 0; i < 250 && TextOf(folder() + "/port").empty(); ++i) usleep(20000);
  const std::string port = TextOf(folder() + "/port");
  Program actor(folder(), {"train", "tcp://127.0.0.1:" + port.substr(0, port.size() - 1), "--forever"});
  usleep(1000000);
  engine.Signal(SIGINT);
  EXPECT_EQ(engine.Wait().code, 130);
  usleep(300000);
  actor.Signal(SIGINT);
  const Outcome outcome = actor.Wait();
  EXPECT_EQ(outcome.code, 130) << outcome.out << outcome.error;
  EXPECT_NE(outcome.out.find("act"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace consac
