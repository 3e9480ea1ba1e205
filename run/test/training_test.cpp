#include "consac/run/training.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>
#include <fstream>
#include <thread>

#include "consac/base/file.h"
#include "consac/model/model_file.h"
#include "small_run.h"

namespace consac::run {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

RunSummary TrainOk(const RunConfig& config) {
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? *summary : RunSummary{};
}

std::vector<std::string> CheckpointsOf(const std::string& run) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(run + "/checkpoints"))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

TEST(Training, WritesARunAndSaysWhatItCameTo) {
  testing::ScratchFolder scratch("training");
  const std::clock_t before = std::clock();
  const RunSummary summary = TrainOk(SmallRun(scratch.path()));
  const double all = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  EXPECT_GT(summary.processor_seconds, 0.0);
  EXPECT_LT(summary.processor_seconds, all) << "to draw its curve is not to train";
  EXPECT_EQ(summary.directory, scratch.path() + "/small");
  EXPECT_EQ(summary.steps, 4096);
  EXPECT_EQ(summary.models[0].updates, 64);
  EXPECT_FALSE(summary.interrupted);
  EXPECT_FALSE(summary.acted_only);
  EXPECT_NE(summary.weights_hash, 0u);
  for (const char* file : {"config.yaml", "model.consac", "progress.csv", "monitor.csv", "curve.svg", "curve.png",
                           "checkpoints/step_000000004096.consac"}) {
    EXPECT_TRUE(fs::exists(summary.directory + "/" + file)) << file;
  }
  EXPECT_TRUE(Policy::Load(summary.models[0].path).ok());
}

TEST(Training, OneSeedGivesOneResultAndAnotherAnother) {
  testing::ScratchFolder scratch("seeds");
  const std::uint64_t first = TrainOk(SmallRun(scratch.path(), "a")).weights_hash;
  EXPECT_EQ(TrainOk(SmallRun(scratch.path(), "b")).weights_hash, first);
  RunConfig other = SmallRun(scratch.path(), "c");
  other.seed = 4;
  EXPECT_NE(TrainOk(other).weights_hash, first);
}

TEST(Training, TheWrittenConfigurationStartsTheSameRun) {
  testing::ScratchFolder scratch("again");
  const RunSummary first = TrainOk(SmallRun(scratch.path(), "a"));
  RunConfig again;
  ASSERT_TRUE(ReadYamlFile(first.directory + "/config.yaml", &again).ok());
  again.directory = scratch.path();
  again.name = "b";
  EXPECT_EQ(TrainOk(again).weights_hash, first.weights_hash);
}

TEST(Training, StepsThatFillNoRolloutAreTakenAllTheSame) {
  testing::ScratchFolder scratch("rest");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 100;  // one rollout of 64, then 36
  const RunSummary summary = TrainOk(config);
  EXPECT_EQ(summary.steps, 100);
  EXPECT_EQ(summary.models[0].updates, 1);
}

TEST(Training, ARunThatExistsIsNotTouchedUnlessAsked) {
  testing::ScratchFolder scratch("exists");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 128;
  const RunSummary first = TrainOk(config);
  const auto written = fs::last_write_time(first.models[0].path);
  const Result<RunSummary> second = Train(config, kNeverStop);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.status().code(), StatusCode::kAlreadyExists);
  EXPECT_THAT(second.status().message(), AllOf(HasSubstr("--resume"), HasSubstr("--force")));
  EXPECT_EQ(fs::last_write_time(first.models[0].path), written);

  config.force = true;
  config.seed = 99;
  std::ofstream(first.directory + "/notes.txt") << "mine";
  EXPECT_NE(TrainOk(config).weights_hash, first.weights_hash);
  EXPECT_TRUE(fs::exists(first.directory + "/notes.txt")) << "--force removes what a run writes and nothing else";
}

