// Group C of docs/faults.md: the meaning of what is sent, where it takes both ends. What the trainer's data watch finds
// is tested beside it (run/test/data_watch_test.cpp).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/faults/fault_peers.h"

namespace consac {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

TEST(FaultC, C4_AResultOfTheWrongSizeIsNamedWithBoth) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    std::vector<std::byte> payload = engine.ResultPayload();
    payload.resize(payload.size() - 8);
    engine.Send(FrameBytes(FrameType::kResult, engine.Next().header.request, payload));
    (void)engine.Next();
  });
  {
    Session session(engine.Connect(), Impatient(Way::kTcp));
    const Status status = session.Step();
    EXPECT_EQ(status.code(), StatusCode::kProtocol);
    EXPECT_THAT(status.message(), HasSubstr("R60"));
    EXPECT_THAT(status.message(), HasSubstr(std::to_string(engine.blocks.result_bytes)));
    EXPECT_THAT(status.message(), HasSubstr(std::to_string(engine.blocks.result_bytes - 8)));
  }
  peer.join();
}

class FaultCOverProtocol2 : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Each, FaultCOverProtocol2, ::testing::Values(Way::kTcp, Way::kShared), WayName);

TEST_P(FaultCOverProtocol2, C5_AnActionThatIsNoneIsRefusedAndTheWorldNotStepped) {
  const Engine engine({}, "pendulum-v1", 2);
  Session session(engine.Connect(), Impatient(GetParam()));
  ASSERT_TRUE(session.Step().ok());
  const std::int64_t before = engine.steps();
  const auto with = [&](float action) {
    reinterpret_cast<float*>(session.batch().actions)[1] = action;
    return session.client().Step({&session.batch(), 1}, MoreSteps::kYes);
  };
  const Status nan = with(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(nan.code(), StatusCode::kNonFinite);
  EXPECT_THAT(nan.message(), HasSubstr("slot 1"));
  const Status far = with(1e6f);
  EXPECT_EQ(far.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(far.message(), HasSubstr("1e+06, outside -2 to 2"));
  EXPECT_EQ(engine.steps(), before);
  const Status on = with(0.5f);
  EXPECT_TRUE(on.ok()) << on.message();
  EXPECT_EQ(engine.steps(), before + 2);
}

TEST(FaultC, C5_ATextActionOutsideItsBoundsIsClipped) {
  /// Rewards with the action it got.
  class Echo final : public PlainWorld {
   public:
    Echo() : PlainWorld(*Space::Box(0, 1, {1}), *Space::Box(-1, 1, {1})) {}
    void Step(std::span<Batch> batches) override {
      PlainWorld::Step(batches);
      batches[0].rewards[0] = *reinterpret_cast<const float*>(batches[0].actions);
    }
  };
  EnvServerOptions options;
  options.protocol = Protocol::kText1;
  const Engine engine(std::make_unique<Echo>(), options);
  const auto trainer = engine.Connect();
  ASSERT_TRUE(Say(*trainer, "7.5\n").ok());
  EXPECT_THAT(Listen(*trainer, 0.2), HasSubstr("\n0#1#0\n"));
  ASSERT_TRUE(Say(*trainer, "nan\n").ok());
  EXPECT_THAT(Listen(*trainer, 1.0), HasSubstr("error: action 'nan'"));
  EXPECT_EQ(engine.steps(), 1);
}

TEST(FaultC, C8_TextThatOnlyEndsIsAnErrorNotAnEndlessWait) {
  for (const bool at_once : {true, false}) {
    auto listener = *ListenTcp({"127.0.0.1", 0});
    auto near_end = *ConnectTcp({"127.0.0.1", listener->port()}, 2.0);
    auto far_end = *listener->Accept(2.0);
    std::string script = "D#3#0#B#2#0,0,40,40#100\n";
    if (!at_once) script += "10,20#0#0\n";
    for (int i = 0; i < 2000; ++i) script += "10,20#1#1\n";
    ASSERT_TRUE(Say(*far_end, script).ok());
    auto client = EnvClient::Open(std::move(near_end), Impatient(Way::kText1));
    ASSERT_TRUE(client.ok()) << client.status().message();
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    Status status = (*client)->Reset(0, {&buffer.batch(), 1});
    EXPECT_EQ(status.ok(), !at_once);
    if (status.ok()) status = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
    EXPECT_EQ(status.code(), StatusCode::kProtocol);
    EXPECT_THAT(status.message(), HasSubstr("1000 ends"));
  }
}

TEST(FaultC, C9_AnEpisodeMayBeTerminatedAndTruncatedAtOnce) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin();
    std::vector<std::byte> payload = engine.ResultPayload(kTerminated | kTruncated | kFinal | kFirst | kActive);
    const std::uint32_t parts = kPartFinals;
    std::memcpy(payload.data(), &parts, sizeof(parts));
    const float last[2] = {0.25f, 0.75f};
    payload.resize(payload.size() + sizeof(last));
    std::memcpy(payload.data() + engine.blocks.result_bytes, last, sizeof(last));
    engine.Send(FrameBytes(FrameType::kResult, engine.Next().header.request, payload));
    (void)engine.Next();
  });
  {
    Session session(engine.Connect(), Impatient(Way::kTcp));
    const Status status = session.Step();
    ASSERT_TRUE(status.ok()) << status.message();
    EXPECT_EQ(session.batch().terminated[0], 1);
    EXPECT_EQ(session.batch().truncated[0], 1);
    EXPECT_EQ(reinterpret_cast<const float*>(session.batch().final_observations)[1], 0.75f);
    EXPECT_EQ(reinterpret_cast<const float*>(session.batch().next_observations)[0], 0.5f);
  }
  peer.join();
}

