// What one end says of the other: enough to find the fault by.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/faults/fault_peers.h"

namespace consac {
namespace {

using namespace testing;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// What the trainer makes of `frame` in place of its first step's answer.
Status StepAnsweredWith(FrameType type, std::string_view json, EnvClientOptions options = Impatient(Way::kTcp)) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    engine.Send(type, engine.Next().header.request, json);
    (void)engine.Next();
  });
  Status status;
  {
    Session session(engine.Connect(), options);
    status = session.Step();
  }
  peer.join();
  return status;
}

/// What the trainer makes of a WELCOME.
Status WelcomedWith(std::string_view json) {
  RawEngine engine;
  std::thread peer([&] {
    ASSERT_TRUE(engine.Accept());
    (void)engine.Next();
    engine.Send(FrameType::kWelcome, 0, json);
    (void)engine.Next();
  });
  const Status status = EnvClient::Open(engine.Connect(), Impatient(Way::kTcp)).status();
  peer.join();
  return status;
}

TEST(Words, ARefusalHasItsCodeItsEnvironmentAndWhenToComeAgain) {
  const ErrorMessage error{"ENV_FAILED", false, "it fell over", {}, 7.0, 3};
  EXPECT_THAT(StepAnsweredWith(FrameType::kError, EncodeError(error)).message(),
              AllOf(HasSubstr("refused (ENV_FAILED, environment 3): it fell over"), HasSubstr("again in 7 s")));
  const ErrorMessage plain{"OUT_OF_RANGE", false, "99 is no action", {}, 0.0, -1};
  EXPECT_THAT(StepAnsweredWith(FrameType::kError, EncodeError(plain)).message(),
              HasSubstr("refused (OUT_OF_RANGE): 99 is no action"));
}

TEST(Words, AStepOfSeveralAgentsSaysWhatIsCounted) {
  for (const auto& [copies, words] :
       {std::pair(1, "at step 2: stopped"), std::pair(3, "at step 2 of each environment: ")}) {
    const Engine engine({}, "road-v0", copies);
    std::atomic<bool> stop{false};
    EnvClientOptions options = Impatient(Way::kTcp);
    options.stop = &stop;
    Session session(engine.Connect(), options);
    ASSERT_TRUE(session.Step().ok());
    stop = true;
    EXPECT_THAT(session.Step().message(), HasSubstr(words));
  }
}

/// A connection whose other end takes nothing any more, once it is `full`.
class FullPipe final : public Transport {
 public:
  FullPipe(std::unique_ptr<Transport> open, const std::atomic<bool>& full) : open_(std::move(open)), full_(full) {}
  Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
    return open_->Read(into, timeout_s);
  }
  Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) override {
    if (!full_) return open_->WriteSome(bytes, timeout_s);
    std::this_thread::sleep_for(std::chrono::duration<double>(timeout_s));
    return std::size_t{0};
  }
  void Close() override { open_->Close(); }
  std::string peer() const override { return open_->peer(); }

 private:
  std::unique_ptr<Transport> open_;
  const std::atomic<bool>& full_;
};

TEST(Words, AStopIsSeenWhileAnEngineReadsNothing) {
  for (const Way way : {Way::kText1, Way::kTcp}) {
    EnvServerOptions serving;
    serving.grace_s = 0.05;
    const Engine engine((*worlds::FindWorld("road-v0"))->create(1), serving);
    std::atomic<bool> stop{false}, full{false};
    EnvClientOptions options = Impatient(way);
    options.deadline_s = 10.0;
    options.stop = &stop;
    Session session(std::make_unique<FullPipe>(engine.Connect(), full), options);
    full = true;
    std::thread user([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      stop = true;
    });
    const double before = Now();
    EXPECT_EQ(session.Step().code(), StatusCode::kCancelled);
    EXPECT_LT(Now() - before, 5.0);
    user.join();
  }
}

TEST(Words, TwoAgentsOfOneNameAreToldAsThat) {
  SpecMessage spec;
  spec.env.behaviours.push_back(BehaviourSpec::Of("walker", *Space::Box(-1, 1, {2}), *Space::Discrete(2), 2));
  spec.env.behaviours[0].agents = {"left", "left"};
  RawEngine engine;
  std::thread peer([&] {
    ASSERT_TRUE(engine.Accept());
    (void)engine.Next();
    Welcome welcome;
    welcome.session = 1;
    engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    engine.Send(FrameType::kSpec, engine.Next().header.request, EncodeSpec(spec));
    (void)engine.Next();
  });
  const auto client = EnvClient::Open(engine.Connect(), Impatient(Way::kTcp));
  EXPECT_THAT(client.status().message(), HasSubstr("agent name 'left' is there twice"));
  peer.join();
}

