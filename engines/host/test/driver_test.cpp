// Drivers in this process: a learner, a model, the host itself.
#include "consac/host/driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "consac/host/recorder.h"
#include "consac/learn/algo/learner.h"
#include "consac/policy/demonstration.h"
#include "consac/policy/policy.h"
#include "engines/host/test/in_process.h"
#include "engines/host/test/ticked_engine.h"
#include "tests/protocol2_peers.h"
#include "tests/remembering.h"
#include "tests/support.h"

namespace consac::host {
namespace {

using consac::testing::InProcess;
using consac::testing::RoadAccuracy;
using consac::testing::ScratchFolder;
using consac::testing::TickedEngine;
using ::testing::HasSubstr;

TrainOptions RoadTraining(std::int64_t steps) {
  TrainOptions options;
  options.total_steps = steps;
  options.seed = 3;
  return options;
}

void TrainToTheEnd(TickedEngine& engine, Driver& driver) {
  for (int tick = 0; tick < 10'000'000 && !driver.finished(); ++tick) ASSERT_TRUE(engine.Tick(driver, 0.01).ok());
  ASSERT_TRUE(driver.finished());
}

TEST(Training, InsideTheEngineLearnsTheRoadAndGoesOnActing) {
  const ScratchFolder folder("host_training");
  TickedEngine engine("road-v0", 1, 2);
  auto driver = *Train(engine.world(), RoadTraining(20000));
  TrainToTheEnd(engine, *driver);
  EXPECT_EQ(driver->progress().steps, 20000);
  EXPECT_GT(driver->progress().updates, 100);
  const std::int64_t before = engine.world().tally().steps;
  for (int tick = 0; tick < 100; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
  EXPECT_GE(engine.world().tally().steps, before + 45);

  const std::string path = folder.path() + "/road.consac";
  ASSERT_TRUE(driver->SaveModel(0, path).ok());
  Policy policy = *Policy::Load(path);
  EXPECT_GE(RoadAccuracy(policy), 0.98);
}

// Rounds of learning every few ticks, agents that are asked for each: nothing of the driver knows which algorithm it
// is.
TEST(Training, InsideTheEngineByA2cToo) {
  TickedEngine engine("road-v0", 4, 1);
  TrainOptions options = RoadTraining(4000);
  options.algorithm = "a2c";
  auto driver = *Train(engine.world(), options);
  TrainToTheEnd(engine, *driver);
  EXPECT_EQ(driver->progress().steps, 4000);
  EXPECT_EQ(driver->progress().updates, 200);
  EXPECT_TRUE(driver->learned(0));
}

TEST(Training, WhileTheGameGoesOnNeverWaits) {
  TickedEngine engine("road-v0", 4, 1);
  TrainOptions options = RoadTraining(8000);
  options.while_learning = WhileLearning::kGoOn;
  auto driver = *Train(engine.world(), options);
  std::int64_t waits = 0;
  for (int tick = 0; tick < 10'000'000 && !driver->finished(); ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 1.0).ok());
    waits += engine.world().cue() == Cue::kWait ? 1 : 0;
  }
  ASSERT_TRUE(driver->finished());
  EXPECT_EQ(waits, 0);
  EXPECT_GE(driver->progress().steps, 8000);
  EXPECT_GT(engine.world().tally().steps, driver->progress().steps);  // those while it learned
}

TrainOptions BySmallSteps(const char* algorithm, std::int64_t steps) {
  TrainOptions options = RoadTraining(steps);
  options.algorithm = algorithm;
  options.hyperparameters = {{"buffer_size", "2000"}, {"net_arch", "[16]"}, {"train_freq", "2"}, {"batch_size", "32"}};
  return options;
}
TrainOptions PoleByDqn() {
  return BySmallSteps("dqn", 3000);
}

/// An algorithm that learns at every step, and a world for it.
struct EveryStep {
  const char *algorithm, *world;
  std::int64_t steps;
};
class LearningAtEveryStep : public ::testing::TestWithParam<EveryStep> {
 protected:
  TrainOptions options() const { return BySmallSteps(GetParam().algorithm, GetParam().steps); }
  static std::unique_ptr<learn::Learner> Alone(TickedEngine& engine, const TrainOptions& options) {
    return InProcess(GetParam().world, engine.world().spec().behaviours[0].slots, options, options.seed);
  }
};
INSTANTIATE_TEST_SUITE_P(Each, LearningAtEveryStep,
                         ::testing::Values(EveryStep{"dqn", "cartpole-v1", 3000}, EveryStep{"sac", "pendulum-v1", 1000},
                                           EveryStep{"td3", "pendulum-v1", 1000},
                                           EveryStep{"ddpg", "pendulum-v1", 1000}),
                         [](const auto& tested) { return std::string(tested.param.algorithm); });

/// Agents that act by `model` do what it does alone, bit for bit.
void ExpectActsAlike(const ModelFile& model, const char* world) {
  TickedEngine engine(world, 3, 1);
  const std::vector<std::byte> bytes = model.Serialise();
  const auto driver = *Act(engine.world(), std::span(&bytes, 1), ActOptions());
  Policy alone = *Policy::FromFile(*ModelFile::Parse(bytes));
  Rng rng;
  std::vector<std::byte> expected(engine.world().spec().behaviours[0].action_layout.row_bytes);
  int acted = 0;
  for (int tick = 0; tick < 60; ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    for (AgentId a = 0; a < 3 && engine.world().cue() == Cue::kAct; ++a, ++acted) {
      alone.Act(engine.world().Observation(a), nullptr, 1, ActionMode::kDeterministic, rng, expected.data());
      ASSERT_EQ(std::memcmp(engine.world().Action(a), expected.data(), expected.size()), 0);
    }
  }
  EXPECT_GT(acted, 100);
}

// What the engine's thread does at once, what is handed over (every third round of dqn here takes so many gradient
// steps that it is) and what is learned in a process of its own are the same bits; so is what the model does.
TEST_P(LearningAtEveryStep, InsideTheEngineIsWhatItIsInProcess) {
  for (const char* gradient_steps : {"1", "40"}) {
    TickedEngine engine(GetParam().world, 2, 1);
    TrainOptions made = options();
    made.hyperparameters.emplace_back("gradient_steps", gradient_steps);
    auto driver = *Train(engine.world(), made);
    TrainToTheEnd(engine, *driver);
    const std::unique_ptr<learn::Learner> alone = Alone(engine, made);
    EXPECT_EQ(driver->progress().steps, made.total_steps);
    EXPECT_EQ(driver->progress().updates, alone->updates());
    EXPECT_GT(alone->updates(), 200);
    EXPECT_TRUE(driver->learned(0));
    EXPECT_EQ(Policy::FromFile(*driver->Model(0))->data().parameters, alone->Snapshot().parameters);
    ExpectActsAlike(*driver->Model(0), GetParam().world);
  }
}

TEST_P(LearningAtEveryStep, WhileTheGameGoesOnLosesNoStep) {
  TickedEngine engine(GetParam().world, 2, 1);
  TrainOptions made = options();
  made.while_learning = WhileLearning::kGoOn;
  auto driver = *Train(engine.world(), made);
  for (int tick = 0; tick < 10'000'000 && !driver->finished(); ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 1.0).ok());
    ASSERT_NE(engine.world().cue(), Cue::kWait);
    ASSERT_EQ(driver->progress().steps, std::min(engine.world().tally().steps, made.total_steps));
    if (tick == 500) {
      ASSERT_TRUE(driver->Model(0).ok());
    }
  }
  ASSERT_TRUE(driver->finished());
  EXPECT_EQ(driver->progress().updates, Alone(engine, made)->updates());
}

