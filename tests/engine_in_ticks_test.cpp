// A world that lives in an engine's ticks teaches bit for bit what the same world teaches that steps at once: to a
// trainer over either protocol, and to the learner inside the engine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "consac/run/training.h"
#include "consac/server/env_client.h"
#include "tests/protocol2_peers.h"
#include "tests/support.h"
#include "tests/ticking_host.h"

namespace consac::testing {
namespace {

constexpr std::int64_t kSteps = TickingHost::kSteps;

run::RunConfig Quiet(const std::string& world, const ScratchFolder& folder, const char* name) {
  run::RunConfig config;
  config.world = world;
  config.name = name;
  config.directory = folder.path();
  config.steps = kSteps;
  config.seed = 11;
  config.table = config.progress = config.tensorboard = false;
  config.quiet = true;
  config.lockstep = true;
  config.hyperparameters = {{"n_steps", "64"}};
  return config;
}

const std::atomic<bool> kNever{false};

std::uint64_t WeightsOf(const run::RunConfig& config) {
  const Result<run::RunSummary> summary = run::Train(config, kNever);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? summary->weights_hash : 0;
}

struct Case {
  const char* name;
  const char* world;
  std::int32_t copies;
  int period;
  double wait_s;
  const char* protocol;
};

class EngineInTicks : public ::testing::TestWithParam<Case> {};

TEST_P(EngineInTicks, TeachesATrainerTheSame) {
  const Case& c = GetParam();
  const ScratchFolder folder("engine_in_ticks");
  TickingHost host(c.world, c.copies, c.period, c.wait_s);
  run::RunConfig config = Quiet(host.url(), folder, "ticks");
  config.protocol = c.protocol;
  const std::uint64_t ticked = WeightsOf(config);
  EXPECT_TRUE(host.Stop());

  EnvServerOptions options;
  options.training_length = kSteps;
  const ServedWorld served((*worlds::FindWorld(c.world))->create(c.copies), options);
  config.world = served.url();
  config.name = "at_once";
  EXPECT_EQ(ticked, WeightsOf(config));
}

INSTANTIATE_TEST_SUITE_P(Ways, EngineInTicks,
                         ::testing::Values(Case{"text1", "road-v0", 1, 1, 0.01, "text1"},
                                           Case{"text1_periods_never_waiting", "cartpole-v1", 1, 3, 0.0, "text1"},
                                           Case{"protocol2", "road-v0", 1, 2, 0.01, "2"},
                                           Case{"protocol2_many_never_waiting", "cartpole-v1", 8, 2, 0.0, "2"}),
                         [](const auto& test) { return test.param.name; });

TEST(EngineInTicks, TeachesTheLearnerInsideTheSame) {
  const ScratchFolder folder("learner_inside");
  run::RunConfig config = Quiet("cartpole-v1", folder, "outside");
  config.envs = 4;
  const Result<run::RunSummary> outside = run::Train(config, kNever);
  ASSERT_TRUE(outside.ok());

  TickedEngine engine("cartpole-v1", 4, 2);
  host::TrainOptions options;
  options.total_steps = kSteps;
  options.seed = config.seed;
  options.hyperparameters = config.hyperparameters;
  auto driver = *host::Train(engine.world(), options);
  while (!driver->finished()) ASSERT_TRUE(engine.Tick(*driver, 0.01).ok());
  EXPECT_EQ(driver->progress().updates, outside->models[0].updates);
  const std::string path = folder.path() + "/inside.consac";
  ASSERT_TRUE(driver->SaveModel(0, path).ok());
  EXPECT_EQ(Policy::Load(path)->data().parameters, Policy::Load(outside->models[0].path)->data().parameters);
}

/// Hindsight on point reach, over a connection.
TEST(EngineInTicks, TeachesGoalsThatWereNotMeantTheSame) {
  const ScratchFolder folder("goals_in_ticks");
  const auto by_hindsight = [&](const std::string& world, const char* name) {
    run::RunConfig config = Quiet(world, folder, name);
    config.algorithm = "sac";
    config.hyperparameters = {{"replay_buffer_class", "HerReplayBuffer"}, {"net_arch", "[16]"}, {"batch_size", "32"}};
    return WeightsOf(config);
  };
  TickingHost host("point-reach-v0", 2, 1, 0.01);
  const std::uint64_t ticked = by_hindsight(host.url(), "ticks");
  EXPECT_TRUE(host.Stop());
  EnvServerOptions options;
  options.training_length = kSteps;
  const ServedWorld served((*worlds::FindWorld("point-reach-v0"))->create(2), options);
  EXPECT_EQ(ticked, by_hindsight(served.url(), "at_once"));
}

// The step that was under way is carried out once, whether its trainer was there to hear of it or not.
TEST(EngineInTicks, AConnectionThatBreaksInTheMiddleOfAStepIsTakenUpAgain) {
  TickingHost host("road-v0", 1, 1, 0.001);
  const auto connect = [&] { return *ConnectTcp(*Endpoint::Parse(host.url()), 2.0); };
  RawTrainer gone(connect());
  gone.Begin(host.spec());
  ASSERT_EQ(gone.Ask(FrameType::kReset, 2, gone.ResetPayload(5, {1})).size(), gone.blocks.result_bytes);
  const std::vector<std::byte> step = gone.StepPayload({2}, {1});

  host.Hold(true);
  gone.Send(FrameBytes(FrameType::kStep, 3, step));
  host.AwaitStep();
  gone.transport().Close();
  RawTrainer back(connect());
  back.blocks = gone.blocks;
  Hello hello;
  hello.resume = gone.resume;
  back.Send(FrameType::kHello, 0, EncodeHello(hello));
  host.Hold(false);
  const Frame welcome = back.Next();
  ASSERT_EQ(welcome.header.type, FrameType::kWelcome);
  EXPECT_TRUE(ParseWelcome(welcome.payload)->resumed);
  for (const std::uint64_t request : {3, 4}) {
    const std::vector<std::byte> result = back.Ask(FrameType::kStep, request, step);
    ASSERT_EQ(back.last_type, FrameType::kResult);
    float seen = 0.0f;
    std::memcpy(&seen, result.data() + back.blocks.behaviours[0].observations, sizeof(seen));
    EXPECT_EQ(seen, 10.0f + static_cast<float>(request - 2));  // one place to the right for each step
  }
}

// Gymnasium's default: an episode's end and the next one's beginning are two steps, the second of which no world takes.
TEST(EngineInTicks, BeginsTheNextEpisodeInTheNextStepWhereItIsOneWorld) {
  TickingHost host("road-v0", 1, 2, 0.001);
  RawTrainer trainer(*ConnectTcp(*Endpoint::Parse(host.url()), 2.0));
  trainer.Begin(host.spec(), "{\"autoreset\":\"next_step\"}");
  (void)trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(5, {1}));
  const auto seen = [&](const std::vector<std::byte>& result) {
    float place = -1.0f;
    std::memcpy(&place, result.data() + trainer.blocks.behaviours[0].observations, sizeof(place));
    return place;
  };
  const auto state = [&](const std::vector<std::byte>& result) {
    return static_cast<unsigned>(result[trainer.blocks.behaviours[0].states]);
  };
  std::uint64_t request = 2;
  std::vector<std::byte> result;
  do {
    result = trainer.Ask(FrameType::kStep, ++request, trainer.StepPayload({0}, {1}));
    ASSERT_EQ(trainer.last_type, FrameType::kResult);
    ASSERT_LT(request, 20u);
  } while ((state(result) & kTerminated) == 0);
  EXPECT_EQ(request, 2u + 11u);  // from 10 to the left, off the road
  EXPECT_EQ(seen(result), 0.0f);
  result = trainer.Ask(FrameType::kStep, ++request, trainer.StepPayload({0}, {1}));
  EXPECT_EQ(state(result), kFirst | kActive);
  const float first = seen(result);
  result = trainer.Ask(FrameType::kStep, ++request, trainer.StepPayload({1}, {1}));
  EXPECT_EQ(seen(result), first) << "it has not moved meanwhile";
  EXPECT_EQ(state(result), static_cast<unsigned>(kActive));
}

TEST(EngineInTicks, ATrainerThatIsKilledLeavesRoomForTheNext) {
  TickingHost host("road-v0", 1, 2, 0.01);
  for (int i = 0; i < 3; ++i) {
    auto gone = *ConnectTcp(*Endpoint::Parse(host.url()), 2.0);
    EnvClientOptions options;
    auto client = EnvClient::Open(std::move(gone), options);
    ASSERT_TRUE(client.ok()) << client.status().message();
    BatchBuffer rows((*client)->spec().behaviours[0]);
    ASSERT_TRUE((*client)->Reset(1, {&rows.batch(), 1}).ok());
    ASSERT_TRUE((*client)->Step({&rows.batch(), 1}, MoreSteps::kYes).ok());
  }
  const ScratchFolder folder("after_the_killed");
  const Result<run::RunSummary> summary = run::Train(Quiet(host.url(), folder, "next"), kNever);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
}

}  // namespace
}  // namespace consac::testing