#if !defined(_WIN32)  // where a folder with an open file cannot be deleted
TEST(Training, WhoseFolderIsDeletedEndsAndDoesNotSayThatItSaved) {
  testing::ScratchFolder scratch("gone");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 1'000'000'000;
  config.checkpoint_every_updates = 1;
  std::atomic<bool> over{false};
  std::thread deleter([&] {
    while (!over && !fs::exists(scratch.path() + "/small/model.consac")) std::this_thread::yield();
    std::error_code ignored;
    while (!over && fs::exists(scratch.path() + "/small")) fs::remove_all(scratch.path() + "/small", ignored);
  });
  const Result<RunSummary> summary = Train(config, kNeverStop);
  over = true;
  deleter.join();
  ASSERT_FALSE(summary.ok());
  EXPECT_EQ(summary.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(summary.status().message(), AllOf(HasSubstr("was deleted"), HasSubstr("cannot be saved")));
}
#endif

TEST(Training, ResumingNothingSaysSo) {
  testing::ScratchFolder scratch("nothing");
  RunConfig config = SmallRun(scratch.path());
  config.resume = true;
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_FALSE(summary.ok());
  EXPECT_EQ(summary.status().code(), StatusCode::kNotFound);
}

TEST(Training, ResumingAFinishedRunChangesNothing) {
  testing::ScratchFolder scratch("finished");
  RunConfig config = SmallRun(scratch.path());
  const RunSummary first = TrainOk(config);
  config.resume = true;
  const RunSummary again = TrainOk(config);
  EXPECT_EQ(again.weights_hash, first.weights_hash);
  EXPECT_EQ(again.steps, first.steps);
}

TEST(Training, ALongerRunIsAResumedShorterOneWhereNothingIsScheduled) {
  testing::ScratchFolder scratch("longer");
  RunConfig whole = SmallRun(scratch.path(), "whole");
  whole.steps = 2048;
  RunConfig pieces = SmallRun(scratch.path(), "pieces");
  pieces.steps = 777;  // in the middle of a rollout
  TrainOk(pieces);
  pieces.resume = true;
  pieces.steps = 2048;
  EXPECT_EQ(TrainOk(pieces).weights_hash, TrainOk(whole).weights_hash);
}

TEST(Training, WhatTheResultDependsOnCannotChangeInARunThatGoesOn) {
  testing::ScratchFolder scratch("change");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 128;
  const RunSummary first = TrainOk(config);
  config.resume = true;
  const auto error = [&](auto&& change) {
    RunConfig changed = config;
    change(changed);
    const Result<RunSummary> summary = Train(changed, kNeverStop);
    EXPECT_FALSE(summary.ok());
    return summary.status().message();
  };
  EXPECT_THAT(error([](RunConfig& c) { c.seed = 8; }),
              HasSubstr("the run began with seed = '3' and cannot go on with '8'"));
  EXPECT_THAT(error([](RunConfig& c) { ASSERT_TRUE(ApplySetting("seed=0", &c).ok()); }), HasSubstr("with '0'"))
      << "asked for by name, even though it is the default";
  EXPECT_THAT(error([](RunConfig& c) { c.envs = 4; }), HasSubstr("envs"));
  EXPECT_THAT(error([](RunConfig& c) { c.world = "cartpole-v1"; }), HasSubstr("world"));
  EXPECT_THAT(error([](RunConfig& c) { c.algorithm = "ppo"; }), HasSubstr("algorithm"));
  EXPECT_THAT(error([](RunConfig& c) { c.hyperparameters = {{"gamma", "0.5"}}; }), HasSubstr("gamma"));
  RunConfig bare;
  bare.directory = scratch.path();
  bare.name = "small";
  bare.resume = true;
  bare.steps = 256;
  bare.threads = 2;
  RunConfig whole = SmallRun(scratch.path(), "whole");
  whole.steps = 256;
  EXPECT_EQ(TrainOk(bare).weights_hash, TrainOk(whole).weights_hash) << "a name is enough to go on";
}

// Wide networks and enough rows for threads to share.
TEST(Training, ThreadsChangeNoBitOfWhatLearnsFromAReplay) {
  testing::ScratchFolder scratch("threads");
  for (const auto& [algorithm, world] : {std::pair{"dqn", "cartpole-v1"}, std::pair{"ddpg", "pendulum-v1"},
                                         std::pair{"td3", "pendulum-v1"}, std::pair{"sac", "pendulum-v1"}}) {
    RunConfig config = SmallRun(scratch.path());
    config.algorithm = algorithm;
    config.world = world;
    config.steps = 330;
    config.envs = 1;
    config.force = true;
    config.hyperparameters = {
        {"net_arch", "[256,256]"}, {"batch_size", "300"}, {"learning_starts", "310"}, {"train_freq", "1"}};
    const std::uint64_t alone = TrainOk(config).weights_hash;
    for (const std::int32_t threads : {2, 3}) {
      config.threads = threads;
      EXPECT_EQ(TrainOk(config).weights_hash, alone) << algorithm << " with " << threads << " threads";
    }
  }
}

// A run that a broken number has ended goes on once it is told what to do with such numbers.
TEST(Training, WhatIsDoneWithNumbersThatAreNoneMayChange) {
  consac::testing::ScratchFolder scratch("watch");
  RunConfig config = SmallRun(scratch.path());
  config.world = "pendulum-v1";
  config.steps = 128;
  config.max_abs_reward = 0.001;
  EXPECT_THAT(Train(config, kNeverStop).status().message(), HasSubstr("raise the limit"));
  RunConfig on;
  on.directory = scratch.path();
  on.name = "small";
  on.resume = on.quiet = true;
  on.steps = 64;
  on.non_finite = "replace";
  Result<RunSummary> resumed = Train(on, kNeverStop);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  on.steps = 128;
  on.non_finite = "error";
  on.max_abs_reward = 100.0;
  ASSERT_TRUE(ApplySetting("non_finite=error", &on).ok());
  resumed = Train(on, kNeverStop);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  EXPECT_EQ(resumed->steps, 128);
}

// One that --force could not remove, or that somebody has put there.
TEST(Training, AnotherRunsCheckpointIsNotGoneOnWith) {
  consac::testing::ScratchFolder scratch("foreign_checkpoint");
  RunConfig config = SmallRun(scratch.path(), "one");
  config.steps = 640;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  const std::string of_one = scratch.path() + "/one/checkpoints";
  const auto refused = [&](const std::string& difference) {
    ASSERT_TRUE(Train(config, kNeverStop).ok());
    std::filesystem::remove_all(scratch.path() + "/" + config.name + "/checkpoints");
    std::filesystem::copy(of_one, scratch.path() + "/" + config.name + "/checkpoints");
    config.resume = true;
    const Result<RunSummary> resumed = Train(config, kNeverStop);
    ASSERT_FALSE(resumed.ok());
    EXPECT_EQ(resumed.status().code(), StatusCode::kDataLoss);
    EXPECT_NE(resumed.status().message().find("another run's: of " + difference), std::string::npos)
        << resumed.status().message();
    config.resume = false;
  };
  config.name = "other_seed";
  config.seed = 4;
  refused("seed = '3', where config.yaml says '4'");
  config.name = "other_gamma";
  config.seed = 3;
  config.hyperparameters.emplace_back("gamma", "0.9");
  refused("gamma = '0.99', where config.yaml says '0.9'");
}

TEST(Training, LearningThatDivergedEndsItAndSaysWhy) {
  testing::ScratchFolder scratch("diverged");
  RunConfig config = SmallRun(scratch.path());
  config.hyperparameters.emplace_back("learning_rate", "1e30");
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_EQ(summary.status().code(), StatusCode::kNonFinite);
  EXPECT_THAT(summary.status().message(), HasSubstr("learning rate"));
}

TEST(Training, OnlyTheLatestCheckpointsAreKept) {
  testing::ScratchFolder scratch("keep");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 640;
  config.checkpoint_every_updates = 1;
  config.keep_checkpoints = 2;
  EXPECT_THAT(CheckpointsOf(TrainOk(config).directory),
              ::testing::ElementsAre("step_000000000576.consac", "step_000000000640.consac"));
}

TEST(Training, ADamagedCheckpointIsPassedOver) {
  testing::ScratchFolder scratch("damaged");
  const std::uint64_t expected = TrainOk(SmallRun(scratch.path(), "whole")).weights_hash;
  RunConfig config = SmallRun(scratch.path(), "hurt");
  config.checkpoint_every_updates = 8;
  config.keep_checkpoints = 3;
  const RunSummary summary = TrainOk(config);
  const std::vector<std::string> all = CheckpointsOf(summary.directory);
  ASSERT_EQ(all.size(), 3u);
  fs::resize_file(summary.directory + "/checkpoints/" + all[2], 100);  // cut
  std::fstream(summary.directory + "/checkpoints/" + all[1], std::ios::in | std::ios::out)
      .seekp(-5, std::ios::end)
      .put('X');  // one byte
  config.resume = true;
  config.keep_checkpoints = 1;
  EXPECT_EQ(TrainOk(config).weights_hash, expected);
  EXPECT_EQ(CheckpointsOf(summary.directory).size(), 1u);
  const RunSummary again = TrainOk(config);
  EXPECT_EQ(again.weights_hash, expected) << "the one that is kept must be a good one";
}

TEST(Training, CheckpointsThatAreAllDamagedAreAnError) {
  testing::ScratchFolder scratch("hopeless");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 128;
  const RunSummary summary = TrainOk(config);
  for (const std::string& name : CheckpointsOf(summary.directory))
    fs::resize_file(summary.directory + "/checkpoints/" + name, 10);
  const Result<std::vector<std::byte>> before = ReadFile(summary.directory + "/config.yaml");
  config.resume = true;
  config.steps = 777;
  const Result<RunSummary> resumed = Train(config, kNeverStop);
  ASSERT_FALSE(resumed.ok()) << "what was learned must not be thrown away silently";
  EXPECT_EQ(*ReadFile(summary.directory + "/config.yaml"), *before);
  EXPECT_EQ(resumed.status().code(), StatusCode::kDataLoss);
  EXPECT_TRUE(Policy::Load(summary.models[0].path).ok());
}

TEST(Training, ACheckpointIsAModelFileThatIsNoModel) {
  testing::ScratchFolder scratch("kind");
  RunConfig config = SmallRun(scratch.path());
  config.steps = 64;
  const std::string path = TrainOk(config).directory + "/checkpoints/step_000000000064.consac";
  const Result<ModelFile> file = ModelFile::Load(path);
  ASSERT_TRUE(file.ok()) << file.status().message();
  EXPECT_THAT(file->spec_json, AllOf(HasSubstr("\"checkpoint\""), HasSubstr("instruction_set")));
  EXPECT_FALSE(Policy::Load(path).ok());
}

// Ctrl-C at any moment: everything is saved, and the run that goes on is the run that was never stopped.
void ExpectPiecesToEndAsTheWhole(RunConfig config) {
  const std::uint64_t expected = TrainOk(config).weights_hash;
  config.name = "pieces";
  int pieces = 0, whole = 0;
  for (int attempt = 0; attempt < 10000; ++attempt) {
    std::atomic<bool> stop{false};
    std::thread ctrl_c([&stop, attempt] {
      std::this_thread::sleep_for(
          std::chrono::microseconds(attempt < 3 ? 0 : 5000 + 1700 * (attempt % 7) + 500 * attempt));
      stop = true;
    });
    const Result<RunSummary> summary = Train(config, stop);
    ctrl_c.join();
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    ASSERT_TRUE(Policy::Load(summary->models[0].path).ok());
    ++pieces;
    if (!summary->interrupted) {
      EXPECT_EQ(summary->weights_hash, expected) << "after " << pieces << " pieces";
      if (pieces > 1) return;
      // On a busy machine Ctrl-C may come after the end: once more, from the beginning.
      ASSERT_LT(++whole, 20) << "nothing was interrupted";
      pieces = 0;
      attempt = -1;
    }
    config.resume = summary->interrupted;
    config.force = !config.resume;
  }
  FAIL() << "never finished";
}

TEST(Training, InterruptedAnywhereAndResumedEndsInTheSameWeights) {
  testing::ScratchFolder scratch("interrupt");
  // Updates of 320 optimiser steps, so that many an interruption falls into the middle of one.
  RunConfig config = SmallRun(scratch.path(), "whole");
  config.hyperparameters.insert(config.hyperparameters.end(), {{"noptepochs", "20"}, {"nminibatches", "16"}});
  ExpectPiecesToEndAsTheWhole(config);
}

TEST(Training, InterruptedAnywhereA2cEndsInTheSameWeightsToo) {
  testing::ScratchFolder scratch("interrupt_a2c");
  RunConfig config = SmallRun(scratch.path(), "whole");
  config.algorithm = "a2c";
  config.preset = "sb2";
  config.steps = 65536;
  config.hyperparameters[0].second = "8";
  ExpectPiecesToEndAsTheWhole(config);
}

TEST(Training, InterruptedAnywhereDqnEndsInTheSameWeightsReplayIncluded) {
  testing::ScratchFolder scratch("interrupt_dqn");
  ExpectPiecesToEndAsTheWhole(SmallReplayRun(scratch.path(), "whole"));
}

TEST(Training, InterruptedAnywhereSacEndsInTheSameWeightsReplayIncluded) {
  testing::ScratchFolder scratch("interrupt_sac");
  ExpectPiecesToEndAsTheWhole(SmallSacRun(scratch.path(), "whole"));
}

TEST(Training, BadConfigurationsAreRefusedBeforeAnythingIsWritten) {
  testing::ScratchFolder scratch("bad");
  const auto error = [&](auto&& change) {
    RunConfig config = SmallRun(scratch.path());
    change(config);
    const Result<RunSummary> summary = Train(config, kNeverStop);
    EXPECT_FALSE(summary.ok());
    return summary.status().message();
  };
  EXPECT_THAT(error([](RunConfig& c) { c.world = ""; }), HasSubstr("world"));
  EXPECT_THAT(error([](RunConfig& c) { c.world = "rode-v0"; }), HasSubstr("did you mean 'road-v0'"));
  EXPECT_THAT(error([](RunConfig& c) { c.algorithm = "ppo3"; }), HasSubstr("did you mean 'ppo2'"));
  EXPECT_THAT(error([](RunConfig& c) { c.hyperparameters = {{"gama", "1"}}; }), HasSubstr("did you mean 'gamma'"));
  EXPECT_THAT(error([](RunConfig& c) { c.hyperparameters = {{"nminibatches", "7"}}; }), HasSubstr("nminibatches"));
  EXPECT_THAT(error([](RunConfig& c) { c.name = "../escape"; }), HasSubstr("name"));
  EXPECT_THAT(error([](RunConfig& c) { c.name = std::string(300, 'x'); }), HasSubstr("name"));
  EXPECT_TRUE(fs::is_empty(scratch.path()));
}

// Also where a script reads the rest.
TEST(Training, ThatLearnsNothingSaysSoOnce) {
  for (const auto& small : {SmallRun, SmallReplayRun, SmallSacRun}) {
    testing::ScratchFolder scratch("nothing");
    RunConfig config = small(scratch.path(), "nothing");
    config.force = true;
    config.steps = 40;  // of 64 in a rollout, or 100 before learning begins
    ::testing::internal::CaptureStderr();
    TrainOk(config);
    const std::string said = ::testing::internal::GetCapturedStderr();
    const std::size_t first = said.find("warning: ");
    EXPECT_THAT(said, ::testing::AnyOf(HasSubstr("nothing will be learned"), HasSubstr("nothing was learned")))
        << config.algorithm;
    EXPECT_EQ(said.find("warning: ", first + 1), said.npos) << said;
    config.steps = 400;
    ::testing::internal::CaptureStderr();
    TrainOk(config);
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << config.algorithm;
  }
}

TEST(FindModel, TakesAPathOrANameAndSuggestsTheNearest) {
  testing::ScratchFolder scratch("find");
  RunConfig config = SmallRun(scratch.path(), "walker");
  config.steps = 64;
  const RunSummary summary = TrainOk(config);
  EXPECT_EQ(*FindModel("walker", scratch.path()), summary.models[0].path);
  EXPECT_EQ(*FindModel(summary.models[0].path, "elsewhere"), summary.models[0].path);
  EXPECT_EQ(*FindModel(summary.directory, "elsewhere"), summary.models[0].path);
  const Result<std::string> none = FindModel("wolker", scratch.path());
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.status().code(), StatusCode::kNotFound);
  EXPECT_THAT(none.status().message(), AllOf(HasSubstr("'wolker'"), HasSubstr("did you mean 'walker'")));
}

}  // namespace
}  // namespace consac::run
