// A world that lives in an engine's ticks teaches bit for bit what the same world teaches that steps at once: to a
// trainer over either protocol, and to the learner inside the engine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "consac/run/training.h"
#include "consac/server/env_client.h"
#include "engines/host/test/ticked_engine.h"
#include "tests/protocol2_peers.h"
#include "tests/support.h"

namespace consac::testing {
namespace {

constexpr std::int64_t kSteps = 4096;

/// An engine that ticks on a thread of its own and waits for its trainer within a tick, or not.
class TickingHost {
 public:
  TickingHost(const char* world, std::int32_t copies, int period, double wait_s) {
    host::ServeOptions options;
    options.endpoint.port = 0;
    options.server.training_length = kSteps;
    engine_ = std::make_unique<TickedEngine>(world, copies, period);
    driver_ = *host::Serve(engine_->world(), options);
    thread_ = std::thread([this, wait_s] {
      while (!stop_) {
        in_step_ = engine_->world().cue() == host::Cue::kAct;
        if (in_step_ && held_) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
          continue;
        }
        (void)engine_->Tick(*driver_, wait_s);
        finished_ = driver_->finished();
        if (wait_s == 0.0) std::this_thread::yield();
      }
    });
  }
  ~TickingHost() {
    finished_ = true;
    Stop();
  }
  /// Whether the training ended in order, as the engine sees it soon.
  bool Stop() {
    for (const double until = Now() + 2.0; !finished_ && Now() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return finished_;
  }
  /// Steps that begin from now on do not end until it is called with false.
  void Hold(bool held) { held_ = held; }
  void AwaitStep() const {
    for (const double until = Now() + 2.0; !in_step_ && Now() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_TRUE(in_step_);
  }
  const EnvSpec& spec() const { return engine_->world().spec(); }
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(driver_->port()); }

 private:
  std::unique_ptr<TickedEngine> engine_;
  std::unique_ptr<host::Driver> driver_;
  std::atomic<bool> stop_{false}, finished_{false}, held_{false}, in_step_{false};
  std::thread thread_;
};

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
