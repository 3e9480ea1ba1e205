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
#include "small_run.h"
#include "tests/protocol2_peers.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ServedWorld = consac::testing::ServedWorld;

RunConfig EngineRun(const std::string& directory, const std::string& url) {
  RunConfig config = SmallRun(directory, "engine");
  config.world = url;
  config.steps = -1;
  config.connect_timeout_s = 5.0;
  config.deadline_s = 5.0;
  config.lockstep = true;  // as in process, to the bit
  return config;
}

/// The same without a name of its own, so that the engine's counts.
RunConfig Nameless(const std::string& directory, const std::string& url) {
  RunConfig config = EngineRun(directory, url);
  config.name = "";
  return config;
}

/// An engine made of lines: says each of `messages` when the trainer has answered the one before, then does `end`.
class ScriptedEngine {
 public:
  enum class End { kClose, kStaySilent };
  ScriptedEngine(std::vector<std::string> messages, End end)
      : listener_(*ListenTcp({"127.0.0.1", 0})), messages_(std::move(messages)), end_(end) {
    thread_ = std::thread([this] { Serve(); });
  }
  ~ScriptedEngine() {
    stop_ = true;
    thread_.join();
  }
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(listener_->port()); }

 private:
  void Serve() {
    std::unique_ptr<Transport> trainer;
    while (trainer == nullptr && !stop_) trainer = std::move(*listener_->Accept(0.05));
    if (trainer == nullptr) return;
    std::byte answer[256];
    for (std::size_t i = 0; i < messages_.size() && !stop_; ++i) {
      const std::string line = messages_[i] + "\n";
      if (!trainer->Write(std::as_bytes(std::span(line)), 5.0).ok()) return;
      if (i == 0) continue;  // the setup is not answered
      Result<std::size_t> count = std::size_t{0};
      while (!stop_ && count.ok() && *count == 0) count = trainer->Read(answer, 0.05);
      if (!count.ok()) return;
    }
    while (end_ == End::kStaySilent && !stop_) (void)trainer->Read(answer, 0.05);
    trainer->Close();
  }

  std::unique_ptr<Listener> listener_;
  std::vector<std::string> messages_;
  End end_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

Status FailureWith(const RunConfig& config) {
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_FALSE(summary.ok());
  return summary.status();
}

/// A small trained road model in `directory`.
std::string TrainRoad(const std::string& directory, const std::string& name) {
  RunConfig config = SmallRun(directory, name);
  config.steps = 256;
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? summary->models[0].path : "";
}

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
  const Status status = FailureWith(EngineRun(scratch.path(), engine.url()));
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
    config = EngineRun(scratch.path(), engine.url());
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
  RunConfig config = EngineRun(scratch.path(), engine.url());
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
    RunConfig config = EngineRun(scratch.path(), engine.url());
    config.force = true;
    const Status status = FailureWith(config);
    EXPECT_THAT(status.message(), AllOf(HasSubstr("at step 2"), HasSubstr("steps are missing"))) << bad;
    EXPECT_TRUE(Policy::Load(scratch.path() + "/engine/model.consac").ok()) << bad;
  }
}

TEST(Engine, AnotherServiceOnThePortIsToldApart) {
  consac::testing::ScratchFolder scratch("service");
  ScriptedEngine engine({"220 mail.example ESMTP"}, ScriptedEngine::End::kStaySilent);
  const Status status = FailureWith(EngineRun(scratch.path(), engine.url()));
  EXPECT_THAT(status.message(), HasSubstr("220 mail.example"));
  EXPECT_TRUE(std::filesystem::is_empty(scratch.path()));
}

