// What a world may send wrong, one fault at a time (docs/faults.md, group C), and that a clean world is not accused.
#include "data_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>

#include "consac/base/hooks.h"
#include "consac/env/buffer.h"
#include "session.h"
#include "small_run.h"

namespace consac::run {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Keeps what is logged while it lives.
class LogCatcher {
 public:
  LogCatcher() {
    Hooks hooks;
    hooks.log = [](void* user, LogLevel level, std::string_view line) {
      if (level == LogLevel::kWarning) static_cast<LogCatcher*>(user)->lines.emplace_back(line);
    };
    hooks.user = this;
    SetHooks(hooks);
  }
  ~LogCatcher() { SetHooks({}); }
  std::vector<std::string> lines;
};

/// Two environments with two agents each; arm (2 joints from -1 to 1, and one open), a mode of 3.
BehaviourSpec Arms() {
  BehaviourSpec behaviour =
      BehaviourSpec::Of("arm",
                        *Space::Dict({{"joints", *Space::Box({-1, -1, -kInfinity}, {1, 2, kInfinity}, {3})},
                                      {"mode", *Space::Discrete(3)}}),
                        *Space::Discrete(2), 4);
  behaviour.agents = {"left", "right"};
  return behaviour;
}

/// A watch of Arms and a batch of all their slots that a step has just filled with good values, different each time.
class Watched {
 public:
  explicit Watched(DataWatchOptions options = {}) : watch(behaviour_, options), buffer_(behaviour_) {
    Fill();
    EXPECT_TRUE(watch.Begin(batch()).ok());
  }
  Batch& batch() { return buffer_.batch(); }
  void Fill() {
    for (std::size_t slot = 0; slot < 4; ++slot) {
      for (std::byte* rows : {batch().next_observations, batch().final_observations})
        Write(rows, slot, {count_, -0.5f, 1e30f});
      batch().rewards[slot] = 1.0f;
      batch().terminated[slot] = batch().truncated[slot] = 0;
    }
    count_ += 1e-6f;
  }
  void Advance() {
    buffer_.Advance();
    Fill();
  }
  Status Next() {
    Advance();
    return watch.Check(batch());
  }
  float* Joints(std::byte* rows, std::size_t slot) {
    return reinterpret_cast<float*>(rows + slot * behaviour_.observation_layout.row_bytes);
  }
  void Write(std::byte* rows, std::size_t slot, std::array<float, 3> joints) {
    std::memcpy(Joints(rows, slot), joints.data(), sizeof(joints));
  }
  const Layout& layout() const { return behaviour_.observation_layout; }

 private:
  const BehaviourSpec behaviour_ = Arms();

 public:
  DataWatch watch;

