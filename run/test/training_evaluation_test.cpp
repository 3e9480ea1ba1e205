#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "small_run.h"
#include "system/system.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

RunConfig Pole(const std::string& directory, const std::string& name) {
  RunConfig config = SmallRun(directory, name);
  config.world = "cartpole-v1";
  return config;
}

RunSummary Trained(const RunConfig& config) {
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? *summary : RunSummary();
}

TEST(TrainingEvaluation, JudgesEverySoManyStepsAndChangesNothing) {
  consac::testing::ScratchFolder scratch("evaluating");
  const std::uint64_t plain = Trained(Pole(scratch.path(), "plain")).weights_hash;
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/plain/evaluations.csv"));
  RunConfig config = Pole(scratch.path(), "judged");
  config.eval_every = 1000;
  EXPECT_EQ(Trained(config).weights_hash, plain);
  std::istringstream rows(Read(scratch.path() + "/judged/evaluations.csv"));
  std::string header, row;
  std::getline(rows, header);
  EXPECT_THAT(header, HasSubstr("eval/mean_reward"));
  EXPECT_THAT(header, HasSubstr("total_timesteps"));
  int count = 0;
  while (std::getline(rows, row)) ++count;
  EXPECT_EQ(count, 4);
}

TEST(TrainingEvaluation, TheBestModelIsKept) {
  consac::testing::ScratchFolder scratch("best");
  RunConfig config = Pole(scratch.path(), "best");
  config.eval_every = 512;
  config.eval_episodes = 3;
  Trained(config);
  std::istringstream rows(Read(scratch.path() + "/best/evaluations.csv"));
  std::string header, row;
  std::getline(rows, header);
  double best = 0.0;
  for (int at = 0; std::getline(rows, row);) {
    std::istringstream cells(row);
    std::istringstream keys(header);
    std::string key, cell;
    while (std::getline(keys, key, ',') && std::getline(cells, cell, ',')) {
      if (key == "eval/mean_reward") best = std::max(best, std::stod(cell)), ++at;
    }
  }
  EvaluateOptions options;
  options.model = scratch.path() + "/best/best";
  options.episodes = 3;
  options.seed = config.seed + 1000;
  const Result<std::vector<EvaluateSummary>> verdict = Evaluate(options, kNeverStop);
  ASSERT_TRUE(verdict.ok()) << verdict.status().message();
  EXPECT_EQ(verdict->front().mean_reward, best);
}

TEST(TrainingEvaluation, AResumedRunIsJudgedAsOneThatWasNeverStopped) {
  consac::testing::ScratchFolder scratch("resumed");
  RunConfig config = Pole(scratch.path(), "whole");
  config.eval_every = 700;
  Trained(config);
  config.name = "cut";
  config.steps = 1600;
  Trained(config);
  config.steps = 4096;
  config.resume = true;
  Trained(config);
  EXPECT_EQ(Read(scratch.path() + "/cut/evaluations.csv"), Read(scratch.path() + "/whole/evaluations.csv"));
  EXPECT_EQ(Read(scratch.path() + "/cut/best/model.consac"), Read(scratch.path() + "/whole/best/model.consac"));
}