/// Hindsight on point reach, whose goals the host prices, or a function that only the engine's thread may call.
class LearningFromOtherGoals : public ::testing::TestWithParam<GoalReward> {
 protected:
  LearningFromOtherGoals() {
    options_ = BySmallSteps("sac", 1500);
    options_.hyperparameters.emplace_back("replay_buffer_class", "HerReplayBuffer");
  }
  static TickedEngine Engine() {
    if (GetParam() == GoalReward::kFunction) return {kReach, 2, 1};
    Goals goals;
    goals.reward = GetParam();
    return {kReach, 2, 1, goals};
  }
  static constexpr const char* kReach = "point-reach-v0";
  TrainOptions options_;
};
INSTANTIATE_TEST_SUITE_P(Each, LearningFromOtherGoals, ::testing::Values(GoalReward::kSparse, GoalReward::kFunction),
                         [](const auto& tested) {
                           return tested.param == GoalReward::kSparse ? "Sparse" : "Function";
                         });

TEST_P(LearningFromOtherGoals, InsideTheEngineIsWhatItIsInProcess) {
  for (const char* gradient_steps : {"1", "20"}) {
    TickedEngine engine = Engine();
    TrainOptions options = options_;
    options.hyperparameters.emplace_back("gradient_steps", gradient_steps);
    const auto driver = *Train(engine.world(), options);
    TrainToTheEnd(engine, *driver);
    const std::unique_ptr<learn::Learner> alone = InProcess(kReach, 2, options, options.seed);
    EXPECT_EQ(driver->progress().updates, alone->updates());
    EXPECT_GT(alone->updates(), 200);
    EXPECT_EQ(Policy::FromFile(*driver->Model(0))->data().parameters, alone->Snapshot().parameters);
    EXPECT_FALSE(engine.priced_elsewhere());
  }
}