TEST(FaultC, C15_InfosThatCannotBeReadAreNamed) {
  const std::string infos[] = {std::string(std::size_t{4} << 20, 'x'), "{\"infos\":{\"a\":\xff\xff}}", ""};
  for (const std::string& json : infos) {
    RawEngine engine;
    std::thread peer([&] {
      engine.Begin();
      std::vector<std::byte> payload = engine.ResultPayload();
      const std::uint32_t parts = kPartInfos;
      std::memcpy(payload.data(), &parts, sizeof(parts));
      const auto length = static_cast<std::uint32_t>(json.size());
      payload.resize(AlignBlock(engine.blocks.result_bytes + sizeof(length) + json.size()));
      std::memcpy(payload.data() + engine.blocks.result_bytes, &length, sizeof(length));
      std::memcpy(payload.data() + engine.blocks.result_bytes + sizeof(length), json.data(), json.size());
      engine.Send(FrameBytes(FrameType::kResult, engine.Next().header.request, payload));
      (void)engine.Next();
    });
    {
      EnvClientOptions patient = Impatient(Way::kTcp);
      patient.deadline_s = 5.0;
      Session session(engine.Connect(), patient);
      const Status status = session.Step();
      EXPECT_EQ(status.code(), StatusCode::kProtocol);
      EXPECT_THAT(status.message(), HasSubstr("R74"));
    }
    peer.join();
  }
}

// What forgets state 16 wholly offers no agent at all: the trainer waits for one as long as for an answer.
TEST(FaultC, C17_AnEngineThatForgetsWhoTakesPartIsToldSo) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin(false);
    for (Frame frame = engine.Next(); frame.header.type == FrameType::kReset || frame.header.type == FrameType::kStep;
         frame = engine.Next()) {
      std::vector<std::byte> payload(engine.blocks.result_bytes);
      engine.Send(FrameBytes(FrameType::kResult, frame.header.request, payload));
    }
  });
  {
    EnvClientOptions patient = Impatient(Way::kTcp);
    patient.deadline_s = 0.3;
    Session session(engine.Connect(), patient);
    Status status = Status::Ok();
    for (const double end = Now() + 5.0; status.ok() && Now() < end;) status = session.Step();
    EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded);
    EXPECT_THAT(status.message(), HasSubstr("state 16"));
  }
  peer.join();
}