 private:
  BatchBuffer buffer_;
  float count_ = 0.0f;
};

DataWatchOptions Replacing() {
  DataWatchOptions options;
  options.non_finite = NonFinite::kReplace;
  return options;
}

TEST(DataWatch, CleanDataIsNotAccused) {
  LogCatcher log;
  Watched watched;
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(watched.Next().ok());
  EXPECT_THAT(log.lines, IsEmpty());
  EXPECT_EQ(watched.watch.Summary(), "");
}

TEST(DataWatch, ANumberThatIsNoneIsNamedWithEnvironmentStepLeafAndElement) {
  for (const float bad : {kNaN, std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
    Watched watched;
    ASSERT_TRUE(watched.Next().ok());
    ASSERT_TRUE(watched.Next().ok());
    watched.Joints(watched.batch().next_observations, 3)[2] = bad;
    const Status status = watched.watch.Check(watched.batch());
    EXPECT_EQ(status.code(), StatusCode::kNonFinite);
    EXPECT_THAT(status.message(),
                AllOf(HasSubstr("'arm'"), HasSubstr("environment 1"), HasSubstr("agent 'right'"), HasSubstr("step 3"),
                      HasSubstr("'joints'"), HasSubstr("element 2"), HasSubstr(bad != bad ? "nan" : "inf")));
  }
}

TEST(DataWatch, FirstAndFinalObservationsAndRewardsAreLookedAtToo) {
  Watched first;
  first.Joints(first.batch().next_observations, 0)[0] = kNaN;
  EXPECT_THAT(first.watch.Begin(first.batch()).message(), AllOf(HasSubstr("first observation"), HasSubstr("reset")));
  Watched last;
  last.Joints(last.batch().final_observations, 1)[0] = kNaN;
  EXPECT_TRUE(last.watch.Check(last.batch()).ok()) << "no episode has ended: that row means nothing";
  last.batch().truncated[1] = 1;
  EXPECT_THAT(last.watch.Check(last.batch()).message(), HasSubstr("final observation"));
  Watched reward;
  reward.batch().rewards[2] = kNaN;
  EXPECT_THAT(reward.watch.Check(reward.batch()).message(),
              AllOf(HasSubstr("reward is nan"), HasSubstr("environment 1")));
}

TEST(DataWatch, ReplacingTakesTheBoundOfThatSideOrZeroAndCounts) {
  LogCatcher log;
  Watched watched(Replacing());
  const auto infinity = std::numeric_limits<float>::infinity();
  watched.Write(watched.batch().next_observations, 0, {kNaN, infinity, infinity});
  watched.Write(watched.batch().next_observations, 1, {-infinity, 0.5f, -infinity});
  watched.batch().rewards[3] = infinity;
  ASSERT_TRUE(watched.watch.Check(watched.batch()).ok());
  const float* row = watched.Joints(watched.batch().next_observations, 0);
  EXPECT_EQ((std::vector<float>{row[0], row[1], row[2]}), (std::vector<float>{0, 2, 0}));
  row = watched.Joints(watched.batch().next_observations, 1);
  EXPECT_EQ((std::vector<float>{row[0], row[1], row[2]}), (std::vector<float>{-1, 0.5f, 0}));
  EXPECT_EQ(watched.batch().rewards[3], 0.0f);
  EXPECT_EQ(watched.watch.replaced(), 6);
  EXPECT_EQ(watched.watch.Summary(), "6 numbers replaced");
  ASSERT_THAT(log.lines, SizeIs(1)) << "one line, not one for each";
}

// Learners and models hold float32: a number beyond it is an infinity to them.
TEST(DataWatch, ADoubleBeyondFloat32IsTreatedAsAnInfinityIs) {
  LogCatcher log;
  const BehaviourSpec behaviour = BehaviourSpec::Of(
      "default", *Space::Box({-kInfinity, -1e308}, {kInfinity, 5.0}, {2}, DType::kF64), *Space::Discrete(2), 1);
  BatchBuffer buffer(behaviour);
  const double row[2] = {1e300, -1e300};
  std::memcpy(buffer.batch().next_observations, row, sizeof(row));
  DataWatch strict(behaviour, {});
  const Status status = strict.Begin(buffer.batch());
  EXPECT_EQ(status.code(), StatusCode::kNonFinite);
  EXPECT_THAT(status.message(), HasSubstr("element 0, is 1e+300"));
  DataWatch mending(behaviour, Replacing());
  ASSERT_TRUE(mending.Begin(buffer.batch()).ok());
  const auto* mended = reinterpret_cast<const double*>(buffer.batch().next_observations);
  EXPECT_EQ(mended[0], 0.0);
  EXPECT_EQ(mended[1], 0.0) << "a bound that is beyond float32 too is none";
}

TEST(DataWatch, ARewardBeyondItsLimitIsAnErrorOrCutToIt) {
  DataWatchOptions options;
  options.max_abs_reward = 100.0;
  Watched strict(options);
  strict.batch().rewards[1] = -100.0f;
  ASSERT_TRUE(strict.watch.Check(strict.batch()).ok());
  strict.batch().rewards[1] = -100.5f;
  const Status status = strict.watch.Check(strict.batch());
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("-100.5"), HasSubstr("max_abs_reward = 100"), HasSubstr("step 2")));
  options.non_finite = NonFinite::kReplace;
  Watched cut(options);
  cut.batch().rewards[1] = -1e6f;
  ASSERT_TRUE(cut.watch.Check(cut.batch()).ok());
  EXPECT_EQ(cut.batch().rewards[1], -100.0f);
}

