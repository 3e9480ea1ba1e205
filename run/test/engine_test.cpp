// Training and acting for an engine over TCP loopback, and everything that an engine can do wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <thread>

#include "consac/base/hooks.h"
#include "consac/transport/transport.h"
#include "link.h"
#include "scripted_engine.h"
#include "tests/protocol2_peers.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ServedWorld = consac::testing::ServedWorld;

TEST(Engine, LengthAndNameComeFromItsSetup) {
  consac::testing::ScratchFolder scratch("setup");
  EnvServerOptions options;
  options.training_length = 500;
  options.model_name = "walker";
  ServedWorld engine("road-v0", options);
  RunConfig config = Nameless(scratch.path(), engine.url());
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, 500);
  EXPECT_EQ(summary->directory, scratch.path() + "/walker");
  EXPECT_FALSE(summary->interrupted);
  EXPECT_TRUE(Policy::Load(summary->models[0].path).ok());
}

TEST(Engine, TheConfigurationOverrulesItsSetup) {
  consac::testing::ScratchFolder scratch("overrule");
  EnvServerOptions options;
  options.training_length = 500;
  options.model_name = "walker";
  ServedWorld engine("road-v0", options);
  RunConfig config = EngineRun(scratch.path(), engine.url());
  config.steps = 96;
  config.name = "mine";
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, 96);
  EXPECT_EQ(summary->directory, scratch.path() + "/mine");
}

// One world behind a connection learns what the same world learns in process, to the bit.
TEST(Engine, LearnsWhatTheWorldInProcessLearns) {
  consac::testing::ScratchFolder scratch("same");
  EnvServerOptions options;
  options.training_length = 640;
  options.seed = 3;
  ServedWorld engine("road-v0", options);
  const Result<RunSummary> remote = Train(EngineRun(scratch.path(), engine.url()), kNeverStop);
  RunConfig config = SmallRun(scratch.path(), "local");
  config.envs = 1;
  config.steps = 640;
  const Result<RunSummary> local = Train(config, kNeverStop);
  ASSERT_TRUE(remote.ok() && local.ok()) << remote.status().message() << local.status().message();
  EXPECT_EQ(remote->weights_hash, local->weights_hash);
}

TEST(Engine, AnEngineThatIsNotThereIsWaitedForAndThenNamed) {
  consac::testing::ScratchFolder scratch("nobody");
  auto listener = ListenTcp({"127.0.0.1", 0});
  const int port = (*listener)->port();
  (*listener)->Close();
  RunConfig config = EngineRun(scratch.path(), "tcp://127.0.0.1:" + std::to_string(port));
  config.connect_timeout_s = 0.5;
  const double start = Now();
  const Status status = FailureWith(config);
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr(std::to_string(port)));
  EXPECT_GE(Now() - start, 0.4);
}

TEST(Engine, AnEngineThatComesLateIsFound) {
  consac::testing::ScratchFolder scratch("late");
  auto listener = ListenTcp({"127.0.0.1", 0});
  const int port = (*listener)->port();
  (*listener)->Close();
  std::atomic<bool> over{false};
  std::thread engine([&] {
    const auto world = (*worlds::FindWorld("road-v0"))->create(1);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    auto late = ListenTcp({"127.0.0.1", port});
    if (!late.ok()) return;
    EnvServerOptions options;
    options.training_length = 64;
    auto server = EnvServer::Create(*world, std::move(*late), options);
    if (server.ok()) (void)(*server)->ServeSession(over);
  });
  const Result<RunSummary> summary =
      Train(EngineRun(scratch.path(), "tcp://127.0.0.1:" + std::to_string(port)), kNeverStop);
  over = true;
  engine.join();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, 64);
}