// In the middle of one, by Ctrl-C: on resume it is made up for at the step at which it was due.
TEST(TrainingEvaluation, OneThatWasStoppedIsMadeUpForAtTheSameStep) {
  consac::testing::ScratchFolder scratch("stopped");
  EnvServerOptions slow;
  slow.training_length = 1000000;
  slow.seed = 7;
  slow.min_step_s = 0.01;
  const consac::testing::ServedWorld judge("cartpole-v1", slow);
  RunConfig config = Pole(scratch.path(), "whole");
  config.steps = 512;
  config.eval_every = 200;
  config.eval_episodes = 1;
  config.eval_world = judge.url();
  Trained(config);
  config.name = "cut";
  for (int stopped = 0; stopped < 2; ++stopped, config.resume = true) {
    std::atomic<bool> stop{false};
    const std::int64_t steps = judge.steps();
    std::thread hand([&] {
      while (judge.steps() == steps || judge.steps() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      stop = true;
    });
    const Result<RunSummary> summary = Train(config, stop);
    hand.join();
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_TRUE(summary->interrupted);
    EXPECT_LT(summary->steps, 256) << "no step further than the one at which it is due";
  }
  Trained(config);
  EXPECT_EQ(Read(scratch.path() + "/cut/evaluations.csv"), Read(scratch.path() + "/whole/evaluations.csv"));
  EXPECT_EQ(Read(scratch.path() + "/cut/best/model.consac"), Read(scratch.path() + "/whole/best/model.consac"));
}

TEST(TrainingEvaluation, AHighEnoughRewardEndsTheTraining) {
  consac::testing::ScratchFolder scratch("goal");
  RunConfig config = Pole(scratch.path(), "judged");
  config.eval_every = 256;
  config.stop_reward = "9";
  const RunSummary judged = Trained(config);
  EXPECT_LT(judged.steps, 1024);
  EXPECT_FALSE(judged.interrupted);
  EXPECT_TRUE(std::filesystem::exists(scratch.path() + "/judged/model.consac"));
  RunConfig window = Pole(scratch.path(), "window");
  window.stop_reward = "9";
  const RunSummary ended = Trained(window);
  EXPECT_LT(ended.steps, 4096);
  EXPECT_GT(ended.steps, 900) << "a hundred episodes, of nine steps at least";
  window.name = "never";
  window.stop_reward = "501";
  EXPECT_EQ(Trained(window).steps, 4096);
}

TEST(TrainingEvaluation, WhatHasEndedSoIsNotTrainedOnByResumingItUnlessMoreIsWanted) {
  consac::testing::ScratchFolder scratch("goal_resumed");
  for (const std::int64_t eval_every : {0, 256}) {
    RunConfig config = Pole(scratch.path(), "every_" + std::to_string(eval_every));
    config.eval_every = eval_every;
    config.stop_reward = "9";
    const RunSummary ended = Trained(config);
    ASSERT_LT(ended.steps, 4096);
    config.resume = true;
    for (const char* no_more : {"9", "8.5", "8.8"}) {
      config.stop_reward = no_more;
      const RunSummary again = Trained(config);
      EXPECT_EQ(again.steps, ended.steps) << no_more;
      EXPECT_EQ(again.weights_hash, ended.weights_hash) << no_more;
      EXPECT_FALSE(again.interrupted);
    }
    config.stop_reward = "501";
    EXPECT_EQ(Trained(config).steps, config.steps);
  }
}

TEST(TrainingEvaluation, AnotherWorldCanBeNamed) {
  consac::testing::ScratchFolder scratch("elsewhere");
  RunConfig config = SmallRun(scratch.path(), "road");
  config.steps = 512;
  config.eval_every = 128;
  config.eval_world = "cartpole-v1";
  const auto error = [&] {
    const Result<RunSummary> refused = Train(config, kNeverStop);
    EXPECT_FALSE(refused.ok());
    return std::string(refused.status().message());
  };
  EXPECT_THAT(error(), AllOf(HasSubstr("eval_world 'cartpole-v1'"), HasSubstr("observation")));
  config.eval_world = "road-v0";
  EXPECT_EQ(Trained(config).steps, 512);
  EXPECT_TRUE(std::filesystem::exists(scratch.path() + "/road/best/model.consac"));
  config.name = "engine";
  config.world = "tcp://127.0.0.1:1";
  config.eval_world.clear();
  EXPECT_THAT(error(), HasSubstr("eval_world"));
}

EnvServerOptions Endless() {
  EnvServerOptions options;
  options.training_length = 1000000;
  return options;
}

// Before an earlier run is taken away, and before a step is trained.
TEST(TrainingEvaluation, AnEngineThatCannotJudgeIsRefusedAtTheStart) {
  consac::testing::ScratchFolder scratch("no_judge");
  RunConfig config = Pole(scratch.path(), "pole");
  config.eval_every = 256;
  config.connect_timeout_s = 0.1;
  const auto refused = [&](const std::string& url) {
    config.eval_world = url;
    const Result<RunSummary> summary = Train(config, kNeverStop);
    EXPECT_FALSE(summary.ok());
    EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/pole"));
    return summary.status();
  };
  const Status nobody = refused("tcp://127.0.0.1:9");
  EXPECT_EQ(nobody.code(), StatusCode::kUnavailable);
  EXPECT_THAT(nobody.message(), AllOf(HasSubstr("eval_world"), HasSubstr("127.0.0.1:9")));
  const consac::testing::ServedWorld road("road-v0", Endless());
  EXPECT_THAT(refused(road.url()).message(), AllOf(HasSubstr("eval_world '" + road.url()), HasSubstr("observation")));
}

// Saved all the same.
TEST(TrainingEvaluation, OneThatFailsAtTheEndIsTheRunsEndToo) {
  consac::testing::ScratchFolder scratch("judge_left");
  RunConfig config = Pole(scratch.path(), "pole");
  config.steps = 1 << 15;
  config.eval_every = 1 << 13;
  config.connect_timeout_s = 2.0;
  auto judge = std::make_unique<consac::testing::ServedWorld>("cartpole-v1", Endless());
  config.eval_world = judge->url();
  std::thread hand([&] {
    while (!std::filesystem::exists(scratch.path() + "/pole/config.yaml"))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    judge.reset();
  });
  const Result<RunSummary> ended = Train(config, kNeverStop);
  hand.join();
  ASSERT_FALSE(ended.ok());
  EXPECT_EQ(ended.status().code(), StatusCode::kUnavailable);
  EXPECT_THAT(ended.status().message(), AllOf(HasSubstr("the last evaluation failed"), HasSubstr("is saved in")));
  EXPECT_TRUE(Policy::Load(scratch.path() + "/pole/model.consac").ok());
}

/// A run of 256 steps that goes on to `steps`, and whose best model cannot be saved: a folder is where it is written
/// first.
RunConfig KeepingNoBest(const std::string& root, std::int64_t steps, std::int64_t eval_every) {
  RunConfig config = Pole(root, "pole");
  config.steps = 256;
  Trained(config);
  const std::string place = root + "/pole/best/model.consac.tmp-" + std::to_string(ProcessId());
  std::filesystem::create_directories(place);
  std::ofstream(place + "/somebody's") << "so that nobody sweeps it up";
  config.resume = true;
  config.steps = steps;
  config.eval_every = eval_every;
  return config;
}

TEST(TrainingEvaluation, APlaceWhereNoBestModelCanBeKeptIsSaidBeforeTheTraining) {
  consac::testing::ScratchFolder scratch("no_best_folder");
  RunConfig config = Pole(scratch.path(), "pole");
  config.steps = 256;
  Trained(config);
  std::ofstream(scratch.path() + "/pole/best") << "no folder";
  config.resume = true;
  config.steps = 1024;
  config.eval_every = 512;
  const Result<RunSummary> ended = Train(config, kNeverStop);
  EXPECT_EQ(ended.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(ended.status().message(), HasSubstr("/best' is no folder"));
}

TEST(TrainingEvaluation, ABestModelThatCannotBeSavedIsSaidAtTheEnd) {
  consac::testing::ScratchFolder scratch("no_best");
  const RunConfig config = KeepingNoBest(scratch.path(), 1024, 512);
  const Result<RunSummary> ended = Train(config, kNeverStop);
  ASSERT_FALSE(ended.ok());
  EXPECT_EQ(ended.status().code(), StatusCode::kDataLoss);
  EXPECT_THAT(ended.status().message(), AllOf(HasSubstr("/best/model.consac"), HasSubstr("is saved in")));
  EXPECT_TRUE(Policy::Load(scratch.path() + "/pole/model.consac").ok());
}

TEST(TrainingEvaluation, OfWhatFailsAtTheEndNothingIsSaidToGoOn) {
  consac::testing::ScratchFolder scratch("end");
  const RunConfig config = KeepingNoBest(scratch.path(), 512, 512);
  ::testing::internal::CaptureStderr();
  const Result<RunSummary> ended = Train(config, kNeverStop);
  EXPECT_EQ(::testing::internal::GetCapturedStderr().find("training goes on"), std::string::npos);
  EXPECT_THAT(ended.status().message(),
              AllOf(HasSubstr("the best model could not be saved"), HasSubstr("is saved in")));
}

// A script reads one line of JSON there.
TEST(TrainingEvaluation, WhatFailsIsNotSaidOnStandardOutputToAScript) {
  consac::testing::ScratchFolder scratch("quiet");
  const RunConfig config = KeepingNoBest(scratch.path(), 768, 256);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  EXPECT_FALSE(Train(config, kNeverStop).ok());
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("the best model could not be saved"));
}

TEST(TrainingEvaluation, ForceTakesTheEvaluationsAwayToo) {
  consac::testing::ScratchFolder scratch("forced");
  RunConfig config = Pole(scratch.path(), "again");
  config.steps = 512;
  config.eval_every = 256;
  Trained(config);
  config.eval_every = 0;
  config.force = true;
  Trained(config);
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/again/evaluations.csv"));
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/again/best"));
}

TEST(Init, BeginsWithTheWeightsOfAModel) {
  consac::testing::ScratchFolder scratch("init");
  const std::uint64_t first = Trained(Pole(scratch.path(), "first")).weights_hash;
  RunConfig config = Pole(scratch.path(), "second");
  config.init_model = "first";
  config.steps = 16;  // fewer than a rollout: nothing is learned
  EXPECT_EQ(Trained(config).weights_hash, first);
  const Result<Policy> model = Policy::Load(scratch.path() + "/second/model.consac");
  const Result<Policy> source = Policy::Load(scratch.path() + "/first/model.consac");
  ASSERT_TRUE(model.ok() && source.ok());
  for (std::size_t d = 0; d < source->data().normaliser.mean.size(); ++d)
    EXPECT_NEAR(model->data().normaliser.mean[d], source->data().normaliser.mean[d], 0.01);
}

TEST(Init, WhatDoesNotFitIsRefused) {
  consac::testing::ScratchFolder scratch("init_refused");
  Trained(Pole(scratch.path(), "first"));
  const auto error = [&](auto&& change) {
    RunConfig config = Pole(scratch.path(), "second");
    config.init_model = "first";
    change(config);
    const Result<RunSummary> refused = Train(config, kNeverStop);
    EXPECT_FALSE(refused.ok());
    EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/second/model.consac"));
    return std::string(refused.status().message());
  };
  EXPECT_THAT(error([](RunConfig& c) { c.hyperparameters[1].second = "[{pi: [8], vf: [16]}]"; }),
              HasSubstr("net_arch"));
  EXPECT_THAT(error([](RunConfig& c) { c.hyperparameters[2].second = "false"; }), HasSubstr("norm_obs=true"));
  EXPECT_THAT(error([](RunConfig& c) { c.world = "road-v0"; }), HasSubstr("observation"));
  EXPECT_THAT(error([](RunConfig& c) { c.init_model = "nobody"; }), HasSubstr("nobody"));
}

// A run may begin with its own weights; what is refused takes nothing away.
TEST(Init, AnEarlierRunGoesOnlyOnceTheNewOneCanBegin) {
  consac::testing::ScratchFolder scratch("init_forced");
  const std::uint64_t first = Trained(Pole(scratch.path(), "again")).weights_hash;
  const std::string model = Read(scratch.path() + "/again/model.consac");
  RunConfig config = Pole(scratch.path(), "again");
  config.force = true;
  config.init_model = "nobody";
  EXPECT_FALSE(Train(config, kNeverStop).ok());
  config.init_model.clear();
  config.eval_every = 100;
  config.eval_world = "road-v0";
  EXPECT_FALSE(Train(config, kNeverStop).ok());
  EXPECT_EQ(Read(scratch.path() + "/again/model.consac"), model);
  config.eval_every = 0;
  config.init_model = "again";
  config.steps = 16;
  EXPECT_EQ(Trained(config).weights_hash, first);
}

}  // namespace
}  // namespace consac::run
