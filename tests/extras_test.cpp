// Parameters, statistics and groups of protocol 2 (spec/protocol2.md, sections 14 to 16): both ends against each other,
// and a run that sets the one and logs the other.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "run/test/report/files.h"
#include "run/test/small_run.h"
#include "tests/protocol2_peers.h"
#include "tests/rich_env.h"

namespace consac {
namespace {

using namespace testing;
using run::RunConfig;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kAsItIs = std::numeric_limits<double>::quiet_NaN();

/// A session with a RichEnv of one world, what its left agent sees, and no step taken yet.
struct RichSession {
  explicit RichSession(bool shared_memory = false, std::int32_t copies = 1)
      : engine(std::make_unique<RichEnv>(copies), {}) {
    EnvClientOptions options;
    options.protocol = Protocol::kProtocol2;
    options.shared_memory = shared_memory;
    auto opened = EnvClient::Open(engine.Connect(), options);
    EXPECT_TRUE(opened.ok()) << opened.status().message();
    client = std::move(*opened);
    buffer = std::make_unique<BatchBuffer>(client->spec().behaviours[0]);
  }
  void Reset() { ASSERT_TRUE(client->Reset(1, {&buffer->batch(), 1}).ok()); }
  void Set(double speed, std::int32_t world = 0) {
    const double values[2] = {speed, kAsItIs};
    client->SetParameters(world, values);
  }
  float At(std::size_t slot = 0) const {
    float at = 0.0f;
    std::memcpy(&at, buffer->batch().next_observations + slot * sizeof(at), sizeof(at));
    return at;
  }
  float Step(std::size_t slot = 0) {
    buffer->Advance();
    const Status stepped = client->Step({&buffer->batch(), 1}, MoreSteps::kYes);
    EXPECT_TRUE(stepped.ok()) << stepped.message();
    return At(slot);
  }
  Engine engine;
  std::unique_ptr<EnvClient> client;
  std::unique_ptr<BatchBuffer> buffer;
};

class ExtrasEitherWay : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Each, ExtrasEitherWay, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "Shared" : "Tcp"; });

TEST_P(ExtrasEitherWay, AnEpisodeHasWhatWasSetWhenItBegan) {
  RichSession session(GetParam());
  ASSERT_EQ(session.client->spec().parameters.size(), 2u);
  EXPECT_EQ(session.client->spec().parameters[0].description, "m in a step");
  EXPECT_EQ(session.client->spec().parameters[1].high, std::numeric_limits<double>::infinity());
  session.Set(2.0);
  session.Reset();
  EXPECT_EQ(session.Step(), 2.0f);
  session.Set(3.0);
  EXPECT_EQ(session.Step(), 4.0f) << "the episode under way hears nothing of it";
  for (int i = 0; i < 4; ++i) session.Step();
  EXPECT_EQ(session.Step(), 0.0f) << "the next one has begun by itself";
  EXPECT_EQ(session.Step(), 3.0f);
  session.Reset();
  EXPECT_EQ(session.Step(), 3.0f) << "it holds until it is set anew";
}

TEST_P(ExtrasEitherWay, EachEnvironmentHasItsOwn) {
  RichSession session(GetParam(), 3);
  session.Set(5.0, 1);
  session.Reset();
  session.Step();
  EXPECT_EQ(session.At(0), 1.0f);
  EXPECT_EQ(session.At(2), 5.0f);
  EXPECT_EQ(session.At(5), 1.0f);
}

TEST_P(ExtrasEitherWay, WhatIsNotedAndWhatGroupsArePaidArrives) {
  RichSession session(GetParam(), 2);
  session.Set(4.0, 1);
  session.Reset();
  EXPECT_TRUE(session.client->statistics().empty());
  session.Step();
  std::vector<double> walked;
  for (const Statistic& statistic : session.client->statistics()) {
    EXPECT_EQ(statistic.name, "walked");
    walked.push_back(statistic.value);
  }
  EXPECT_THAT(walked, ElementsAre(1.0, 1.0, 4.0, 4.0));
  ASSERT_EQ(session.client->spec().groups.size(), 1u);
  EXPECT_EQ(session.client->spec().groups[0].name, "both");
  EXPECT_EQ(session.client->spec().groups[0].members[1].agent, 1u);
  EXPECT_THAT(session.client->group_rewards(), ElementsAre(0.5f, 0.5f));
  EXPECT_EQ(session.buffer->batch().rewards[3], 1.5f) << "which holds the group's";
  session.Reset();
  EXPECT_THAT(session.client->group_rewards(), ElementsAre(0.0f, 0.0f));
}