TEST(Engine, CtrlCDuringASilenceSavesAndReturnsAtOnce) {
  consac::testing::ScratchFolder scratch("ctrlc");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#1000", "10,30#0#0", "11,30#1#0"}, ScriptedEngine::End::kStaySilent);
  RunConfig config = EngineRun(scratch.path(), engine.url());
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

TEST(Engine, LengthZeroWithANameActsUntilTheEngineCloses) {
  consac::testing::ScratchFolder scratch("act");
  TrainRoad(scratch.path(), "walker");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#0#walker", "10,30", "11,30", "12,30#1#0"}, ScriptedEngine::End::kClose);
  RunConfig config = Nameless(scratch.path(), engine.url());
  const Result<RunSummary> summary = Train(config, kNeverStop);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_TRUE(summary->acted_only);
  EXPECT_EQ(summary->steps, 2) << "the third action was not answered any more";
  EXPECT_EQ(summary->models[0].path, scratch.path() + "/walker/model.consac");
}

TEST(Engine, AModelThatIsNotThereOrDoesNotFitIsNamed) {
  consac::testing::ScratchFolder scratch("fit");
  TrainRoad(scratch.path(), "walker");
  {
    ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#0#wolker", "10,30"}, ScriptedEngine::End::kClose);
    EXPECT_THAT(FailureWith(Nameless(scratch.path(), engine.url())).message(), HasSubstr("did you mean 'walker'"));
  }
  {
    ScriptedEngine engine({"D#3#0#B#3#0,0,0,40,40,40#0#walker", "10,30,1"}, ScriptedEngine::End::kClose);
    EXPECT_THAT(FailureWith(Nameless(scratch.path(), engine.url())).message(),
                AllOf(HasSubstr("observation"), HasSubstr("Box")));
  }
  {
    ScriptedEngine engine({"D#4#0#B#2#0,0,40,40#0#walker", "10,30"}, ScriptedEngine::End::kClose);
    EXPECT_THAT(FailureWith(Nameless(scratch.path(), engine.url())).message(),
                AllOf(HasSubstr("action"), HasSubstr("Discrete")));
  }
}

TEST(Engine, ASetupOfLengthZeroWithoutANameSaysWhatIsMissing) {
  consac::testing::ScratchFolder scratch("setup_zero");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#0", "10,30#0#0"}, ScriptedEngine::End::kClose);
  RunConfig config = Nameless(scratch.path(), engine.url());
  EXPECT_THAT(FailureWith(config).message(), AllOf(HasSubstr("length 0"), HasSubstr("no model name")));
}

/// An engine of protocol 2 that asks for training of length 0, answers two steps and sends its trainer away.
class BriefEngine {
 public:
  explicit BriefEngine(const std::string& model_name) {
    engine_.message.training_length = 0;
    engine_.message.model_name = model_name;
    thread_ = std::thread([this] {
      engine_.Begin();
      for (int step = 0; step < 2; ++step)
        engine_.Send(
            consac::testing::FrameBytes(FrameType::kResult, engine_.Next().header.request, engine_.ResultPayload()));
      (void)engine_.Next();
      engine_.Send(FrameType::kGoAway, 0, R"({"reason": "enough"})");
      (void)engine_.Next();
    });
  }
  ~BriefEngine() { thread_.join(); }
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(engine_.port()); }

 private:
  using FrameType = protocol2::FrameType;
  consac::testing::RawEngine engine_;
  std::thread thread_;
};

// It asks for nothing: then what the help promises is trained, under whatever name.
TEST(Engine, LengthZeroWithoutANameTrainsThePromisedSteps) {
  consac::testing::ScratchFolder scratch("zero");
  for (const char* name : {"", "walker"}) {
    BriefEngine engine("");
    RunConfig config = EngineRun(scratch.path(), engine.url());
    config.name = name;
    EXPECT_THAT(FailureWith(config).message(), HasSubstr("of 100000 steps are missing")) << name;
  }
  EXPECT_TRUE(std::filesystem::exists(scratch.path() + "/walker/model.consac"));
}

// `consac train --resume --name X` is what an interrupted run advises.
TEST(Engine, AResumedRunGoesOnWithTrainingWhateverTheEngineAsksFor) {
  for (const char* model : {"", "engine"}) {
    consac::testing::ScratchFolder scratch("resumed");
    for (const bool resume : {false, true}) {
      BriefEngine engine(model);
      RunConfig config = EngineRun(scratch.path(), engine.url());
      config.steps = resume ? -1 : 200;
      config.resume = resume;
      EXPECT_THAT(FailureWith(config).message(), HasSubstr("of 200 steps are missing"))
          << "it trains, and does not act";
    }
  }
}

TEST(Engine, ATakenNameIsRefusedBeforeTheEngineIsDisturbed) {
  consac::testing::ScratchFolder scratch("taken");
  TrainRoad(scratch.path(), "engine");
  const auto listener = std::move(*ListenTcp({"127.0.0.1", 0}));
  const std::string url = "tcp://127.0.0.1:" + std::to_string(listener->port());
  EXPECT_EQ(FailureWith(EngineRun(scratch.path(), url)).code(), StatusCode::kAlreadyExists);
  RunConfig config = EngineRun(scratch.path(), url);
  config.name = "../engine";
  EXPECT_EQ(FailureWith(config).code(), StatusCode::kInvalidArgument);
  const Result<std::unique_ptr<Transport>> trainer = listener->Accept(0.05);
  EXPECT_TRUE(trainer.ok() && *trainer == nullptr) << "nobody has connected";
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

TEST(Engine, OneThatAsksToBeLeftAloneIs) {
  const auto listener = std::move(*ListenTcp({"127.0.0.1", 0}));
  EngineOptions options;
  options.url = "tcp://127.0.0.1:" + std::to_string(listener->port());
  options.connect_timeout_s = 0.0;
  options.client.not_before = std::make_shared<std::atomic<double>>(Now() + 100.0);
  const Status status = ConnectEngine(options, [](const std::string&) {}).status();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("left alone for"));
  const Result<std::unique_ptr<Transport>> trainer = listener->Accept(0.05);
  EXPECT_TRUE(trainer.ok() && *trainer == nullptr) << "nobody has connected";
}