TEST(DataWatch, ValuesOutsideTheirBoundsAreCountedAndSaidOncePerLeaf) {
  LogCatcher log;
  Watched watched;
  for (int i = 0; i < 5; ++i) {
    watched.Fill();
    watched.Joints(watched.batch().next_observations, 2)[1] = 7.0f;
    ASSERT_TRUE(watched.watch.Check(watched.batch()).ok());
    EXPECT_EQ(watched.Joints(watched.batch().next_observations, 2)[1], 7.0f) << "it is learned from as it is";
  }
  EXPECT_EQ(watched.watch.outside(), 5);
  ASSERT_THAT(log.lines, SizeIs(1));
  EXPECT_THAT(log.lines[0], AllOf(HasSubstr("'joints', element 1, is 7"), HasSubstr("-1 to 2")));
}

TEST(DataWatch, AChoiceThatDoesNotExistIsAnError) {
  Watched watched;
  WriteElement(watched.layout().leaves[1], watched.batch().next_observations, 0, 3);
  const Status status = watched.watch.Check(watched.batch());
  EXPECT_EQ(status.code(), StatusCode::kProtocol);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("'mode'"), HasSubstr("is 3"), HasSubstr("from 0 to 2")));
}

TEST(DataWatch, AChoiceWithoutALegalActionIsAnError) {
  BehaviourSpec behaviour = BehaviourSpec::Of("default", *Space::Box(0, 1, {1}), *Space::MultiDiscrete({2, 3}), 2);
  behaviour.masks_actions = true;
  DataWatch watch(behaviour, {});
  BatchBuffer buffer(behaviour);
  std::uint8_t* masks = buffer.batch().next_action_masks;
  const std::uint8_t legal[] = {1, 0, 0, 0, 1, 0, 1, 1, 1, 1};
  std::memcpy(masks, legal, sizeof(legal));
  EXPECT_TRUE(watch.Begin(buffer.batch()).ok());
  EXPECT_TRUE(watch.Check(buffer.batch()).ok());
  masks[4] = 0;
  const Status status = watch.Check(buffer.batch());
  EXPECT_EQ(status.code(), StatusCode::kProtocol);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("environment 0"), HasSubstr("choice 1"), HasSubstr("step 2")));
  EXPECT_FALSE(watch.Begin(buffer.batch()).ok());
}

TEST(DataWatch, TheMaskOfAnAgentThatDoesNotGoOnMeansNothing) {
  BehaviourSpec behaviour = BehaviourSpec::Of("default", *Space::Box(0, 1, {1}), *Space::Discrete(2), 2);
  behaviour.masks_actions = true;
  DataWatch watch(behaviour, {});
  BatchBuffer buffer(behaviour);
  const std::uint8_t legal[] = {1, 0, 0, 0};
  std::memcpy(buffer.batch().next_action_masks, legal, sizeof(legal));
  EXPECT_TRUE(watch.Check(buffer.batch(), std::array<std::uint8_t, 2>{1, 0}).ok());
  EXPECT_THAT(watch.Check(buffer.batch(), std::array<std::uint8_t, 2>{0, 1}).message(), HasSubstr("environment 1"));
  EXPECT_THAT(watch.Check(buffer.batch()).message(), HasSubstr("environment 1"));
}

