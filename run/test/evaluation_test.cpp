#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "small_run.h"

namespace consac::run {
namespace {

using ::testing::HasSubstr;

EvaluateOptions Options(const std::string& directory) {
  EvaluateOptions options;
  options.model = "pole";
  options.directory = directory;
  options.episodes = 5;
  return options;
}

void TrainPole(const std::string& directory) {
  RunConfig config = SmallRun(directory, "pole");
  config.world = "cartpole-v1";
  config.steps = 256;
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
}

TEST(Evaluate, CountsEpisodesAndTheirReturns) {
  consac::testing::ScratchFolder scratch("evaluate");
  TrainPole(scratch.path());
  const Result<EvaluateSummary> summary = Evaluate(Options(scratch.path()), kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->episodes, 5);
  EXPECT_EQ(summary->mean_reward, summary->mean_length) << "cartpole pays 1 per step";
  EXPECT_LE(summary->min_reward, summary->mean_reward);
  EXPECT_GE(summary->max_reward, summary->mean_reward);
  EXPECT_GE(summary->std_reward, 0.0);
}

TEST(Evaluate, OneSeedGivesOneVerdict) {
  consac::testing::ScratchFolder scratch("verdict");
  TrainPole(scratch.path());
  EvaluateOptions options = Options(scratch.path());
  options.episodes = 20;
  options.deterministic = false;
  const double first = Evaluate(options, kNeverStop)->mean_reward;
  EXPECT_EQ(Evaluate(options, kNeverStop)->mean_reward, first);
  options.seed = 5;
  EXPECT_NE(Evaluate(options, kNeverStop)->mean_reward, first);
}

TEST(Evaluate, AnEngineIsJudgedAsTheWorldInProcess) {
  consac::testing::ScratchFolder scratch("remote");
  TrainPole(scratch.path());
  EvaluateOptions options = Options(scratch.path());
  options.episodes = 1;
  const Result<EvaluateSummary> local = Evaluate(options, kNeverStop);
  EnvServerOptions server;
  server.training_length = 100000;
  server.seed = options.seed;
  consac::testing::ServedWorld engine("cartpole-v1", server);
  options.world = engine.url();
  const Result<EvaluateSummary> remote = Evaluate(options, kNeverStop);
  ASSERT_TRUE(local.ok() && remote.ok()) << local.status().message() << remote.status().message();
  EXPECT_EQ(remote->mean_reward, local->mean_reward);
}

TEST(Evaluate, WhatDoesNotFitIsRefused) {
  consac::testing::ScratchFolder scratch("misfit");
  TrainPole(scratch.path());
  const auto error = [&](auto&& change) {
    EvaluateOptions options = Options(scratch.path());
    change(options);
    const Result<EvaluateSummary> summary = Evaluate(options, kNeverStop);
    EXPECT_FALSE(summary.ok());
    return summary.status().message();
  };
  EXPECT_THAT(error([](EvaluateOptions& o) { o.world = "road-v0"; }), HasSubstr("observation"));
  EXPECT_THAT(error([](EvaluateOptions& o) { o.world = "rode-v0"; }), HasSubstr("did you mean 'road-v0'"));
  EXPECT_THAT(error([](EvaluateOptions& o) { o.model = "poll"; }), HasSubstr("did you mean 'pole'"));
  EXPECT_THAT(error([](EvaluateOptions& o) { o.episodes = 0; }), HasSubstr("at least 1"));
}

}  // namespace
}  // namespace consac::run
