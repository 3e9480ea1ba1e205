// What an engine tells a trainer at once, and again: frames that do not fit, JSON that may not be, that it stands
// still.
#include <gtest/gtest.h>

#include <numeric>

#include "tests/faults/fault_peers.h"

namespace consac {
namespace {

using namespace protocol2;
using namespace testing;

/// What CONFIGURE is answered where the trainer takes frames of `max_frame` bytes.
ErrorMessage ConfigureRefused(std::unique_ptr<VectorEnv> world, std::size_t max_frame) {
  const Engine engine(std::move(world), {});
  RawTrainer trainer(engine.Connect());
  Hello hello;
  hello.max_frame = max_frame;
  trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
  EXPECT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  trainer.Send(FrameType::kConfigure, 1, "{}");
  const Frame frame = trainer.Next();
  EXPECT_EQ(frame.header.type, FrameType::kError);
  const Result<ErrorMessage> error = ParseError(frame.payload);
  return error.ok() ? *error : ErrorMessage();
}

TEST(Protocol2Limits, AStepThatDoesNotFitIsToldBeforeItIsSent) {
  const ErrorMessage error =
      ConfigureRefused(std::make_unique<PlainWorld>(*Space::Box(0, 1, {2}), *Space::Box(-1, 1, {2000})), 4096);
  EXPECT_EQ(error.code, "UNSUPPORTED");
  EXPECT_NE(error.message.find("STEP"), std::string::npos) << error.message;
}

TEST(Protocol2Limits, ASpecThatIsMoreThanJsonMayBeIsUnsupported) {
  std::vector<double> low(140000), high(low.size());
  std::iota(low.begin(), low.end(), 0.0);
  std::iota(high.begin(), high.end(), 1.0);
  const auto count = static_cast<std::int64_t>(low.size());
  const ErrorMessage error = ConfigureRefused(
      std::make_unique<PlainWorld>(*Space::Box(low, high, {count}), *Space::Discrete(2)), kLargestFrame);
  EXPECT_EQ(error.code, "UNSUPPORTED");
  EXPECT_NE(error.message.find("R7"), std::string::npos) << error.message;
}

TEST(Protocol2Limits, AnErrorIsCutBetweenCharacters) {
  for (const std::string& one : {std::string("x"), std::string("\xC3\xA4"), std::string("\x01"), std::string("\"")}) {
    ErrorMessage error{"SPEC_MISMATCH", false, "", "", 0.0};
    for (int i = 0; i < 9000; ++i) {
      error.message += one;
      error.path += one;
    }
    const std::string text = EncodeError(error);
    EXPECT_LE(text.size(), kLargestBeforeWelcome);
    const Result<ErrorMessage> read = ParseError(std::as_bytes(std::span(text)));
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_GT(read->message.size(), 100u);
    EXPECT_TRUE(error.message.starts_with(read->message));
  }
}

TEST(Protocol2Limits, AnErrorOfNoKnownSeverityIsMalformed) {
  const std::string text = R"({"code":"LATER","severity":"x","message":"no"})";
  EXPECT_EQ(FaultName(ParseError(std::as_bytes(std::span(text))).status()), "MALFORMED");
}

TEST(Protocol2Limits, AnErrorWithoutCodeSeverityOrMessageIsMalformed) {
  for (const std::string text : {R"({"severity":"request","message":"no"})", R"({"code":"LATER","message":"no"})",
                                 R"({"code":"LATER","severity":"request"})"}) {
    const Result<ErrorMessage> read = ParseError(std::as_bytes(std::span(text)));
    EXPECT_EQ(FaultName(read.status()), "MALFORMED");
    EXPECT_NE(read.status().message().find("is missing"), std::string::npos) << read.status().message();
  }
}

TEST(Protocol2Limits, AnEngineThatStandsStillSaysSoBehindSpecAndToWhoComesBack) {
  const std::unique_ptr<VectorEnv> world = (*worlds::FindWorld("road-v0"))->create(1);
  EnvServerOptions options;
  options.training_length = 1000;
  const std::unique_ptr<EnvServer> server = *EnvServer::Create(*world, *ListenTcp({"127.0.0.1", 0}), options);
  const auto tick = [&] {
    for (int i = 0; i < 20; ++i) (void)server->Poll(0.005);
  };
  const auto connect = [&] { return RawTrainer(*ConnectTcp({"127.0.0.1", server->port()}, 2.0)); };
  RawTrainer trainer = connect();
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  tick();
  Hello hello;
  hello.resume = ParseWelcome(trainer.Next().payload)->resume;
  server->SetPaused(true);
  trainer.Send(FrameType::kConfigure, 1, "{}");
  tick();
  EXPECT_EQ(trainer.Next().header.type, FrameType::kSpec);
  EXPECT_EQ(trainer.Next().header.type, FrameType::kPaused);
  server->SetPaused(false);
  EXPECT_EQ(trainer.Next().header.type, FrameType::kResumed);
  trainer.blocks = Blocks(world->spec());
  trainer.Send(FrameBytes(FrameType::kReset, 2, trainer.ResetPayload(1, {1})));
  tick();
  EXPECT_EQ(trainer.Next().header.type, FrameType::kResult);
  server->SetPaused(true);
  EXPECT_EQ(trainer.Next().header.type, FrameType::kPaused);
  trainer.transport().Close();
  RawTrainer again = connect();
  again.Send(FrameType::kHello, 0, EncodeHello(hello));
  tick();
  const Frame welcome = again.Next();
  ASSERT_EQ(welcome.header.type, FrameType::kWelcome);
  EXPECT_TRUE(ParseWelcome(welcome.payload)->resumed);
  EXPECT_EQ(again.Next().header.type, FrameType::kPaused);
  server->SetPaused(false);
  EXPECT_EQ(again.Next().header.type, FrameType::kResumed);
}

}  // namespace
}  // namespace consac