TEST(FaultC, C17_AFirstObservationOfNobodyIsToldAtOnce) {
  RawEngine engine;
  std::thread peer([&] {
    engine.Begin(false);
    engine.Send(FrameBytes(FrameType::kResult, engine.Next().header.request, engine.ResultPayload(kFirst)));
    (void)engine.Next();
  });
  {
    auto client = EnvClient::Open(engine.Connect(), Impatient(Way::kTcp));
    ASSERT_TRUE(client.ok()) << client.status().message();
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    const Status status = (*client)->Reset(0, {&buffer.batch(), 1});
    EXPECT_EQ(status.code(), StatusCode::kProtocol);
    EXPECT_THAT(status.message(), HasSubstr("set 16 for every agent"));
  }
  peer.join();
}

TEST(FaultC, C16_NamesThatCannotBeToldApartAreRefused) {
  const Space leaf = *Space::Box(0, 1, {1});
  const auto dict = [&](std::vector<std::pair<std::string, Space>> children) {
    return Space::Dict(std::move(children));
  };
  EXPECT_FALSE(dict({{"a", leaf}, {"a", leaf}}).ok());
  const auto below = dict({{"b", leaf}});
  EXPECT_FALSE(dict({{"a/b", leaf}, {"a", *below}}).ok()) << "two leaves at a/b";
  EXPECT_FALSE(dict({{"a\nb", leaf}}).ok());
  EXPECT_FALSE(dict({{std::string(256, 'a'), leaf}}).ok());
  EXPECT_FALSE(dict({{"", leaf}}).ok());
  EXPECT_TRUE(dict({{std::string(255, 'a'), leaf}}).ok());
  EXPECT_TRUE(dict({{"a/b", leaf}, {"a", leaf}}).ok()) << "a separator alone does no harm";
}

TEST(FaultC, C16_NamesOfAnyScriptArriveAsTheyWere) {
  const Space space = *Space::Dict({{"kõrgus", *Space::Box(0, 1, {1})}, {"高さ", *Space::Box(0, 1, {2})}});
  const Engine engine(std::make_unique<PlainWorld>(space, *Space::Discrete(2)), {});
  Session session(engine.Connect(), Impatient(Way::kTcp));
  ASSERT_TRUE(session.Step().ok());
  EXPECT_EQ(session.client().spec().behaviours[0].observation_space, space);
  EXPECT_EQ(session.client().spec().behaviours[0].observation_layout.leaves[1].name, "高さ");
}

/// Masks every action after some steps.
class MaskingWorld final : public PlainWorld {
 public:
  MaskingWorld() : PlainWorld(*Space::Box(0, 1, {1}), *Space::Discrete(2), 2) {
    spec().behaviours[0].masks_actions = true;
  }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    PlainWorld::Reset(seed, batches);
    std::memset(batches[0].next_action_masks, 1, 4);
  }
  void Step(std::span<Batch> batches) override {
    PlainWorld::Step(batches);
    std::memset(batches[0].next_action_masks, 1, 4);
    if (++steps_ == 3) std::memset(batches[0].next_action_masks + 2, 0, 2);
  }

 private:
  int steps_ = 0;
};

// The designer reads the engine's log, not the trainer's.
TEST(FaultC, C7_AWorldWithoutALegalActionIsToldInTheEnginesLog) {
  LogLines log;
  {
    const Engine engine(std::make_unique<MaskingWorld>(), {});
    Session session(engine.Connect(), Impatient(Way::kTcp));
    for (int i = 0; i < 5; ++i) (void)session.Step();
  }
  EXPECT_THAT(log.lines(), Contains(::testing::AllOf(HasSubstr("environment 1"), HasSubstr("no legal action"))));
}

}  // namespace
}  // namespace consac