// What is wrong with it is said once, whichever way requests would have gone.
TEST(Words, ASpecThatIsNoneIsAskedForOnce) {
  LogLines log;
  RawEngine engine;
  FrameType next = FrameType::kConfigure;
  std::thread peer([&] {
    ASSERT_TRUE(engine.Accept());
    (void)engine.Next();
    Welcome welcome;
    welcome.session = 1;
    welcome.capabilities = {"shm"};
    engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    engine.Send(FrameType::kSpec, engine.Next().header.request, R"({"environments": 1, "behaviours": 7})");
    next = engine.Next().header.type;
  });
  {
    const auto client = EnvClient::Open(engine.Connect(), Impatient(Way::kShared));
    EXPECT_EQ(client.status().code(), StatusCode::kProtocol);
    EXPECT_THAT(client.status().message(), HasSubstr("behaviours"));
  }
  peer.join();
  EXPECT_NE(next, FrameType::kConfigure);
  EXPECT_THAT(log.lines(), ::testing::IsEmpty());
}

TEST(Words, AFrameOfATypeThatNobodyKnowsIsNamed) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    (void)engine.Next();
    engine.Send(static_cast<FrameType>(99), 0, "{}");
    (void)engine.Next();
  });
  {
    Session session(engine.Connect(), Impatient(Way::kTcp));
    EXPECT_THAT(session.Step().message(), HasSubstr("a frame of type 99, which protocol 2 does not know"));
  }
  peer.join();
}

TEST(Words, GoAwaySaysWhenToComeAgainAndThatIsKept) {
  EnvClientOptions options = Impatient(Way::kTcp);
  options.not_before = std::make_shared<std::atomic<double>>(0.0);
  const double before = Now();
  const Status status =
      StepAnsweredWith(FrameType::kGoAway, R"({"reason": "a new level", "retry_after_s": 30})", options);
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("a new level"), HasSubstr("again in 30 s")));
  EXPECT_GE(options.not_before->load(), before + 30.0);
  EXPECT_LE(options.not_before->load(), Now() + 30.0);
}

TEST(Words, WhoSaidItIsInTheLine) {
  for (const std::string_view result : {"", "short"}) {
    const Status status = StepAnsweredWith(FrameType::kResult, result);
    EXPECT_THAT(status.message(), HasSubstr("at step 1: 127.0.0.1:"));
  }
  EXPECT_THAT(StepAnsweredWith(FrameType::kError, R"({"severity": "no such"})").message(), HasSubstr("127.0.0.1:"));
  EXPECT_THAT(WelcomedWith(R"({"session": 0, "protocol": 2})").message(), HasSubstr("127.0.0.1:"));
}

TEST(Words, AWelcomeWhoseVersionIsNoNumberIsMalformed) {
  EXPECT_THAT(WelcomedWith(R"({"session": 1, "protocol": "2"})").message(),
              HasSubstr("MALFORMED: WELCOME: protocol is '\"2\"', expected a whole number"));
  EXPECT_THAT(WelcomedWith(R"({"session": 1})").message(), HasSubstr("MALFORMED: WELCOME: protocol is missing"));
  EXPECT_THAT(WelcomedWith(R"({"session": 1, "protocol": 3})").message(), HasSubstr("UNSUPPORTED_VERSION: the engine"));
  EXPECT_THAT(WelcomedWith(R"({"protocol": 2})").message(), HasSubstr("MALFORMED: WELCOME: session is missing"));
}

TEST(Words, ARewardBeyondFloat32IsSaidAsItWas) {
  for (const bool refused : {true, false}) {
    LogLines log;
    RawEngine engine;
    std::thread peer([&] {
      engine.Begin();
      std::vector<std::byte> result = engine.ResultPayload();
      const double reward = -1e308;
      std::memcpy(result.data() + engine.blocks.behaviours[0].rewards, &reward, sizeof(reward));
      engine.Send(FrameBytes(FrameType::kResult, engine.Next().header.request, result));
      (void)engine.Next();
    });
    EnvClientOptions options = Impatient(Way::kTcp);
    options.refuse_non_finite = refused;
    {
      Session session(engine.Connect(), options);
      const Status status = session.Step();
      EXPECT_EQ(status.code(), refused ? StatusCode::kNonFinite : StatusCode::kOk);
      const std::string said = refused ? status.message() : log.lines().empty() ? "" : log.lines()[0];
      EXPECT_THAT(said, HasSubstr("the reward of slot 0 of 'default' is -1e+308, beyond float32's 3.4e38"));
    }
    peer.join();
  }
}