TEST(Extras, ASecondSessionBeginsWithTheDefaults) {
  RichSession session;
  session.Set(7.0);
  session.Reset();
  EXPECT_EQ(session.Step(), 7.0f);
  session.client->Close();
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  auto again = EnvClient::Open(session.engine.Connect(), options);
  ASSERT_TRUE(again.ok()) << again.status().message();
  session.client = std::move(*again);
  session.Reset();
  EXPECT_EQ(session.Step(), 1.0f);
}

/// A session of worlds that begin their episodes otherwise.
class OtherWays : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Each, OtherWays, ::testing::Values("next_step", "disabled"),
                         [](const auto& tested) { return std::string(tested.param); });

// The world here has begun the next episode with the step that ended the last one; it begins another.
TEST_P(OtherWays, AnEpisodeThatWasBegunUnseenHasWhatIsSetBeforeItIsSeen) {
  const bool resets = GetParam() == std::string("disabled");
  const Engine engine({}, "pendulum-v1", 1);
  RawTrainer trainer(engine.Connect());
  Hello hello;
  hello.capabilities = {"parameters"};
  trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
  ASSERT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  trainer.Send(FrameType::kConfigure, 1, R"({"autoreset":")" + std::string(GetParam()) + R"("})");
  ASSERT_EQ(trainer.Next().header.type, FrameType::kSpec);
  const Blocks& blocks = trainer.blocks = Blocks(engine.spec());
  std::uint64_t request = 1;
  const auto step = [&](std::span<const double> set) {
    std::vector<std::byte> payload(blocks.step_bytes);
    payload[kActiveOffset] = std::byte{1};
    if (!set.empty()) {
      payload[0] = static_cast<std::byte>(kWithParameters);
      const auto bytes = std::as_bytes(set);
      payload.insert(payload.end(), bytes.begin(), bytes.end());
    }
    return trainer.Ask(FrameType::kStep, ++request, payload);
  };
  const auto speed = [&](const std::vector<std::byte>& result) {
    float seen[3] = {};
    std::memcpy(seen, result.data() + blocks.behaviours[0].observations, sizeof(seen));
    return std::pair(seen[1], seen[2]);  // sine of the angle, speed
  };
  (void)trainer.Ask(FrameType::kReset, ++request, trainer.ResetPayload(3, {1}));
  for (int i = 0; i < 200; ++i) (void)step({});
  const double weightless[3] = {0.0, kAsItIs, kAsItIs};
  std::vector<std::byte> first;
  if (resets) {
    std::vector<std::byte> payload(blocks.seeds);
    payload[0] = static_cast<std::byte>(kWithParameters);
    payload[kActiveOffset] = std::byte{1};
    const auto bytes = std::as_bytes(std::span(weightless));
    payload.insert(payload.end(), bytes.begin(), bytes.end());
    first = trainer.Ask(FrameType::kReset, ++request, payload);
  } else {
    first = step(weightless);
  }
  ASSERT_EQ(trainer.last_type, FrameType::kResult);
  EXPECT_EQ(first[blocks.behaviours[0].states], static_cast<std::byte>(kFirst | kActive));
  EXPECT_EQ(speed(step({})).second, speed(first).second) << "nothing pulls";
}