TEST(Engine, ThatClosesEarlyLosesNothingAndIsToldHowManyStepsAreMissing) {
  consac::testing::ScratchFolder scratch("early");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#1000", "10,30#0#0", "11,30#1#0", "12,30#1#0"},
                        ScriptedEngine::End::kClose);
  const Status status = FailureWith(EngineRun(scratch.path(), engine));
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("998 of 1000 steps are missing"), HasSubstr(scratch.path() + "/engine"),
                                      HasSubstr("--resume")));
  EXPECT_TRUE(Policy::Load(scratch.path() + "/engine/model.consac").ok());
}

TEST(Engine, ABrokenSessionIsResumedToItsFullLength) {
  consac::testing::ScratchFolder scratch("resume");
  RunConfig config;
  {
    ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#100", "10,30#0#0", "11,30#1#0"}, ScriptedEngine::End::kClose);
    config = EngineRun(scratch.path(), engine);
    (void)FailureWith(config);
  }
  EnvServerOptions options;
  options.training_length = 100;
  ServedWorld engine("road-v0", options);
  config.world = engine.url();
  config.resume = true;
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, 100);
}

TEST(Engine, ThatFallsSilentMeetsItsDeadline) {
  consac::testing::ScratchFolder scratch("silent");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#1000", "10,30#0#0"}, ScriptedEngine::End::kStaySilent);
  RunConfig config = EngineRun(scratch.path(), engine);
  config.deadline_s = 0.3;
  const double start = Now();
  const Status status = FailureWith(config);
  EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(status.message(), HasSubstr("steps are missing"));
  EXPECT_LT(Now() - start, 5.0);
}

TEST(Engine, ThatSendsNaNIsRefusedAndWhatWasLearnedIsSaved) {
  consac::testing::ScratchFolder scratch("nan");
  for (const char* bad : {"nan,30#1#0", "11,inf#1#0", "11,30#nan#0", "11,30#1", "11#1#0", "11,30#x#0", "99,30#1#2"}) {
    ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#1000", "10,30#0#0", "11,30#1#0", bad}, ScriptedEngine::End::kClose);
    RunConfig config = EngineRun(scratch.path(), engine);
    config.force = true;
    const Status status = FailureWith(config);
    EXPECT_THAT(status.message(), AllOf(HasSubstr("at step 2"), HasSubstr("steps are missing"))) << bad;
    EXPECT_TRUE(Policy::Load(scratch.path() + "/engine/model.consac").ok()) << bad;
  }
}