// Every line that an engine can have its trainer say again and again.
TEST(Words, AnEngineThatPausesWithoutEndIsToldInAFewLines) {
  constexpr int kTimes = 1000;
  LogLines log;
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    const std::uint64_t request = engine.Next().header.request;
    for (int i = 0; i < kTimes; ++i) {
      engine.Send(FrameType::kPaused, 0, "");
      engine.Send(FrameType::kPaused, 0, "");
      engine.Send(FrameType::kResumed, 0, "");
    }
    engine.Send(FrameBytes(FrameType::kResult, request, engine.ResultPayload()));
    (void)engine.Next();
  });
  {
    EnvClientOptions options = Impatient(Way::kTcp);
    options.deadline_s = 5.0;
    Session session(engine.Connect(), options);
    EXPECT_TRUE(session.Step().ok());
    EXPECT_EQ(log.lines().size(), 5u);
  }
  peer.join();
  ASSERT_EQ(log.lines().size(), 6u);
  EXPECT_THAT(log.lines().back(), HasSubstr("is paused (and " + std::to_string(kTimes - 6) + " more like it)"));
}

TEST(Words, AnEngineThatClosesBehindEveryStepIsToldInAFewLines) {
  constexpr std::uint64_t kSteps = 20;
  LogLines log;
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    for (std::uint64_t request = engine.Next().header.request; request < kSteps; ++request) {
      engine.Send(FrameBytes(FrameType::kResult, request, engine.ResultPayload()));
      engine.Close();
      ASSERT_TRUE(engine.Accept());
      (void)engine.Next();
      Welcome welcome;
      welcome.session = 1;
      welcome.resumed = true;
      welcome.last_request = request;
      welcome.resume = "of this session";
      engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
      ASSERT_EQ(engine.Next().header.request, request + 1);
    }
    engine.Send(FrameBytes(FrameType::kResult, kSteps, engine.ResultPayload()));
    (void)engine.Next();
  });
  {
    EnvClientOptions options = Impatient(Way::kTcp);
    options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> { return engine.Connect(); };
    Session session(engine.Connect(), options);
    for (std::uint64_t request = 3; request <= kSteps; ++request) {
      const Status status = session.Step();
      ASSERT_TRUE(status.ok()) << status.message();
    }
  }
  peer.join();
  EXPECT_EQ(log.lines().size(), 6u);
  EXPECT_THAT(log.lines().back(), HasSubstr(" more like it)"));
}

// --answer-done is for engines that wait after an end; one that has not sent any is silent for another reason.
TEST(Words, AnEngineThatIsSilentBeforeAnyEndHearsNothingOfAnswerDone) {
  LogLines log;
  const auto listener = *ListenTcp({"127.0.0.1", 0});
  std::atomic<bool> over{false};
  std::thread peer([&] {
    const auto transport = *listener->Accept(5.0);
    const std::string_view setup = "B#1#-1,1#B#1#-1,1#100\n";
    (void)transport->Write(std::as_bytes(std::span(setup)), 2.0);
    while (!over) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  });
  EnvClientOptions options = Impatient(Way::kText1);
  options.after_end_s = 0.05;
  {
    auto client = EnvClient::Open(*ConnectTcp({"127.0.0.1", listener->port()}, 2.0), options);
    ASSERT_TRUE(client.ok()) << client.status().message();
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    EXPECT_EQ((*client)->Reset(0, {&buffer.batch(), 1}).code(), StatusCode::kDeadlineExceeded);
  }
  over = true;
  peer.join();
  EXPECT_THAT(log.lines(), ::testing::IsEmpty());
}

TEST(Words, HelloTwiceIsSaidToBeThat) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  const Frame answer = trainer.Next();
  ASSERT_EQ(answer.header.type, FrameType::kError);
  EXPECT_EQ(ParseError(answer.payload)->code, "BAD_STATE");
  EXPECT_THAT(ParseError(answer.payload)->message, HasSubstr("HELLO was said already"));
}

