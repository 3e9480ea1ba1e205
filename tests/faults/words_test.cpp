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
    engine.Send(FrameType::kSpec, engine.Next().header.request, R"({"behaviours": 7})");
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

}  // namespace
}  // namespace consac
