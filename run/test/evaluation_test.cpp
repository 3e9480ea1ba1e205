#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "consac/env/success.h"
#include "judgement.h"
#include "session.h"
#include "small_run.h"
#include "tests/swarm_world.h"
#include "tests/two_worlds.h"

namespace consac::run {
namespace {

using consac::testing::Half;
using consac::testing::ServedWorld;
using consac::testing::TwoWorlds;
using ::testing::HasSubstr;
using Verdicts = Result<std::vector<EvaluateSummary>>;

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
  const Verdicts summary = Evaluate(Options(scratch.path()), kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->front().episodes, 5);
  EXPECT_EQ(summary->front().mean_reward, summary->front().mean_length) << "cartpole pays 1 per step";
  EXPECT_LE(summary->front().min_reward, summary->front().mean_reward);
  EXPECT_GE(summary->front().max_reward, summary->front().mean_reward);
  EXPECT_GE(summary->front().std_reward, 0.0);
}

TEST(Evaluate, OneSeedGivesOneVerdict) {
  consac::testing::ScratchFolder scratch("verdict");
  TrainPole(scratch.path());
  EvaluateOptions options = Options(scratch.path());
  options.episodes = 20;
  options.deterministic = false;
  const double first = Evaluate(options, kNeverStop)->front().mean_reward;
  EXPECT_EQ(Evaluate(options, kNeverStop)->front().mean_reward, first);
  options.seed = 5;
  EXPECT_NE(Evaluate(options, kNeverStop)->front().mean_reward, first);
}

// Poles that say of themselves whether they succeed: all copies but the first.
class TellingPoles final : public VectorEnv {
 public:
  explicit TellingPoles(std::int32_t copies)
      : poles_((*worlds::FindWorld("cartpole-v1"))->create(copies)), height_(static_cast<std::size_t>(copies), 0.5f) {
    succeeds_.assign(static_cast<std::size_t>(copies), 1.0f);
    succeeds_[0] = 0.0f;
    columns_ = {{"height", height_}, {kSuccessInfo, succeeds_}};
  }
  const EnvSpec& spec() const override { return poles_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { poles_->Reset(seed, batches); }
  void Step(std::span<Batch> batches) override { poles_->Step(batches); }
  std::span<const InfoColumn> infos() const override { return columns_; }
  void Visit(Archive& archive) override { poles_->Visit(archive); }

 private:
  std::unique_ptr<VectorEnv> poles_;
  std::vector<float> height_, succeeds_;
  std::vector<InfoColumn> columns_;
};

TEST(Evaluate, TellsWhichPartOfTheEpisodesSucceeds) {
  consac::testing::ScratchFolder scratch("success");
  TrainPole(scratch.path());
  EvaluateOptions options = Options(scratch.path());
  EXPECT_TRUE(std::isnan(Evaluate(options, kNeverStop)->front().success_rate)) << "poles do not say";
  options.episodes = 8;
  const std::unique_ptr<WorldLink> link = MakeLocalLink(std::make_unique<TellingPoles>(4));
  Result<Actors> actors = Actors::Load(*FindModels(options.model, options.directory), link->spec());
  ASSERT_TRUE(actors.ok()) << actors.status().message();
  const Verdicts told = Judge(options, *link, *actors, kNeverStop, [] {});
  ASSERT_TRUE(told.ok()) << told.status().message();
  EXPECT_EQ(told->front().episodes, 8);
  EXPECT_EQ(told->front().success_rate, 0.75);
}

TEST(Evaluate, AnEngineIsJudgedAsTheWorldInProcess) {
  consac::testing::ScratchFolder scratch("remote");
  TrainPole(scratch.path());
  EvaluateOptions options = Options(scratch.path());
  options.episodes = 1;
  const Verdicts local = Evaluate(options, kNeverStop);
  EnvServerOptions server;
  server.training_length = 100000;
  server.seed = options.seed;
  consac::testing::ServedWorld engine("cartpole-v1", server);
  options.world = engine.url();
  const Verdicts remote = Evaluate(options, kNeverStop);
  ASSERT_TRUE(local.ok() && remote.ok()) << local.status().message() << remote.status().message();
  EXPECT_EQ(remote->front().mean_reward, local->front().mean_reward);
}

TEST(Evaluate, WhatDoesNotFitIsRefused) {
  consac::testing::ScratchFolder scratch("misfit");
  TrainPole(scratch.path());
  const auto error = [&](auto&& change) {
    EvaluateOptions options = Options(scratch.path());
    change(options);
    const Verdicts summary = Evaluate(options, kNeverStop);
    EXPECT_FALSE(summary.ok());
    return summary.status().message();
  };
  EXPECT_THAT(error([](EvaluateOptions& o) { o.world = "road-v0"; }), HasSubstr("observation"));
  EXPECT_THAT(error([](EvaluateOptions& o) { o.world = "rode-v0"; }), HasSubstr("did you mean 'road-v0'"));
  EXPECT_THAT(error([](EvaluateOptions& o) { o.model = "poll"; }), HasSubstr("did you mean 'pole'"));
  EXPECT_THAT(error([](EvaluateOptions& o) { o.episodes = 0; }), HasSubstr("at least 1"));
}

EnvServerOptions AskingForAMillion() {
  EnvServerOptions options;
  options.training_length = 1000000;
  return options;
}

/// A run of `steps` in a world of the test's own.
void TrainIn(std::unique_ptr<VectorEnv> world, const std::string& directory, const std::string& name) {
  RunConfig config = SmallRun(directory, name);
  config.world = world->spec().id;
  config.steps = 300;
  const Result<RunSummary> summary =
      RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::move(world))), kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
}