TEST(DataWatch, AnObservationThatStandsStillIsSaidOnce) {
  LogCatcher log;
  Watched watched;
  for (int i = 0; i < 2500; ++i) {
    watched.Advance();
    watched.Write(watched.batch().next_observations, 1, {0, 0, 0});
    if (i == 500) watched.Write(watched.batch().next_observations, 1, {0.5f, 0, 0});
    ASSERT_TRUE(watched.watch.Check(watched.batch()).ok());
    if (i == 1000) {
      EXPECT_THAT(log.lines, IsEmpty()) << "it moved in between";
    }
  }
  ASSERT_THAT(log.lines, SizeIs(1));
  EXPECT_THAT(log.lines[0], AllOf(HasSubstr("has not changed for 1000 steps"), HasSubstr("environment 0"),
                                  HasSubstr("agent 'right'")));
}

// One behaviour without agents of many kinds, for what concerns episodes.
class Episodes {
 public:
  explicit Episodes(DataWatchOptions options) : watch_(behaviour_, options), buffer_(behaviour_) {
    *reinterpret_cast<float*>(buffer_.batch().next_observations) = 0.0f;
    EXPECT_TRUE(watch_.Begin(buffer_.batch()).ok());
  }
  Status Step(bool ends) {
    buffer_.Advance();
    *reinterpret_cast<float*>(buffer_.batch().next_observations) =
        1.0f - *reinterpret_cast<float*>(buffer_.batch().observations);
    *reinterpret_cast<float*>(buffer_.batch().final_observations) = 0.0f;
    buffer_.batch().rewards[0] = 0.0f;
    buffer_.batch().terminated[0] = ends ? 1 : 0;
    buffer_.batch().truncated[0] = 0;
    return watch_.Check(buffer_.batch());
  }

 private:
  const BehaviourSpec behaviour_ = BehaviourSpec::Of("default", *Space::Box(0, 1, {1}), *Space::Discrete(2), 1);
  DataWatch watch_;
  BatchBuffer buffer_;
};

TEST(DataWatch, EpisodesThatEndAtOnceAreSaidAndThenAnError) {
  LogCatcher log;
  Episodes episodes({});
  for (int i = 0; i < 999; ++i) ASSERT_TRUE(episodes.Step(true).ok());
  ASSERT_TRUE(episodes.Step(false).ok());
  ASSERT_TRUE(episodes.Step(true).ok());  // an episode of two: counted anew
  for (int i = 0; i < 999; ++i) ASSERT_TRUE(episodes.Step(true).ok());
  EXPECT_THAT(log.lines, IsEmpty());
  for (int i = 999; i < 9999; ++i) ASSERT_TRUE(episodes.Step(true).ok()) << i;
  ASSERT_THAT(log.lines, SizeIs(1));
  EXPECT_THAT(log.lines[0], HasSubstr("1000 episodes in a row ended with their first step"));
  EXPECT_THAT(episodes.Step(true).message(), AllOf(HasSubstr("10000 episodes"), HasSubstr("one_step_episodes")));
}

TEST(DataWatch, EpisodesOfOneStepMayBeMeant) {
  LogCatcher log;
  EnvSpec spec;
  spec.max_episode_steps = 1;
  RunConfig config;
  EXPECT_TRUE(DataWatchOptions::Of(config, spec).one_step_episodes);
  config.one_step_episodes = true;
  spec.max_episode_steps = 0;
  Episodes episodes(DataWatchOptions::Of(config, spec));
  for (int i = 0; i < 11000; ++i) ASSERT_TRUE(episodes.Step(true).ok());
  EXPECT_THAT(log.lines, IsEmpty());
}