TEST(Extras, ARunSetsWhatItsConfigurationSaysAndLogsWhatTheGameNotes) {
  run::TestFolder folder;
  const Engine engine(std::make_unique<RichEnv>(2), {});
  RunConfig config = run::SmallRun(folder.path());
  config.world = engine.url();
  config.steps = 512;
  ASSERT_TRUE(run::ApplySetting("environment_parameters=speed=3, height=uniform -1 1", &config).ok());
  const auto trained = run::Train(config, run::kNeverStop);
  ASSERT_TRUE(trained.ok()) << trained.status().message();
  std::istringstream csv(run::TextOf(trained->directory + "/progress.csv"));
  std::string header, row;
  std::getline(csv, header);
  const auto columns =
      std::count(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(header.find("game/walked")), ',');
  int rows = 0;
  for (; std::getline(csv, row); ++rows) {
    std::istringstream cells(row);
    std::string cell;
    for (std::ptrdiff_t i = 0; i <= columns; ++i) std::getline(cells, cell, ',');
    EXPECT_EQ(cell, "3.0") << row;
  }
  EXPECT_GT(rows, 3);
  EXPECT_THAT(run::TextOf(trained->directory + "/config.yaml"),
              HasSubstr("environment_parameters: \"speed=3, height=uniform -1 1\""));
}

TEST(Extras, WhatARunCannotSetIsRefusedInOneLine) {
  const struct {
    const char* world;
    const char* laws;
    const char* why;
  } cases[] = {{"pendulum-v1", "gravty=3", "there is no parameter 'gravty'; is 'gravity' meant?"},
               {"pendulum-v1", "gravity=-3", "parameter 'gravity' cannot be -3; 0 to 100"},
               {"pendulum-v1", "gravity=uniform 5 500", "parameter 'gravity' cannot be 500"},
               {"road-v0", "gravity=3",
                "environment_parameters sets 'gravity', but road-v0 in this process, 2 copies has "
                "no parameters that can be set"}};
  for (const auto& one : cases) {
    run::TestFolder folder;
    RunConfig config = run::SmallSacRun(folder.path());
    config.world = one.world;
    if (one.world == std::string("road-v0")) config = run::SmallRun(folder.path());
    config.environment_parameters = one.laws;
    const auto trained = run::Train(config, run::kNeverStop);
    EXPECT_THAT(trained.status().message(), HasSubstr(one.why));
  }
}

TEST(Extras, AFileMayGiveEachParameterALine) {
  RunConfig config;
  const Status read = run::ReadYaml("environment_parameters:\n  gravity: uniform 5 15\n  mass: 2\n", "a.yaml", &config);
  ASSERT_TRUE(read.ok()) << read.message();
  EXPECT_EQ(config.environment_parameters, "gravity=uniform 5 15, mass=2");
  EXPECT_THAT(run::ReadYaml("environment_parameters:\n  gravity: often\n", "a.yaml", &config).message(),
              HasSubstr("a.yaml:1: environment_parameters: parameter 'gravity': 'often' cannot be used"));
}

// Its own random numbers, and those of the world, go on where they were.
TEST(Extras, ARunThatDrawsParametersIsResumedToTheBit) {
  run::TestFolder folder;
  const auto config = [&](const char* name, std::int64_t steps) {
    RunConfig made = run::SmallSacRun(folder.path(), name);
    made.steps = steps;
    made.environment_parameters = "gravity=uniform 2 20, mass=log_uniform 0.5 2, length=ramp 1 2 1000";
    return made;
  };
  const auto whole = run::Train(config("whole", 1200), run::kNeverStop);
  ASSERT_TRUE(whole.ok()) << whole.status().message();
  ASSERT_TRUE(run::Train(config("parts", 700), run::kNeverStop).ok());
  RunConfig rest = config("parts", 1200);
  rest.resume = true;
  const auto parts = run::Train(rest, run::kNeverStop);
  ASSERT_TRUE(parts.ok()) << parts.status().message();
  EXPECT_EQ(parts->weights_hash, whole->weights_hash);
  RunConfig plain = config("plain", 1200);
  plain.environment_parameters.clear();
  const auto other = run::Train(plain, run::kNeverStop);
  ASSERT_TRUE(other.ok());
  EXPECT_NE(other->weights_hash, whole->weights_hash);
}

}  // namespace
}  // namespace consac
