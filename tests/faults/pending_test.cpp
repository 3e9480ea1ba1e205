// Rows of docs/faults.md that did not hold when their tests were written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>

#include "tests/faults/ticking_engine.h"

namespace consac {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

// Each byte comes in time, the frame does not: as slow as a trainer that is gone.
TEST(FaultA, A5_AStepThatTricklesIsClosedAtTheDeadline) {
  EnvServerOptions options;
  options.deadline_s = 0.4;
  const Engine engine(options);
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  const std::vector<int> all(kCopies, 1);
  trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, all));
  const std::vector<std::byte> step = FrameBytes(FrameType::kStep, 3, trainer.StepPayload({0, 0, 0, 0}, all));
  const double start = Now();
  EXPECT_LT(Trickle(trainer.transport(), step, 0.03, [&] { return Now() - start > 1.5; }), step.size());
  EXPECT_LT(Now() - start, 1.5);
  EXPECT_EQ(engine.steps(), 0);
}

class FaultAHalfOpen : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Each, FaultAHalfOpen, ::testing::Values(Way::kTcp, Way::kShared), WayName);

// The trainer knows that its connection is gone; the engine cannot know yet. Whoever has the token is the trainer.
TEST_P(FaultAHalfOpen, A9_AHalfOpenConnectionIsReplacedByItsTrainersToken) {
  const Engine engine;
  RawTrainer stale(engine.Connect());
  if (GetParam() == Way::kShared) {
    Hello hello;
    hello.capabilities = {"shm"};
    stale.Send(FrameType::kHello, 0, EncodeHello(hello));
    const Frame welcome = stale.Next();
    ASSERT_EQ(welcome.header.type, FrameType::kWelcome);
    stale.resume = ParseWelcome(welcome.payload)->resume;
    stale.Send(FrameType::kConfigure, 1, R"({"transport":"shm"})");
    ASSERT_EQ(stale.Next().header.type, FrameType::kSpec);
    stale.blocks = Blocks(engine.spec());
  } else {
    stale.Begin(engine.spec());
  }
  const std::vector<int> all(kCopies, 1);
  stale.Ask(FrameType::kReset, 2, stale.ResetPayload(1, all));
  const std::vector<std::byte> step = stale.StepPayload({0, 1, 0, 1}, all);
  const std::vector<std::byte> answer = stale.Ask(FrameType::kStep, 3, step);
  RawTrainer again(engine.Connect());
  ASSERT_EQ(ResumeAnswer(again, stale.resume), "WELCOME");
  again.blocks = stale.blocks;
  EXPECT_EQ(again.Ask(FrameType::kStep, 3, step), answer) << "repeated, not carried out again";
  again.Ask(FrameType::kStep, 4, step);
  EXPECT_EQ(again.last_type, FrameType::kResult);
  EXPECT_EQ(engine.steps(), 2 * kCopies);
  std::byte rest[64];
  EXPECT_TRUE(Soon([&] { return !stale.transport().Read(rest, 0.01).ok(); })) << "the old connection is closed";
  RawTrainer stranger(engine.Connect());
  std::string foreign = stale.resume;
  foreign.back() = foreign.back() == '0' ? '1' : '0';
  EXPECT_NE(ResumeAnswer(stranger, foreign), "WELCOME");
  again.Ask(FrameType::kStep, 5, step);
  EXPECT_EQ(again.last_type, FrameType::kResult) << "a stranger replaces nobody";
}

/// As FaultAGreedy of connection_test.cpp, with an engine that lives in its host's ticks.
class FaultAGreedyTick : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Each, FaultAGreedyTick, ::testing::Values(Way::kText1, Way::kTcp), WayName);

TEST_P(FaultAGreedyTick, A10_ATrainerThatReadsNothingNeverHoldsTheTick) {
  EnvServerOptions options;
  options.write_s = 1.5;
  options.grace_s = 0.05;
  const TickingEngine engine(LargeWorld(GetParam()), options);
  const auto greedy = engine.Connect();
  AskForMuch(*greedy, GetParam(), engine.spec());
  ASSERT_TRUE(Soon([&] { return engine.steps() > 0; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  EXPECT_LT(engine.longest_tick_s(), 0.5);
  EXPECT_TRUE(Soon([&] { return engine.broken() == 1; })) << "dropped at the write deadline";
  EXPECT_LT(engine.longest_tick_s(), 0.5);
}

// A trainer that learns says nothing; a pause of its engine is not its silence.
TEST(FaultA, A11_APauseOfTheEngineStopsItsOwnDeadlineToo) {
  EnvServerOptions options;
  options.deadline_s = 0.4;
  TickingEngine engine((*worlds::FindWorld("road-v0"))->create(1), options);
  Session session(engine.Connect(), Impatient(Way::kTcp));
  ASSERT_TRUE(session.Step().ok());
  engine.PauseFor(1.0);
  ASSERT_TRUE(Soon([&] { return !engine.pausing(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const Status status = session.Step();
  EXPECT_TRUE(status.ok()) << status.message();
}

// spec/protocol2.md, GOAWAY: the request under way is answered, then the server closes within 2 s.
TEST(FaultA, A18_TheStepUnderWayIsAnsweredBeforeTheEngineGoes) {
  EnvServerOptions options;
  options.min_step_s = 10.0;
  Engine engine(options);
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  const std::vector<int> all(kCopies, 1);
  trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, all));
  const std::vector<std::byte> step = trainer.StepPayload({0, 0, 0, 0}, all);
  trainer.Ask(FrameType::kStep, 3, step);
  trainer.Send(FrameBytes(FrameType::kStep, 4, step));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const double start = Now();
  std::thread stopping([&] { engine.Stop(); });
  bool answered = false, goaway = false;
  for (Frame frame = trainer.Next(); static_cast<int>(frame.header.type) != 0; frame = trainer.Next()) {
    const bool answer = frame.header.type == FrameType::kResult || frame.header.type == FrameType::kError;
    answered = answered || (answer && frame.header.request == 4);
    goaway = goaway || frame.header.type == FrameType::kGoAway;
  }
  EXPECT_LT(Now() - start, 2.0);
  EXPECT_TRUE(goaway);
  EXPECT_TRUE(answered);
  stopping.join();
}

// MALFORMED is one of the specification's connection errors: after it the server closes.
TEST(FaultB, B11_MalformedJsonEndsTheConnectionAsTheSpecificationSays) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  ASSERT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  trainer.Send(FrameType::kConfigure, 1, "{\"autoreset\":");
  const Frame answer = trainer.Next();
  ASSERT_EQ(answer.header.type, FrameType::kError);
  const auto error = ParseError(answer.payload);
  EXPECT_EQ(error->code, "MALFORMED");
  EXPECT_TRUE(error->ends_connection);
  EXPECT_EQ(static_cast<int>(trainer.Next().header.type), 0) << "closed";
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
  static std::mutex guard;
  static std::vector<std::string> lines;
  Hooks hooks;
  hooks.log = [](void*, LogLevel level, std::string_view line) {
    const std::lock_guard lock(guard);
    if (level >= LogLevel::kWarning) lines.emplace_back(line);
  };
  SetHooks(hooks);
  {
    const Engine engine(std::make_unique<MaskingWorld>(), {});
    Session session(engine.Connect(), Impatient(Way::kTcp));
    for (int i = 0; i < 5; ++i) (void)session.Step();
  }
  SetHooks({});
  EXPECT_THAT(lines, Contains(::testing::AllOf(HasSubstr("environment 1"), HasSubstr("no legal action"))));
}

}  // namespace
}  // namespace consac