TEST(Evaluate, AnEngineMayHaveMoreAgentsThanAnEvaluationCopies) {
  consac::testing::ScratchFolder scratch("many_agents");
  TrainPole(scratch.path());
  const ServedWorld engine((*worlds::FindWorld("cartpole-v1"))->create(40), AskingForAMillion());
  EvaluateOptions options = Options(scratch.path());
  options.world = engine.url();
  options.episodes = 50;
  const Verdicts summary = Evaluate(options, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->front().episodes, 50);
}

// Agents of three kinds live 2, 4 and 6 steps and are away until the last has ended.
TEST(Evaluate, AbsentAgentsHaveNoEpisodes) {
  consac::testing::ScratchFolder scratch("swarm_judged");
  TrainIn(std::make_unique<consac::testing::Swarm>(2, 3, false), scratch.path(), "pole");
  const ServedWorld engine(std::make_unique<consac::testing::Swarm>(2, 3, false), AskingForAMillion());
  EvaluateOptions options = Options(scratch.path());
  options.world = engine.url();
  options.episodes = 18;
  const Verdicts summary = Evaluate(options, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->front().episodes, 18);
  EXPECT_EQ(summary->front().min_reward, 3.0);
  EXPECT_EQ(summary->front().max_reward, 21.0);
  EXPECT_NEAR(summary->front().mean_reward, (3.0 + 10.0 + 21.0) / 3.0, 1e-9);
  EXPECT_NEAR(summary->front().mean_length, (2.0 + 4.0 + 6.0) / 3.0, 1e-9);
}