TEST(DataWatch, AnEpisodeThatOutlastsItsPromiseIsSaidOnce) {
  LogCatcher log;
  DataWatchOptions options;
  options.max_episode_steps = 20;
  Episodes episodes(options);
  for (int i = 1; i <= 20; ++i) ASSERT_TRUE(episodes.Step(i == 20).ok());
  for (int i = 1; i <= 20; ++i) ASSERT_TRUE(episodes.Step(false).ok());
  EXPECT_THAT(log.lines, IsEmpty());
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(episodes.Step(false).ok());
  ASSERT_THAT(log.lines, SizeIs(1));
  EXPECT_THAT(log.lines[0], AllOf(HasSubstr("after 20 steps"), HasSubstr("promised")));
}

TEST(DataWatch, AnEpisodeThatNeverEndsIsSaidWhereNothingWasPromised) {
  LogCatcher log;
  Episodes episodes({});
  for (int i = 0; i < 100'000; ++i) ASSERT_TRUE(episodes.Step(false).ok());
  EXPECT_THAT(log.lines, IsEmpty());
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(episodes.Step(false).ok());
  ASSERT_THAT(log.lines, SizeIs(1));
  EXPECT_THAT(log.lines[0], HasSubstr("has not ended after 100000 steps"));
}

TEST(DataWatch, AllocatesNothingPerStep) {
  Watched watched;
  ASSERT_TRUE(watched.Next().ok());
  const std::int64_t before = consac::testing::AllocationCount();
  for (int i = 0; i < 100; ++i) (void)watched.Next();
  EXPECT_EQ(consac::testing::AllocationCount(), before);
}

/// The road, whose rewards turn into NaN after some steps.
class BrokenRoad final : public VectorEnv {
 public:
  const EnvSpec& spec() const override { return road_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { road_->Reset(seed, batches); }
  void Step(std::span<Batch> batches) override {
    road_->Step(batches);
    if (++steps_ % 50 != 0) return;
    batches[0].rewards[0] = kNaN;
    reinterpret_cast<float*>(batches[0].next_observations)[1] = kNaN;
  }
  void Visit(Archive& archive) override { archive("road", *road_); }

 private:
  std::unique_ptr<VectorEnv> road_ = (*worlds::FindWorld("road-v0"))->create(1);
  int steps_ = 0;
};

class TrainingWithBrokenData : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Each, TrainingWithBrokenData, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "OverProtocol2" : "InProcess"; });

// The whole way: a run ends with the name of the number and keeps what was learned, or goes on without it.
TEST_P(TrainingWithBrokenData, EndsOrGoesOnAsItWasToldTo) {
  LogCatcher log;
  for (const char* policy : {"error", "replace"}) {
    consac::testing::ScratchFolder scratch("broken");
    RunConfig config = SmallRun(scratch.path(), policy);
    config.steps = 200;
    config.non_finite = policy;
    Result<RunSummary> summary = RunSummary{};
    if (GetParam()) {
      BrokenRoad road;
      EnvServerOptions options;
      options.training_length = 200;
      auto server = *EnvServer::Create(road, *ListenTcp({"127.0.0.1", 0}), options);
      config.world = "tcp://127.0.0.1:" + std::to_string(server->port());
      config.protocol = "2";
      std::atomic<bool> over{false};
      std::thread engine([&] { (void)server->ServeSession(over); });
      summary = Train(config, kNeverStop);
      over = true;
      engine.join();
    } else {
      summary = RunSession(config, Length::kOfCaller, Only(MakeLocalLink(std::make_unique<BrokenRoad>())), kNeverStop);
    }
    if (config.non_finite == "replace") {
      ASSERT_TRUE(summary.ok()) << summary.status().message();
      EXPECT_EQ(summary->steps, 200);
    } else {
      EXPECT_EQ(summary.status().code(), StatusCode::kNonFinite);
      EXPECT_THAT(summary.status().message(), AllOf(HasSubstr("step 50"), HasSubstr("element 1")));
    }
    EXPECT_TRUE(Policy::Load(scratch.path() + "/" + policy + "/model.consac").ok());
  }
  EXPECT_THAT(log.lines, SizeIs(1));
}

}  // namespace
}  // namespace consac::run