TEST_P(LearningFromOtherGoals, WhileTheGameGoesOnLosesNoStep) {
  TickedEngine engine = Engine();
  options_.while_learning = WhileLearning::kGoOn;
  const auto driver = *Train(engine.world(), options_);
  for (int tick = 0; tick < 10'000'000 && !driver->finished(); ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 1.0).ok());
    ASSERT_NE(engine.world().cue(), Cue::kWait);
    ASSERT_EQ(driver->progress().steps, std::min(engine.world().tally().steps, options_.total_steps));
  }
  ASSERT_TRUE(driver->finished());
  EXPECT_EQ(driver->progress().updates, InProcess(kReach, 2, options_, options_.seed)->updates());
  EXPECT_FALSE(engine.priced_elsewhere());
}

// And the model is of use: reached within 0.05 m, from anywhere, most of the time.
TEST(Training, InsideTheEngineLearnsToReachByGoalsThatWereNotMeant) {
  Goals goals;
  goals.reward = GoalReward::kSparse;
  TickedEngine engine("point-reach-v0", 1, 1, goals);
  TrainOptions options = RoadTraining(4000);
  options.algorithm = "sac";
  options.hyperparameters = {{"replay_buffer_class", "HerReplayBuffer"},
                             {"net_arch", "[32, 32]"},
                             {"batch_size", "64"},
                             {"learning_rate", "2e-3"},
                             {"gamma", "0.9"},
                             {"learning_starts", "200"}};
  const auto driver = *Train(engine.world(), options);
  TrainToTheEnd(engine, *driver);
  TickedEngine judged("point-reach-v0", 20, 1, goals);
  const std::vector<std::byte> model = driver->Model(0)->Serialise();
  const auto actor = *Act(judged.world(), std::span(&model, 1), ActOptions());
  while (judged.world().tally().episodes < 100) ASSERT_TRUE(judged.Tick(*actor, 0.0).ok());
  EXPECT_GT(judged.world().tally().mean_episode_reward, -20.0) << "of 50 steps, which it takes ten to reach";
}

TEST(Training, FromOtherGoalsNeedsAGoalReward) {
  TickedEngine engine("point-reach-v0", 1, 1, Goals());
  TrainOptions options = BySmallSteps("sac", 1500);
  options.hyperparameters.emplace_back("replay_buffer_class", "HerReplayBuffer");
  EXPECT_THAT(Train(engine.world(), options).status().message(), HasSubstr("what other goals would have paid"));
}