// For whoever wants an answer within a time, as `consac doctor --timeout` does.
TEST(Words, APausedEngineIsWaitedForOnlyByThoseWhoWantTo) {
  EnvClientOptions options = Impatient(Way::kTcp);
  options.deadline_s = 0.2;
  options.waits_while_paused = false;
  const Status status = StepAnsweredWith(FrameType::kPaused, "{}", options);
  EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded) << status.message();
}

TEST(Words, AnEngineOfProtocol2IsKnownByATrainerOfText1) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Accept();
    engine.Send(FrameType::kPing, 0, "{}");
    engine.Close();
  });
  EnvClientOptions options = Impatient(Way::kTcp);
  options.protocol = Protocol::kText1;
  const auto client = EnvClient::Open(engine.Connect(), options);
  peer.join();
  EXPECT_THAT(client.status().message(), HasSubstr("speaks protocol 2, and was to speak text protocol 1"));
}

// It takes the session up and closes, again and again: that is tried a few times a second, not hundreds of times.
TEST(Words, AnEngineThatTakesASessionUpAndClosesIsGivenTime) {
  RawEngine engine;
  std::atomic<bool> over{false};
  int connections = 0;
  std::thread peer([&] {
    engine.Begin();
    (void)engine.Next();
    engine.Close();
    while (!over) {
      if (!engine.Accept(0.05)) continue;
      ++connections;
      (void)engine.Next();
      Welcome welcome;
      welcome.session = 1;
      welcome.resumed = true;
      welcome.last_request = 2;  // RESET
      welcome.resume = "of this session";
      engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
      engine.Close();
    }
  });
  EnvClientOptions options = Impatient(Way::kTcp);
  options.resume_s = 1.0;
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> { return engine.Connect(); };
  {
    Session session(engine.Connect(), options);
    EXPECT_EQ(session.Step().code(), StatusCode::kUnavailable);
  }
  over = true;
  peer.join();
  EXPECT_GE(connections, 1);
  EXPECT_LE(connections, 8);
}

// R47: it is asked without.
TEST(Words, AnEngineThatTakesNoSeedsIsResetWithout) {
  LogLines log;
  RawEngine engine;
  std::vector<bool> seeded;
  std::thread peer([&] {
    engine.Begin(false);
    for (int resets = 0; resets < 3; ++resets) {
      const Frame reset = engine.Next();
      ASSERT_EQ(reset.header.type, FrameType::kReset);
      seeded.push_back((std::to_integer<unsigned>(reset.payload[0]) & kWithSeeds) != 0);
      if (seeded.back()) {
        engine.Send(FrameType::kError, reset.header.request,
                    EncodeError({"UNSUPPORTED", false, "no seeds here", {}, 0.0}));
      } else {
        engine.Send(FrameBytes(FrameType::kResult, reset.header.request, engine.ResultPayload(kFirst | kActive)));
      }
    }
  });
  {
    Session session(engine.Connect(), Impatient(Way::kTcp));
    EXPECT_TRUE(session.client().Reset(7, {&session.batch(), 1}).ok());
  }
  peer.join();
  EXPECT_THAT(log.lines(), ::testing::Contains(HasSubstr("without seeds")));
  EXPECT_EQ(seeded, (std::vector<bool>{true, false, false})) << "and not asked again";
}

// The connection that the step began on is gone by the time that its error is told.
TEST(Words, AnErrorAfterAnotherConnectionNamesThatOne) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    (void)engine.Next();
    engine.Close();
    ASSERT_TRUE(engine.Accept());
    (void)engine.Next();
    Welcome welcome;
    welcome.session = 1;
    welcome.resumed = true;
    welcome.last_request = 2;  // RESET
    welcome.resume = "of this session";
    engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    const Frame step = engine.Next();
    engine.Send(FrameBytes(FrameType::kResult, step.header.request, engine.ResultPayload(0x80)));
    (void)engine.Next();
  });
  EnvClientOptions options = Impatient(Way::kTcp);
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> { return engine.Connect(); };
  {
    Session session(engine.Connect(), options);
    const Status status = session.Step();
    EXPECT_EQ(status.code(), StatusCode::kProtocol) << status.message();
    EXPECT_THAT(status.message(), HasSubstr("127.0.0.1:" + std::to_string(engine.port()) + ": "));
  }
  peer.join();
}

}  // namespace
}  // namespace consac