TEST(Engine, AnotherServiceOnThePortIsToldApart) {
  consac::testing::ScratchFolder scratch("service");
  ScriptedEngine engine({"220 mail.example ESMTP"}, ScriptedEngine::End::kStaySilent);
  const Status status = FailureWith(EngineRun(scratch.path(), engine));
  EXPECT_THAT(status.message(), HasSubstr("220 mail.example"));
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(Engine, CtrlCDuringASilenceSavesAndReturnsAtOnce) {
  consac::testing::ScratchFolder scratch("ctrlc");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#1000", "10,30#0#0", "11,30#1#0"}, ScriptedEngine::End::kStaySilent);
  RunConfig config = EngineRun(scratch.path(), engine);
  config.deadline_s = 60.0;
  std::atomic<bool> stop{false};
  std::thread ctrl_c([&stop] {
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    stop = true;
  });
  const double start = Now();
  const Result<RunSummary> summary = Train(config, stop);
  ctrl_c.join();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_TRUE(summary->interrupted);
  EXPECT_LT(Now() - start, 5.0);
  EXPECT_TRUE(Policy::Load(summary->models[0].path).ok());
}

/// Three agents of one world with masks: one is always there, one vanishes, one ends, and both come again while the
/// episode goes on. What nobody looks at, rows and masks of those who are away, is nonsense.
class MaskedTeam {
 public:
  MaskedTeam() {
    BehaviourSpec team = BehaviourSpec::Of("team", *Space::Box(-1, 1, {2}), *Space::Discrete(3), 3);
    team.agents = {"leader", "guest", "walker"};
    team.masks_actions = true;
    engine_.message.env.behaviours = {team};
    engine_.blocks = protocol2::Blocks(engine_.message.env);
    thread_ = std::thread([this] { Serve(); });
  }
  ~MaskedTeam() { thread_.join(); }
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(engine_.port()); }
  int illegal() const { return illegal_; }
  int steps() const { return steps_; }

 private:
  static constexpr unsigned kGuest[] = {16, 16, 2, 0, 0, 24}, kWalker[] = {16, 5, 0, 0, 24, 16};

  void Serve() {
    engine_.Begin(false);
    std::array<unsigned, 3> was = {}, now = {24, 24, 24};
    for (auto frame = engine_.Next(); frame.header.type >= protocol2::FrameType::kReset; frame = engine_.Next()) {
      if (frame.header.type != protocol2::FrameType::kReset && frame.header.type != protocol2::FrameType::kStep) break;
      if (frame.header.type == protocol2::FrameType::kStep) {
        for (std::size_t slot = 0; slot < 3; ++slot) {
          std::int32_t action = 0;
          std::memcpy(&action, frame.payload.data() + engine_.blocks.behaviours[0].actions + 4 * slot, sizeof(action));
          illegal_ += (was[slot] & 16u) != 0 && action == 1 ? 1 : 0;
        }
        now = {16, kGuest[steps_ % 6], kWalker[steps_ % 6]};
        ++steps_;
      }
      engine_.Send(consac::testing::FrameBytes(protocol2::FrameType::kResult, frame.header.request, Payload(was, now)));
      was = now;
    }
  }

  std::vector<std::byte> Payload(const std::array<unsigned, 3>& was, const std::array<unsigned, 3>& now) const {
    const bool final = (now[2] & 4u) != 0;
    std::vector<std::byte> payload(engine_.blocks.result_bytes + (final ? 8 : 0));
    payload[0] = std::byte{final};
    const protocol2::BehaviourBlocks& at = engine_.blocks.behaviours[0];
    for (std::size_t slot = 0; slot < 3; ++slot) {
      const bool plays = (now[slot] & 16u) != 0, seen = (now[slot] & 19u) != 0;
      const float value = seen ? 0.25f * static_cast<float>(slot) : std::numeric_limits<float>::quiet_NaN();
      const float row[2] = {value, value};
      const double reward = (was[slot] & 16u) != 0 && now[slot] != 24 ? 1.0 : 0.0;
      const std::uint8_t legal[] = {1, 0, 1}, nothing[] = {0, 0, 0}, nonsense[] = {7, 0, 9};
      std::memcpy(payload.data() + at.observations + slot * sizeof(row), row, sizeof(row));
      std::memcpy(payload.data() + at.rewards + slot * sizeof(reward), &reward, sizeof(reward));
      payload[at.states + slot] = static_cast<std::byte>(now[slot]);
      std::memcpy(payload.data() + at.masks + slot * 3, plays ? legal : seen ? nothing : nonsense, 3);
    }
    return payload;
  }

  consac::testing::RawEngine engine_;
  std::atomic<int> illegal_{0}, steps_{0};
  std::thread thread_;
};

TEST(Engine, AMaskedTeamWhoseMembersEndOrVanishWhileTheEpisodeGoesOnIsLearned) {
  for (const char* algorithm : {"ppo", "a2c"}) {
    consac::testing::ScratchFolder scratch("team");
    MaskedTeam engine;
    RunConfig config = EngineRun(scratch.path(), engine.url());
    config.algorithm = algorithm;
    config.steps = 1200;
    const Result<RunSummary> summary = Train(config, kNeverStop);
    ASSERT_TRUE(summary.ok()) << algorithm << ": " << summary.status().message();
    EXPECT_EQ(summary->steps, 1200);
    EXPECT_EQ(engine.illegal(), 0);
    EXPECT_GT(engine.steps(), 400);
  }
}

}  // namespace
}  // namespace consac::run
