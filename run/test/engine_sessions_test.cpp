// What an engine asks for: to be trained, to be acted for, to be left alone; and one session after another.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
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

TEST(Engine, LengthZeroWithANameActsUntilTheEngineCloses) {
  consac::testing::ScratchFolder scratch("act");
  TrainRoad(scratch.path(), "walker");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#0#walker", "10,30", "11,30", "12,30#1#0"}, ScriptedEngine::End::kClose);
  RunConfig config = Nameless(scratch.path(), engine);
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
    EXPECT_THAT(FailureWith(Nameless(scratch.path(), engine)).message(), HasSubstr("did you mean 'walker'"));
  }
  {
    ScriptedEngine engine({"D#3#0#B#3#0,0,0,40,40,40#0#walker", "10,30,1"}, ScriptedEngine::End::kClose);
    EXPECT_THAT(FailureWith(Nameless(scratch.path(), engine)).message(),
                AllOf(HasSubstr("observation"), HasSubstr("Box")));
  }
  {
    ScriptedEngine engine({"D#4#0#B#2#0,0,40,40#0#walker", "10,30"}, ScriptedEngine::End::kClose);
    EXPECT_THAT(FailureWith(Nameless(scratch.path(), engine)).message(),
                AllOf(HasSubstr("action"), HasSubstr("Discrete")));
  }
}

TEST(Engine, ASetupOfLengthZeroWithoutANameSaysWhatIsMissing) {
  consac::testing::ScratchFolder scratch("setup_zero");
  ScriptedEngine engine({"D#3#0#B#2#0,0,40,40#0", "10,30#0#0"}, ScriptedEngine::End::kClose);
  RunConfig config = Nameless(scratch.path(), engine);
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
    RunConfig config = EngineRun(scratch.path(), engine);
    config.resume = resume;
    const Status status = FailureWith(config);
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << status.message();
    EXPECT_THAT(status.message(), HasSubstr("of 9000000000000000000 steps are missing"));
  }
  // A finished run that is asked for as many again.
  RunConfig config = SmallRun(scratch.path(), "engine");
  config.force = true;
  ScriptedEngine first({"D#3#0#B#2#0,0,40,40#2", "10,30#0#0", "11,30#1#0", "12,30#1#0"}, ScriptedEngine::End::kClose);
  config.steps = 2;
  ASSERT_TRUE(Train(On(first, config), kNeverStop).ok());
  ScriptedEngine again(lines, ScriptedEngine::End::kClose);
  RunConfig more = EngineRun(scratch.path(), again);
  more.resume = true;
  EXPECT_THAT(FailureWith(more).message(), HasSubstr("of 9000000000000000000 steps are missing"));
}

// Not once a try: an engine that is broken for a night fills no disk.
TEST(Engine, ForeverSaysWhatKeepsSessionsFromBeginningOnceAMinute) {
  consac::testing::ScratchFolder scratch("dropped");
  const auto listener = *ListenTcp({"127.0.0.1", 0});
  std::atomic<bool> stop{false};
  std::atomic<int> dropped{0};
  std::thread engine([&] {
    while (!stop) {
      Result<std::unique_ptr<Transport>> trainer = listener->Accept(0.05);
      if (!trainer.ok() || *trainer == nullptr) continue;
      (*trainer)->Close();
      if (++dropped == 5) stop = true;
    }
  });
  RunConfig config = EngineRun(scratch.path(), "tcp://127.0.0.1:" + std::to_string(listener->port()));
  config.forever = true;
  ::testing::internal::CaptureStderr();
  EXPECT_TRUE(Train(config, stop).ok());
  const std::string said = ::testing::internal::GetCapturedStderr();
  engine.join();
  const std::size_t first = said.find("error: 127.0.0.1"), last = said.rfind("error: 127.0.0.1");
  ASSERT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("error: 127.0.0.1", first + 1), last) << "the first, and at the end how many more: " << said;
  EXPECT_NE(said.find(" more like it)", last), std::string::npos) << said;
}

/// A hundredth of the time that passes, for what is not to depend on how busy the machine is.
class SlowClock {
 public:
  SlowClock() {
    Hooks hooks;
    hooks.now = [](void*) {
      return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count() / 100.0;
    };
    SetHooks(hooks);
  }
  ~SlowClock() { SetHooks({}); }
  SlowClock(const SlowClock&) = delete;
  SlowClock& operator=(const SlowClock&) = delete;
};

// Of one step each, by turns trained on and acted for: the first is told of in full, of the rest a line in a second.
TEST(Engine, ForeverTellsOfBriefSessionsInALineNowAndThen) {
  constexpr int kSessions = 24;
  consac::testing::ScratchFolder scratch("brief");
  TrainRoad(scratch.path(), "walker");
  const auto listener = *ListenTcp({"127.0.0.1", 0});
  std::atomic<bool> stop{false};
  const SlowClock clock;
  std::thread engine([&] {
    std::byte action[256];
    for (int served = 0; served < kSessions;) {
      Result<std::unique_ptr<Transport>> trainer = listener->Accept(5.0);
      if (!trainer.ok() || *trainer == nullptr) break;
      const bool acts = served++ % 2 == 1;
      const auto say = [&](const std::string& line) { (void)(*trainer)->Write(std::as_bytes(std::span(line)), 5.0); };
      say(acts ? "D#3#0#B#2#0,0,40,40#0#walker\n10,30\n" : "D#3#0#B#2#0,0,40,40#1\n10,30#0#0\n");
      (void)(*trainer)->Read(action, 5.0);
      say(acts ? "11,30\n" : "11,30#1#0\n");
      (void)(*trainer)->Read(action, 5.0);
      (*trainer)->Close();
    }
    stop = true;
  });
  RunConfig config = Nameless(scratch.path(), "tcp://127.0.0.1:" + std::to_string(listener->port()));
  config.protocol = "text1";
  config.forever = config.table = config.progress = true;
  config.quiet = false;
  config.hyperparameters = {{"n_steps", "1"}, {"nminibatches", "1"}, {"net_arch", "[{pi: [4], vf: [4]}]"}};
  ::testing::internal::CaptureStdout();
  const Result<RunSummary> summary = Train(config, stop);
  engine.join();
  const std::string said = ::testing::internal::GetCapturedStdout();
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  const auto times = [&said](std::string_view words) {
    int count = 0;
    for (std::size_t at = said.find(words); at != said.npos; at = said.find(words, at + 1)) ++count;
    return count;
  };
  EXPECT_GE(summary->sessions, kSessions - 1);
  EXPECT_EQ(times("training completed"), 1) << said;
  EXPECT_EQ(times("acting with"), 0) << said;
  EXPECT_EQ(times("session 2: acted for 1 step, "), 1) << said;
  EXPECT_EQ(times("\nsession "), 2) << "the first, and at the end how many there were: " << said;
  EXPECT_EQ(times(" more like it)"), 1) << said;
  for (const char* file : {"config.yaml", "model.consac", "progress.csv", "monitor.csv"})
    EXPECT_TRUE(std::filesystem::exists(scratch.path() + "/engine__ppo2__3_5/" + file)) << file;
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