TEST(Training, OfDqnThatFailsOrIsStoppedEndsInOrder) {
  for (const WhileLearning mode : {WhileLearning::kWait, WhileLearning::kGoOn}) {
    TickedEngine engine("cartpole-v1", 1, 1);
    TrainOptions options = PoleByDqn();
    options.while_learning = mode;
    options.total_steps = 1'000'000;
    options.hyperparameters.emplace_back("gradient_steps", "1000000");
    auto driver = *Train(engine.world(), options);
    for (int tick = 0; tick < 300; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    driver.reset();
    EXPECT_TRUE(engine.world().settled());
    options.hyperparameters.back().second = "1";
    options.hyperparameters.emplace_back("learning_rate", "1e38");
    driver = *Train(engine.world(), options);
    Status status;
    for (int tick = 0; tick < 1'000'000 && status.ok(); ++tick) status = engine.Tick(*driver, 0.1);
    EXPECT_EQ(status.code(), StatusCode::kNonFinite);
    for (int tick = 0; tick < 10; ++tick) EXPECT_TRUE(engine.Tick(*driver, 0.0).ok()) << "said once";
    EXPECT_FALSE(driver->finished());
    EXPECT_TRUE(driver->Model(0).ok());
  }
}

TEST(Training, StopsInTheMiddleOfLearning) {
  const ScratchFolder folder("host_stopped");
  for (int i = 0; i < 5; ++i) {
    TickedEngine engine("cartpole-v1", 8, 1);
    TrainOptions options = RoadTraining(1'000'000);
    options.hyperparameters = {{"noptepochs", "1000"}};
    auto driver = *Train(engine.world(), options);
    while (driver->progress().state != "learning") ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    EXPECT_TRUE(driver->SaveModel(0, folder.path() + "/stopped.consac").ok());
    driver.reset();
    EXPECT_TRUE(engine.world().settled());
  }
}

TEST(Training, ThatFailsIsNotFinishedAndKeepsTheLastGoodModel) {
  const ScratchFolder folder("host_failed");
  TickedEngine engine("cartpole-v1", 1, 1);
  TrainOptions options = RoadTraining(100000);
  options.hyperparameters = {{"learning_rate", "1e30"}};
  auto driver = *Train(engine.world(), options);
  Status status;
  for (int tick = 0; tick < 100000 && status.ok(); ++tick) status = engine.Tick(*driver, 0.1);
  EXPECT_EQ(status.code(), StatusCode::kNonFinite);
  for (int tick = 0; tick < 10; ++tick) EXPECT_TRUE(engine.Tick(*driver, 0.0).ok()) << "said once";
  EXPECT_FALSE(driver->finished());
  const std::string path = folder.path() + "/good.consac";
  ASSERT_TRUE(driver->SaveModel(0, path).ok());
  const Policy good = *Policy::Load(path);
  for (const float parameter : good.data().parameters) ASSERT_TRUE(std::isfinite(parameter));
}

TEST(Serving, BeyondThisComputerNeedsAToken) {
  TickedEngine engine("road-v0", 1, 1);
  ServeOptions options;
  options.endpoint = {"0.0.0.0", 0};
  options.server.training_length = 10;
  EXPECT_THAT(Serve(engine.world(), options).status().message(), HasSubstr("needs an access token"));
  options.server.token = "secret";
  EXPECT_TRUE(Serve(engine.world(), options).ok());
}

// As `consac eval` with a model that does not fit does. Whoever comes next is not told that it is still there.
TEST(Serving, ATrainerThatLeavesInTheHandshakeMakesRoomAtOnce) {
  TickedEngine engine("road-v0", 1, 1);
  ServeOptions options;
  options.endpoint = {"127.0.0.1", 0};
  options.server.training_length = 10;
  const std::unique_ptr<Driver> driver = *Serve(engine.world(), options);
  const auto connect = [&] {
    auto trainer = std::make_unique<testing::RawTrainer>(*ConnectTcp({"127.0.0.1", driver->port()}, 2.0));
    trainer->Send(protocol2::FrameType::kHello, 0, protocol2::EncodeHello({}));
    return trainer;
  };
  std::unique_ptr<testing::RawTrainer> trainer = connect();
  for (int i = 0; i < 4; ++i) {
    for (int tick = 0; tick < 4; ++tick) (void)engine.Tick(*driver, 0.01);  // an error when one has left
    ASSERT_EQ(trainer->Next().header.type, protocol2::FrameType::kWelcome) << i;
    if (i % 2 == 0) trainer->Send(protocol2::FrameType::kBye, 0, "");
    trainer->transport().Close();
    trainer = connect();
  }
  EXPECT_EQ(driver->ended(), 0) << "those were no sessions";
  EXPECT_FALSE(driver->finished());
}

// Twins that see the same: what tells them apart is their learners' draws alone.
TEST(Training, NoTwoBehavioursDrawTheSameNumbers) {
  const ScratchFolder folder("host_twins");
  TickWorldOptions options;
  options.id = "twins";
  for (const char* name : {"one", "other"}) {
    Offering offering;
    offering.name = name;
    offering.observations = {{"seen", *Space::Box(0.0, 1.0, {2}, DType::kF32)}};
    offering.actions = {{"done", *Space::Discrete(3)}};
    offering.agents = 1;
    options.offerings.push_back(offering);
  }
  const std::unique_ptr<TickWorld> world = *TickWorld::Create(options);
  for (std::size_t b = 0; b < 2; ++b) (void)*world->Join(b);
  const auto driver = *Train(*world, RoadTraining(100));
  std::vector<float> parameters[2];
  for (std::size_t b = 0; b < 2; ++b) {
    const std::string path = folder.path() + "/" + std::to_string(b) + ".consac";
    ASSERT_TRUE(driver->SaveModel(b, path).ok());
    parameters[b] = Policy::Load(path)->data().parameters;
  }
  EXPECT_NE(parameters[0], parameters[1]);
}

// A training goes on from what another one has learned, and says what it cannot begin with.
TEST(Training, BeginsWithAModel) {
  TickedEngine taught("road-v0", 1, 1);
  auto teacher = *Train(taught.world(), RoadTraining(20000));
  TrainToTheEnd(taught, *teacher);
  const std::vector<std::byte> model = teacher->Model(0)->Serialise();
  TrainOptions options = RoadTraining(256);
  options.start_from = {model};
  options.hyperparameters = {{"n_steps", "128"}, {"learning_rate", "1e-9"}};
  TickedEngine engine("road-v0", 1, 1);
  auto driver = *Train(engine.world(), options);
  TrainToTheEnd(engine, *driver);
  Policy policy = *Policy::FromFile(*driver->Model(0));
  EXPECT_GE(RoadAccuracy(policy), 0.98);

  TickedEngine other("cartpole-v1", 1, 1);
  EXPECT_THAT(Train(other.world(), options).status().message(), HasSubstr("cannot begin with this model"));
  options.start_from.push_back(model);
  EXPECT_THAT(Train(engine.world(), options).status().message(), HasSubstr("2 models for 1 behaviours"));
}

TEST(Training, SaysWhatDoesNotFit) {
  TickedEngine engine("road-v0", 1, 1);
  TrainOptions options = RoadTraining(100);
  options.algorithm = "pp2";
  EXPECT_THAT(Train(engine.world(), options).status().message(), HasSubstr("ppo2"));
  options = RoadTraining(100);
  options.hyperparameters = {{"gama", "0.9"}};
  EXPECT_THAT(Train(engine.world(), options).status().message(), HasSubstr("gamma"));
  EXPECT_THAT(Train(engine.world(), RoadTraining(0)).status().message(), HasSubstr("total_steps is 0"));
  engine.world().Leave(0);
  EXPECT_THAT(Train(engine.world(), RoadTraining(10)).status().message(), HasSubstr("0 of 1 agents"));
}

TEST(Acting, IsTheModelBitForBitForAllAgentsAtOnce) {
  const ScratchFolder folder("host_acting");
  const std::string path = folder.path() + "/pole.consac";
  {
    TickedEngine school("cartpole-v1", 2, 1);
    auto driver = *Train(school.world(), RoadTraining(2000));
    TrainToTheEnd(school, *driver);
    ASSERT_TRUE(driver->SaveModel(0, path).ok());
  }
  constexpr std::int32_t kAgents = 7;
  TickedEngine engine("cartpole-v1", kAgents, 1);
  ActOptions options;
  options.models = {path};
  auto driver = *Act(engine.world(), options);
  EXPECT_EQ(driver->progress().state, "acting by a model");
  Policy alone = *Policy::Load(path);
  Rng rng;
  for (int tick = 0; tick < 400; ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    if (engine.world().cue() != Cue::kAct) continue;
    for (AgentId a = 0; a < kAgents; ++a) {
      std::int32_t expected = -1, action = -2;
      alone.Act(engine.world().Observation(a), nullptr, 1, ActionMode::kDeterministic, rng,
                reinterpret_cast<std::byte*>(&expected));
      std::memcpy(&action, engine.world().Action(a), sizeof(action));
      ASSERT_EQ(action, expected);
    }
  }
}

// Three agents whose episodes end at different steps; the action is the sum of what was seen since they began.
TEST(Acting, AModelRemembersForEachAgentUntilItsEpisodeEnds) {
  auto world = std::make_unique<testing::OnesEnv>(3);
  const testing::OnesEnv& ones = *world;
  TickedEngine engine(std::move(world), 2);
  const std::vector<std::byte> model = Policy::Create(testing::RememberingPolicy(), 1)->ToFile(1).Serialise();
  const auto driver = *Act(engine.world(), std::span(&model, 1), ActOptions());
  int longest = 0;
  for (int tick = 0; tick < 100; ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    for (AgentId a = 0; a < 3 && engine.world().cue() == Cue::kAct; ++a) {
      float action = 0.0f;
      std::memcpy(&action, engine.world().Action(a), sizeof(action));
      ASSERT_EQ(action, static_cast<float>(ones.length(static_cast<std::size_t>(a)) + 1)) << a;
      longest = std::max(longest, static_cast<int>(action));
    }
  }
  EXPECT_EQ(longest, 5);
}

TEST(Acting, NamesWhatDiffersBetweenModelAndWorld) {
  const ScratchFolder folder("host_mismatch");
  const std::string path = folder.path() + "/road.consac";
  TickedEngine road("road-v0", 1, 1);
  auto driver = *Train(road.world(), RoadTraining(1000));
  ASSERT_TRUE(driver->SaveModel(0, path).ok());
  TickedEngine pole("cartpole-v1", 1, 1);
  ActOptions options;
  options.models = {path};
  EXPECT_THAT(Act(pole.world(), options).status().message(), HasSubstr("observation"));
  options.models = {};
  EXPECT_THAT(Act(pole.world(), options).status().message(), HasSubstr("0 models for 1 behaviours"));
  options.models = {folder.path() + "/none.consac"};
  EXPECT_THAT(Act(pole.world(), options).status().message(), HasSubstr("none.consac"));
}

TEST(ByHand, AnEpisodeThatAResetCutsIsRecordedAsTruncated) {
  const ScratchFolder folder("host_cut");
  TickedEngine engine("road-v0", 1, 1);
  Recorder recorder(engine.world(), 0);
  engine.recorder = &recorder;
  for (int play = 0; play < 2; ++play) {
    auto driver = ByHand(engine.world(), 5);
    for (int tick = 0; tick < 4; ++tick) ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
  }
  const std::string path = folder.path() + "/cut.demonstration";
  ASSERT_TRUE(recorder.Save(path).ok());
  const ModelFile file = *ModelFile::Load(path);
  const std::vector<std::byte>& cuts = file.tensors.find("truncated")->second.bytes;
  ASSERT_EQ(cuts.size(), 4u);
  EXPECT_EQ(cuts[0], std::byte{0});
  EXPECT_EQ(cuts[1], std::byte{1});
  EXPECT_EQ(cuts[3], std::byte{0});
}

TEST(ByHand, TheHostActsAndTheRecorderTakesItDown) {
  const ScratchFolder folder("host_demonstration");
  TickedEngine engine("road-v0", 2, 1);
  auto driver = ByHand(engine.world(), 5);
  Recorder recorder(engine.world(), 0);
  engine.recorder = &recorder;
  for (int tick = 0; tick < 61; ++tick) {
    ASSERT_TRUE(engine.Tick(*driver, 0.0).ok());
    for (AgentId a = 0; a < 2 && engine.world().cue() == Cue::kAct; ++a) {
      const std::int32_t right = 2;
      std::memcpy(engine.world().Action(a), &right, sizeof(right));
    }
  }
  EXPECT_EQ(recorder.steps(), 2 * 59);
  EXPECT_EQ(driver->SaveModel(0, folder.path() + "/x").code(), StatusCode::kFailedPrecondition);
  const std::string path = folder.path() + "/walk.demonstration";
  ASSERT_TRUE(recorder.Save(path).ok());
  const ModelFile file = *ModelFile::Load(path);
  const Tensor& seen = file.tensors.find("observations")->second;
  EXPECT_EQ(seen.shape, (std::vector<std::int64_t>{118, 2}));
  EXPECT_EQ(seen.floats()[0], 10.0f);  // both actors begin there
  EXPECT_EQ(seen.floats()[4], 11.0f);  // and walk to the right
  const Tensor& ends = file.tensors.find("terminated")->second;
  EXPECT_EQ(ends.bytes[2 * 29], std::byte{0});
  EXPECT_EQ(ends.bytes[2 * 30], std::byte{1});  // the 31st step leads from 40 off the road
  EXPECT_THAT(file.spec_json, HasSubstr("\"kind\":\"demonstration\""));
  const Result<Demonstration> learnable = Demonstration::Load(path);
  ASSERT_TRUE(learnable.ok()) << learnable.status().message();
  EXPECT_EQ(learnable->steps(), 118);
  EXPECT_EQ(learnable->behaviour.slots, 2);
  EXPECT_EQ(learnable->terminated[2 * 30], 1);
}

}  // namespace
}  // namespace consac::host
