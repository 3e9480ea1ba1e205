// Players that do not learn beside learners.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frozen_player.h"
#include "session.h"
#include "small_run.h"
#include "tests/remembering.h"
#include "tests/two_worlds.h"

namespace consac::run {
namespace {

using ::testing::HasSubstr;
using testing::TwoWorlds;

RunConfig FrozenRun(const std::string& directory, const std::string& name, std::int64_t steps) {
  RunConfig config = SmallRun(directory, name);
  config.world = "two-v0";
  config.steps = steps;
  return config;
}

Result<RunSummary> TrainTwoWorlds(const RunConfig& config) {
  return RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<TwoWorlds>())), kNeverStop);
}

std::vector<float> ParametersIn(const std::string& file) {
  const Result<Policy> policy = Policy::Load(file);
  EXPECT_TRUE(policy.ok()) << policy.status().message();
  return policy.ok() ? policy->data().parameters : std::vector<float>();
}

TEST(Frozen, ABehaviourActsByItsModelWhileTheOtherLearns) {
  testing::ScratchFolder scratch("frozen");
  ASSERT_TRUE(TrainTwoWorlds(FrozenRun(scratch.path(), "first", 1000)).ok());
  RunConfig config = FrozenRun(scratch.path(), "whole", 2000);
  config.frozen = "balancer=first";
  const Result<RunSummary> whole = TrainTwoWorlds(config);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  EXPECT_EQ(whole->steps, 2000) << "of all agents";
  EXPECT_GT(whole->models[0].updates, 10);
  EXPECT_EQ(whole->models[1].updates, 0);
  const std::string before = scratch.path() + "/first/", after = scratch.path() + "/whole/";
  EXPECT_EQ(ParametersIn(before + "balancer.consac"), ParametersIn(after + "balancer.consac"));
  EXPECT_NE(ParametersIn(before + "walker.consac"), ParametersIn(after + "walker.consac"));
  EXPECT_EQ(Policy::Load(before + "balancer.consac")->data().training_json,
            Policy::Load(after + "balancer.consac")->data().training_json)
      << "it was trained as it was";

  // In pieces, and though the model that it began with is gone: the run has its own copy.
  RunConfig pieces = FrozenRun(scratch.path(), "pieces", 735);
  pieces.frozen = "balancer=" + before + "balancer.consac";
  ASSERT_TRUE(TrainTwoWorlds(pieces).ok());
  std::filesystem::remove_all(before);
  pieces.steps = 2000;
  pieces.resume = true;
  const Result<RunSummary> resumed = TrainTwoWorlds(pieces);
  ASSERT_TRUE(resumed.ok()) << resumed.status().message();
  EXPECT_EQ(resumed->weights_hash, whole->weights_hash);
}

TEST(Frozen, AnEnginesAgentsToo) {
  testing::ScratchFolder scratch("frozen_engine");
  ASSERT_TRUE(TrainTwoWorlds(FrozenRun(scratch.path(), "first", 500)).ok());
  RunConfig config = FrozenRun(scratch.path(), "here", 600);
  config.frozen = "walker=first";
  const Result<RunSummary> here = TrainTwoWorlds(config);
  ASSERT_TRUE(here.ok()) << here.status().message();
  EnvServerOptions options;
  options.training_length = 600;
  options.seed = config.seed;
  const testing::ServedWorld engine(std::make_unique<TwoWorlds>(), options);
  config.name = "there";
  config.world = engine.url();
  config.lockstep = true;
  const Result<RunSummary> there = Train(config, kNeverStop);
  ASSERT_TRUE(there.ok()) << there.status().message();
  EXPECT_EQ(there->weights_hash, here->weights_hash);
  EXPECT_EQ(there->models[0].updates, 0);
}

TEST(Frozen, SaysWhatDoesNotFit) {
  testing::ScratchFolder scratch("frozen_misfits");
  ASSERT_TRUE(TrainTwoWorlds(FrozenRun(scratch.path(), "first", 200)).ok());
  const auto refusal = [&](const std::string& frozen) {
    RunConfig config = FrozenRun(scratch.path(), "refused", 200);
    config.frozen = frozen;
    const std::string why = TrainTwoWorlds(config).status().message();
    EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/refused")) << why;
    return why;
  };
  EXPECT_THAT(refusal("balancr=first"), HasSubstr("no behaviour 'balancr' (did you mean 'balancer'?)"));
  EXPECT_THAT(refusal("balancer=frist"), HasSubstr("frozen 'balancer': there is no model 'frist'"));
  EXPECT_THAT(refusal("balancer=first,walker=first"), HasSubstr("every behaviour of the world is frozen"));
  EXPECT_THAT(refusal("balancer=" + scratch.path() + "/first/walker.consac"), HasSubstr("cannot act for 'balancer'"));
  RunConfig config;
  EXPECT_THAT(ApplySetting("frozen=balancer", &config).message(), HasSubstr("expected a behaviour and its model"));
  EXPECT_TRUE(ApplySetting("frozen=prey=runs/a/prey.consac,owl=runs/b", &config).ok());
  EXPECT_EQ(ParseFrozen(config.frozen)->size(), 2u);
}

// What its slots remember goes with a checkpoint, and ends with their episodes.
TEST(Frozen, AModelThatRemembersDoes) {
  testing::ScratchFolder scratch("frozen_memory");
  const std::string file = scratch.path() + "/sum.consac";
  PolicyData data = testing::RememberingPolicy();
  data.log_std = {-20.0f};  // drawn as good as not at all
  ASSERT_TRUE(Policy::Create(data, 1)->ToFile(1).Save(file).ok());
  testing::OnesEnv world(3);
  const BehaviourSpec& behaviour = world.spec().behaviours[0];
  std::unique_ptr<learn::Learner> player = *MakeFrozenPlayer(file, behaviour, 7);
  BatchBuffer rows(behaviour);
  Batch& batch = rows.batch();
  world.Reset(0, {&batch, 1});
  player->Begin(batch);
  for (int step = 0; step < 40; ++step) {
    if (step % 7 == 4) {  // another goes on from a checkpoint
      StateWriter writer;
      player->Visit(writer);
      player = *MakeFrozenPlayer(file, behaviour, 8);
      StateReader reader(writer.fields());
      player->Visit(reader);
      ASSERT_TRUE(reader.status().ok()) << reader.status().message();
    }
    rows.Advance();
    player->Act(batch);
    for (std::size_t slot = 0; slot < 3; ++slot) {
      EXPECT_NEAR(reinterpret_cast<const float*>(batch.actions)[slot], static_cast<float>(world.length(slot) + 1),
                  1e-6);
    }
    world.Step({&batch, 1});
    player->Record(batch);
  }
  EXPECT_EQ(player->steps(), 120);
}

}  // namespace
}  // namespace consac::run
