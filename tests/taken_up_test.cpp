// A session that is taken up over a new connection has the capabilities that it began with (R27, R28), at either end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "consac/env/buffer.h"
#include "tests/protocol2_peers.h"
#include "tests/rich_env.h"

namespace consac {
namespace {

using namespace testing;
using ::testing::HasSubstr;

Hello Naming(std::vector<std::string> capabilities, std::string resume = {}) {
  Hello hello;
  hello.capabilities = std::move(capabilities);
  hello.resume = std::move(resume);
  return hello;
}

TEST(TakenUp, WhoNamesFewerCapabilitiesIsToldWhichAndTheSessionsConnectionStays) {
  const Engine engine(std::make_unique<RichEnv>(2), {});
  RawTrainer trainer(engine.Connect());
  trainer.blocks = Blocks(engine.spec());
  trainer.Send(FrameType::kHello, 0, EncodeHello(Naming({"parameters", "statistics"})));
  const std::string resume = ParseWelcome(trainer.Next().payload)->resume;
  trainer.Send(FrameType::kConfigure, 1, "{}");
  ASSERT_EQ(trainer.Next().header.type, FrameType::kSpec);
  trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(3, {1, 1}));

  RawTrainer second(engine.Connect());
  second.Send(FrameType::kHello, 0, EncodeHello(Naming({"statistics", "groups"}, resume)));
  const Frame refusal = second.Next();
  ASSERT_EQ(refusal.header.type, FrameType::kError);
  const Result<ErrorMessage> why = ParseError(refusal.payload);
  EXPECT_EQ(why->code, "AUTH_FAILED");
  EXPECT_THAT(why->message, HasSubstr("has the capability 'parameters', which this HELLO does not name"));

  const std::vector<std::byte> step = trainer.StepPayload({0, 0, 0, 0}, {1, 1});
  const std::vector<std::byte> answer = trainer.Ask(FrameType::kStep, 3, step);
  EXPECT_EQ(trainer.last_type, FrameType::kResult) << "the connection that stands goes on";

  RawTrainer third(engine.Connect());
  third.Send(FrameType::kHello, 0, EncodeHello(Naming({"statistics", "groups", "parameters"}, resume)));
  const Result<Welcome> welcome = ParseWelcome(third.Next().payload);
  ASSERT_TRUE(welcome.ok());
  EXPECT_TRUE(welcome->resumed);
  EXPECT_EQ(LackingCapability(welcome->capabilities, std::vector<std::string>{"parameters", "statistics"}), "");
  EXPECT_FALSE(HasCapability(welcome->capabilities, "groups")) << "which CONFIGURE did not know of";
  EXPECT_EQ(third.Ask(FrameType::kStep, 3, step), answer);
}

/// A trainer whose session is taken up with capabilities of the engine's choice; why it ends, "" where it goes on.
std::string TakenUpWith(std::vector<std::string> began, std::vector<std::string> goes_on) {
  RawEngine engine;
  engine.message.env.parameters = {{"speed", 1.0, 0.0, 10.0}};
  Welcome welcome;
  welcome.session = 1;
  welcome.resume = "of this session";
  welcome.capabilities = std::move(began);
  std::string left = "nothing";
  std::thread serving([&] {
    ASSERT_TRUE(engine.Accept());
    EXPECT_EQ(engine.Next().header.type, FrameType::kHello);
    engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    EXPECT_EQ(engine.Next().header.type, FrameType::kConfigure);
    engine.Send(FrameType::kSpec, 1, EncodeSpec(engine.message));
    EXPECT_EQ(engine.Next().header.type, FrameType::kReset);
    engine.Close();
    ASSERT_TRUE(engine.Accept());
    const Frame hello = engine.Next();
    EXPECT_EQ(LackingCapability(ParseHello(hello.payload)->capabilities, welcome.capabilities), "") << "R27";
    welcome.capabilities = std::move(goes_on);
    welcome.resumed = true;
    welcome.last_request = 2;
    engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    const Frame next = engine.Next();
    left = next.header.type == FrameType::kBye ? "BYE" : next.header.type == FrameType::kReset ? "RESET" : "else";
    engine.Send(FrameBytes(FrameType::kResult, 2, engine.ResultPayload(kFirst | kActive)));
  });
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  options.reconnect = [&] { return ConnectTcp({"127.0.0.1", engine.port()}, 2.0); };
  auto client = EnvClient::Open(engine.Connect(), options);
  EXPECT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  const Status reset = (*client)->Reset(1, {&buffer.batch(), 1});
  if (!reset.ok()) (*client)->Close();
  serving.join();
  EXPECT_EQ(left, reset.ok() ? "RESET" : "BYE") << reset.message();
  return reset.ok() ? "" : std::string(reset.message());
}

TEST(TakenUp, ATrainerEndsWhereItsSessionComesBackWithOtherCapabilities) {
  EXPECT_THAT(TakenUpWith({"parameters"}, {}),
              HasSubstr("takes session 1 up without capability 'parameters', which it has (R28)"));
  EXPECT_THAT(TakenUpWith({"parameters"}, {"statistics", "parameters"}),
              HasSubstr("takes session 1 up with capability 'statistics', which it has not (R28)"));
  EXPECT_EQ(TakenUpWith({"parameters", "statistics"}, {"statistics", "parameters", "statistics"}), "");
}

}  // namespace
}  // namespace consac