// A run folder each, and none of them with anything in it, is what there must not be hundreds of.
TEST(Engine, SessionsWithoutAnythingLearnedAreFollowedByLongerAndLongerPauses) {
  consac::testing::ScratchFolder scratch("pauses");
  const auto listener = std::move(*ListenTcp({"127.0.0.1", 0}));
  std::atomic<bool> stop{false};
  std::vector<double> began;
  std::thread engine([&] {
    while (began.size() < 3) {
      const std::unique_ptr<Transport> trainer = std::move(*listener->Accept(0.05));
      if (trainer == nullptr) continue;
      began.push_back(Now());
      const std::string_view lines = "D#3#0#B#2#0,0,40,40#1000\n10,30#0#0\n";
      (void)trainer->Write(std::as_bytes(std::span(lines)), 1.0);
      trainer->Close();
    }
    stop = true;
  });
  RunConfig config = Nameless(scratch.path(), "tcp://127.0.0.1:" + std::to_string(listener->port()));
  config.forever = true;
  const Result<RunSummary> summary = Train(config, stop);
  engine.join();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_GE(summary->sessions, 2);
  EXPECT_GE(began[1] - began[0], 0.9);
  EXPECT_GE(began[2] - began[1], 1.9);
}

TEST(Engine, ALengthBeyondAnyCanBeResumed) {
  consac::testing::ScratchFolder scratch("endless");
  const std::vector<std::string> lines = {"D#3#0#B#2#0,0,40,40#9223372036854775807", "10,30#0#0", "11,30#1#0"};
  for (const bool resume : {false, true}) {
    ScriptedEngine engine(lines, ScriptedEngine::End::kClose);
    RunConfig config = EngineRun(scratch.path(), engine.url());
    config.resume = resume;
    const Status status = FailureWith(config);
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << status.message();
    EXPECT_THAT(status.message(), HasSubstr("of 9000000000000000000 steps are missing"));
  }
  // A finished run that is asked for as many again.
  RunConfig config = SmallRun(scratch.path(), "engine");
  config.force = true;
  ScriptedEngine first({"D#3#0#B#2#0,0,40,40#2", "10,30#0#0", "11,30#1#0", "12,30#1#0"}, ScriptedEngine::End::kClose);
  config.world = first.url();
  config.steps = 2;
  ASSERT_TRUE(Train(config, kNeverStop).ok());
  ScriptedEngine again(lines, ScriptedEngine::End::kClose);
  RunConfig more = EngineRun(scratch.path(), again.url());
  more.resume = true;
  EXPECT_THAT(FailureWith(more).message(), HasSubstr("of 9000000000000000000 steps are missing"));
}

TEST(Engine, ForeverServesOneSessionAfterAnother) {
  consac::testing::ScratchFolder scratch("forever");
  auto listener = ListenTcp({"127.0.0.1", 0});
  const std::string url = "tcp://127.0.0.1:" + std::to_string((*listener)->port());
  std::atomic<bool> stop{false};
  Status first, second, third;
  // One engine that trains a model, fails once, and then asks for the model to act.
  std::thread engine([&] {
    const auto world = (*worlds::FindWorld("road-v0"))->create(1);
    const auto session = [&](std::int64_t length, const char* name) {
      EnvServerOptions options;
      options.training_length = length;
      options.model_name = name;
      std::atomic<bool> session_over{false};
      auto server = EnvServer::Create(*world, std::move(*listener), options);
      std::thread limit([&] {
        const auto enough = [&] { return session_over.load() || (length == 0 && (*server)->session_steps() > 20); };
        for (int i = 0; i < 1000 && !enough(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
        session_over = true;
      });
      const Status status = (*server)->ServeSession(session_over);
      session_over = true;
      limit.join();
      const int port = (*server)->port();
      (*server)->Close("the engine closes");
      listener = ListenTcp({"127.0.0.1", port});
      return status;
    };
    first = session(200, "walker");
    second = session(100, "wanderer");
    third = session(0, "walker");
    stop = true;
  });
  RunConfig config = Nameless(scratch.path(), url);
  config.forever = true;
  const Result<RunSummary> summary = Train(config, stop);
  engine.join();
  EXPECT_TRUE(first.ok()) << first.message();
  EXPECT_TRUE(second.ok()) << second.message();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_TRUE(summary->interrupted);
  EXPECT_TRUE(Policy::Load(scratch.path() + "/walker/model.consac").ok());
  EXPECT_TRUE(Policy::Load(scratch.path() + "/wanderer/model.consac").ok());
}

}  // namespace
}  // namespace consac::run