TEST(Evaluate, APlaceThatNobodyTakesHoldsNothingUp) {
  consac::testing::ScratchFolder scratch("empty_place");
  TrainIn(std::make_unique<TwoWorlds>(), scratch.path(), "two");
  const ServedWorld engine(
      std::make_unique<TwoWorlds>(Half{"walker", "road-v0", 3}, Half{"balancer", "cartpole-v1", 2, 1}),
      AskingForAMillion());
  EvaluateOptions options = Options(scratch.path());
  options.model = "two";
  options.world = engine.url();
  options.max_episode_steps = 50;
  const Verdicts summary = Evaluate(options, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  for (const EvaluateSummary& verdict : *summary) EXPECT_EQ(verdict.episodes, 5) << verdict.behaviour;
}

TEST(Evaluate, EveryBehaviourIsJudgedByItsOwnModel) {
  consac::testing::ScratchFolder scratch("two_judged");
  TrainIn(std::make_unique<TwoWorlds>(), scratch.path(), "two");
  const ServedWorld engine(std::make_unique<TwoWorlds>(), AskingForAMillion());
  EvaluateOptions options = Options(scratch.path());
  options.world = engine.url();
  options.max_episode_steps = 50;
  for (const std::string& model : {std::string("two"), scratch.path() + "/two"}) {
    options.model = model;
    const Verdicts summary = Evaluate(options, kNeverStop);
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    ASSERT_EQ(summary->size(), 2u);
    EXPECT_EQ((*summary)[0].behaviour, "walker");
    EXPECT_EQ((*summary)[0].mean_length, 50.0);
    EXPECT_EQ((*summary)[1].behaviour, "balancer");
    EXPECT_EQ((*summary)[1].mean_reward, (*summary)[1].mean_length) << "cartpole pays 1 per step";
    for (const EvaluateSummary& verdict : *summary) EXPECT_EQ(verdict.episodes, 5);
  }
}

TEST(Evaluate, AModelForEachBehaviourIsWantedAndTheirNamesAreSaid) {
  consac::testing::ScratchFolder scratch("two_refused");
  TrainIn(std::make_unique<TwoWorlds>(), scratch.path(), "two");
  const ServedWorld engine(std::make_unique<TwoWorlds>(), AskingForAMillion());
  const auto error = [&](const std::string& model) {
    EvaluateOptions options = Options(scratch.path());
    options.model = model;
    options.world = engine.url();
    const Verdicts summary = Evaluate(options, kNeverStop);
    EXPECT_FALSE(summary.ok());
    return summary.status().message();
  };
  const std::string folder = scratch.path() + "/two/";
  EXPECT_THAT(error(folder + "walker.consac"),
              ::testing::AllOf(HasSubstr("walker.consac' is one model"), HasSubstr("2 behaviours (walker, balancer)")));
  std::filesystem::rename(folder + "balancer.consac", folder + "balances.consac");
  EXPECT_THAT(error("two"), ::testing::AllOf(HasSubstr("balances.consac"), HasSubstr("the model of 'balancer'")));
}

TEST(Evaluate, OneOfARunsModelsServesAnEngineThatHasItsBehaviourAlone) {
  consac::testing::ScratchFolder scratch("one_of_two");
  TrainIn(std::make_unique<TwoWorlds>(), scratch.path(), "two");
  EvaluateOptions options = Options(scratch.path());
  options.world = "cartpole-v1";
  options.model = scratch.path() + "/two/balancer.consac";
  EXPECT_TRUE(Evaluate(options, kNeverStop).ok());
  options.model = "two";
  EXPECT_THAT(Evaluate(options, kNeverStop).status().message(), HasSubstr("1 behaviour (default)"));
  EXPECT_THAT(FindModel("two", scratch.path()).status().message(), HasSubstr("/two/balancer.consac'"));
}

TEST(Evaluate, WhatIsWaitedForIsSaidAtOnce) {
  consac::testing::ScratchFolder scratch("waiting");
  TrainPole(scratch.path());
  auto listener = ListenTcp({"127.0.0.1", 0});
  const std::string url = "tcp://127.0.0.1:" + std::to_string((*listener)->port());
  (*listener)->Close();
  std::vector<std::string> said;
  EvaluateOptions options = Options(scratch.path());
  options.world = url;
  options.connect_timeout_s = 0.3;
  options.say = [&](const std::string& line) { said.push_back(line); };
  EXPECT_EQ(Evaluate(options, kNeverStop).status().code(), StatusCode::kUnavailable);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_THAT(said[0], HasSubstr(url));
}

}  // namespace
}  // namespace consac::run
