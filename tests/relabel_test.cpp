// Other goals' rewards over protocol 2 (spec/protocol2.md, section 13): both ends against each other and before bytes
// that are wrong, and hindsight in a run with an engine, which learns what it learns in process.
#include "consac/protocol/relabel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <thread>
#include <utility>

#include "run/test/report/files.h"
#include "run/test/small_run.h"
#include "tests/mixed_env.h"
#include "tests/protocol2_peers.h"

namespace consac {
namespace {

using namespace testing;
using run::RunConfig;
using ::testing::HasSubstr;

constexpr const char* kBits = "bit-flipping-v0";
constexpr std::int64_t kRowBytes = 30;  // of its observations: three times ten bits

/// `rows` observations of bit flipping, of which every third one is where it is to be.
std::vector<std::byte> BitRows(std::int64_t rows) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(rows * kRowBytes), std::byte{1});
  for (std::int64_t row = 0; row < rows; ++row)
    if (row % 3 != 0) bytes[static_cast<std::size_t>(row * kRowBytes)] = std::byte{0};
  return bytes;
}

/// The same as a RELABEL's payload.
std::vector<std::byte> Relabelling(const EnvSpec& env, std::int64_t rows, std::size_t behaviour = 0) {
  const std::vector<std::byte> seen = BitRows(rows);
  std::vector<std::byte> payload(RelabelBytes(env.behaviours[behaviour], rows));
  WriteRelabel(env, {behaviour, rows, seen.data()}, payload.data());
  return payload;
}

EnvClientOptions OverProtocol2(bool shared_memory = false) {
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  options.shared_memory = shared_memory;
  return options;
}

class RelabelEitherWay : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Each, RelabelEitherWay, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "Shared" : "Tcp"; });

// Also of so many that they are asked for in several requests.
TEST_P(RelabelEitherWay, AnEnginesPricesAreTheWorldsOwn) {
  const Engine engine({}, kBits, 2);
  auto client = EnvClient::Open(engine.Connect(), OverProtocol2(GetParam()));
  ASSERT_TRUE(client.ok()) << client.status().message();
  EXPECT_TRUE((*client)->prices_goals());
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(1, {&buffer.batch(), 1}).ok());
  for (const std::int64_t rows : {0, 1, 200, 100000}) {
    const std::vector<std::byte> seen = BitRows(rows);
    std::vector<float> far(static_cast<std::size_t>(rows) + 1, 7.0f);
    const Status asked = (*client)->PriceGoals(0, seen.data(), rows, far.data());
    ASSERT_TRUE(asked.ok()) << asked.message();
    for (std::int64_t row = 0; row < rows; ++row)
      ASSERT_EQ(far[static_cast<std::size_t>(row)], row % 3 == 0 ? 0.0f : -1.0f) << row;
    EXPECT_EQ(far.back(), 7.0f);
    buffer.Advance();
    ASSERT_TRUE((*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes).ok());
  }
  EXPECT_EQ(engine.steps(), 8) << "prices are no steps";
}

// The request under way is asked again over the new connection, wherever the old one breaks.
TEST(Relabel, PricesComeOverANewConnectionWhereTheOldOneBreaks) {
  const Engine engine({}, kBits, 1);
  /// Breaks after some writes.
  class Breaking final : public Transport {
   public:
    explicit Breaking(std::unique_ptr<Transport> inner) : inner_(std::move(inner)) {}
    Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
      return inner_->Read(into, timeout_s);
    }
    Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) override {
      if (++writes_ < 4) return inner_->WriteSome(bytes, timeout_s);
      if (writes_ % 2 == 0) (void)inner_->Write(bytes, timeout_s);  // it arrives, or it does not
      inner_->Close();
      return Status{StatusCode::kUnavailable, "the cable was pulled"};
    }
    void Close() override { inner_->Close(); }
    std::string peer() const override { return inner_->peer(); }

   private:
    std::unique_ptr<Transport> inner_;
    int writes_ = 0;
  };
  int connections = 0;
  EnvClientOptions options = OverProtocol2();
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> {
    ++connections;
    return std::unique_ptr<Transport>(std::make_unique<Breaking>(engine.Connect()));
  };
  auto client = EnvClient::Open(std::make_unique<Breaking>(engine.Connect()), options);
  ASSERT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(1, {&buffer.batch(), 1}).ok());
  const std::vector<std::byte> seen = BitRows(9);
  for (int i = 0; i < 20; ++i) {
    float rewards[9] = {};
    const Status asked = (*client)->PriceGoals(0, seen.data(), 9, rewards);
    ASSERT_TRUE(asked.ok()) << asked.message();
    EXPECT_EQ(rewards[3], 0.0f);
    EXPECT_EQ(rewards[4], -1.0f);
  }
  EXPECT_GT(connections, 5);
}

TEST(Relabel, WhatCannotBePricedIsRefusedByItsName) {
  MixedEnv spec_of;
  const EnvSpec& env = spec_of.spec();
  const Engine engine(std::make_unique<MixedEnv>(), {});
  RawTrainer trainer(engine.Connect());
  Hello hello;
  hello.capabilities = {"relabel"};
  hello.max_frame = kLargestBeforeWelcome;
  trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
  ASSERT_EQ(ParseWelcome(trainer.Next().payload)->capabilities, std::vector<std::string>{"relabel"});
  trainer.Send(FrameType::kConfigure, 1, "{}");
  ASSERT_EQ(trainer.Next().header.type, FrameType::kSpec);
  trainer.blocks = Blocks(env);
  const std::vector<std::byte> good = Relabelling(env, 2);
  EXPECT_EQ(trainer.ErrorOf(FrameType::kRelabel, 2, good), "BAD_STATE");
  (void)trainer.Ask(FrameType::kReset, 3, trainer.ResetPayload(1, {1}));
  ASSERT_EQ(trainer.last_type, FrameType::kResult);
  std::uint64_t request = 3;
  const auto refusal = [&](std::vector<std::byte> payload, std::size_t at = 0, int value = -1) {
    if (value >= 0) payload[at] = static_cast<std::byte>(value);
    return trainer.ErrorOf(FrameType::kRelabel, ++request, payload);
  };
  EXPECT_EQ(refusal(good), "no error");
  EXPECT_EQ(refusal(good, 0, 2), "OUT_OF_RANGE");
  EXPECT_EQ(refusal(good, 0, 1), "UNSUPPORTED") << "observations without goals";
  EXPECT_EQ(refusal(good, 4, 3), "WRONG_SIZE");
  EXPECT_EQ(refusal(good, 7, 255), "WRONG_SIZE");
  EXPECT_EQ(refusal(good, 8 + 12, 2), "OUT_OF_RANGE") << "a bit of two";
  EXPECT_EQ(refusal({good.begin(), good.begin() + 7}), "WRONG_SIZE");
  EXPECT_EQ(refusal({}), "WRONG_SIZE");
  EXPECT_EQ(refusal(Relabelling(env, 0)), "no error");
}

TEST(Relabel, GoalsAreOfEqualSpaces) {
  const Space two = *Space::Box(-1, 1, {2}), wider = *Space::Box(-1, 2, {2}), number = *Space::Discrete(3);
  const auto has_goals = [](const std::vector<std::pair<std::string, Space>>& parts) {
    return HasGoals(Layout::Of(*Space::Dict(parts)));
  };
  EXPECT_TRUE(has_goals({{"achieved_goal", two}, {"desired_goal", two}, {"observation", number}}));
  EXPECT_FALSE(has_goals({{"achieved_goal", two}, {"desired_goal", wider}}));
  EXPECT_FALSE(has_goals({{"achieved_goal", two}}));
  const Space tree = *Space::Dict({{"at", two}, {"kind", number}});
  EXPECT_TRUE(has_goals({{"achieved_goal", tree}, {"desired_goal", tree}}));
  EXPECT_FALSE(has_goals({{"achieved_goal", *Space::Dict({{"at", two}})}, {"desired_goal", tree}}));
}

TEST(Relabel, APriceThatIsInfiniteIsRefused) {
  const Engine engine({}, "point-reach-dense-v0", 1);
  auto client = EnvClient::Open(engine.Connect(), OverProtocol2());
  ASSERT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(1, {&buffer.batch(), 1}).ok());
  const Layout& layout = (*client)->spec().behaviours[0].observation_layout;
  std::vector<std::byte> row(layout.row_bytes);
  for (const Leaf& leaf : layout.leaves)
    if (leaf.name == kDesiredGoal) WriteElement(leaf, row.data(), 0, 3e38);
  float reward = 0.0f;
  EXPECT_THAT((*client)->PriceGoals(0, row.data(), 1, &reward).message(), HasSubstr("would have paid -inf"));
}

// Rows of fewer bytes than a price.
TEST(Relabel, PricesThatAreMoreThanAFrameAreRefused) {
  EnvSpec env;
  const Space bit = *Space::MultiBinary(1);
  env.behaviours.push_back(
      BehaviourSpec::Of("small", *Space::Dict({{"achieved_goal", bit}, {"desired_goal", bit}}), bit, 1));
  std::vector<std::byte> payload(8 + 2 * 1024);
  const std::uint32_t rows = 1024;
  std::memcpy(payload.data() + 4, &rows, sizeof(rows));
  EXPECT_EQ(FaultName(ReadRelabel(env, payload, 8191).status()), "UNSUPPORTED");
  EXPECT_TRUE(ReadRelabel(env, payload, 8192).ok());
  EXPECT_LE(MostRelabelledRows(env.behaviours[0], 8192) * 8, 8192);
}

TEST(Relabel, ToWhoHasNotAgreedItIsATypeLikeAnyOther) {
  const Engine engine({}, kBits, 1);
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  (void)trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, {1}));
  EXPECT_EQ(trainer.ErrorOf(FrameType::kRelabel, 3, Relabelling(engine.spec(), 1)), "UNKNOWN_MESSAGE");
  const Engine road({}, "road-v0", 1);
  auto client = EnvClient::Open(road.Connect(), OverProtocol2());
  ASSERT_TRUE(client.ok());
  EXPECT_FALSE((*client)->prices_goals());
  float reward = 0.0f;
  const Status asked = (*client)->PriceGoals(0, nullptr, 0, &reward);
  EXPECT_THAT(asked.message(), HasSubstr("protocol 2 cannot say what other goals would have paid"));
}

TEST(Relabel, RewardsThatBreakARuleEndTheSession) {
  const auto numbers = [](std::vector<double> values) {
    std::vector<std::byte> payload(values.size() * sizeof(double));
    std::memcpy(payload.data(), values.data(), payload.size());
    return payload;
  };
  const struct {
    std::vector<std::byte> rewards;
    const char* why;
  } cases[] = {{numbers({0.0}), "8 bytes, expected 16: 8 for each row of RELABEL (R94)"},
               {numbers({0.0, -1.0, 0.0}), "(R94)"},
               {numbers({0.0, std::numeric_limits<double>::quiet_NaN()}), "the price of row 1 of RELABEL is nan"},
               {numbers({std::numeric_limits<double>::infinity(), 0.0}), "(R95)"},
               {numbers({1e300, 0.0}), "which float32 does not have"}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.why);
    RawEngine engine;
    const Space goal = *Space::Box(-1, 1, {1});
    engine.message.env.behaviours[0] = BehaviourSpec::Of(
        "default", *Space::Dict({{"achieved_goal", goal}, {"desired_goal", goal}}), *Space::Discrete(2), 1);
    engine.blocks = Blocks(engine.message.env);
    std::thread peer([&] {
      ASSERT_TRUE(engine.Accept());
      EXPECT_EQ(engine.Next().header.type, FrameType::kHello);
      Welcome welcome;
      welcome.session = 1;
      welcome.capabilities = {"relabel"};
      engine.Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
      EXPECT_EQ(engine.Next().header.type, FrameType::kConfigure);
      engine.Send(FrameType::kSpec, 1, EncodeSpec(engine.message));
      EXPECT_EQ(engine.Next().header.type, FrameType::kReset);
      engine.Send(FrameBytes(FrameType::kResult, 2, engine.ResultPayload(kFirst | kActive)));
      EXPECT_EQ(engine.Next().header.type, FrameType::kRelabel);
      engine.Send(FrameBytes(FrameType::kRewards, 3, one.rewards));
      EXPECT_EQ(engine.Next().header.type, FrameType::kBye);
    });
    auto client = EnvClient::Open(engine.Connect(), OverProtocol2());
    ASSERT_TRUE(client.ok()) << client.status().message();
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    EXPECT_TRUE((*client)->Reset(1, {&buffer.batch(), 1}).ok());
    const float seen[4] = {0.0f, 1.0f, 0.5f, 0.5f};
    float rewards[2] = {};
    const Status asked = (*client)->PriceGoals(0, reinterpret_cast<const std::byte*>(seen), 2, rewards);
    EXPECT_THAT(asked.message(), HasSubstr(one.why));
    EXPECT_THAT(asked.message(), HasSubstr("while asking what other goals would have paid: 127.0.0.1"));
    peer.join();
  }
}

/// An engine at the other end of every write, which answers at once and on no thread.
class PromptEngine final : public Transport {
 public:
  PromptEngine() : reader_(kLargestFrame) {
    welcome_.session = 1;
    welcome_.resume = "of this session";
    welcome_.capabilities = {"relabel"};
    welcome_.heartbeat_s = 2.0;
    const Space goal = *Space::Box(-1, 1, {1});
    spec_.env.behaviours.push_back(BehaviourSpec::Of(
        "default", *Space::Dict({{"achieved_goal", goal}, {"desired_goal", goal}}), *Space::Discrete(2), 1));
  }
  Result<std::size_t> Read(std::span<std::byte> into, double) override {
    const std::size_t count = std::min(into.size(), out_.size());
    std::copy_n(out_.begin(), count, into.begin());
    out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }
  Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double) override {
    if (closed_) return Status{StatusCode::kUnavailable, "closed"};
    const std::span<std::byte> room = reader_.Writable();
    const std::size_t count = std::min(bytes.size(), room.size());
    std::copy_n(bytes.begin(), count, room.begin());
    reader_.Commit(count);
    Frame frame;
    for (auto whole = reader_.Next(&frame); whole.ok() && *whole; whole = reader_.Next(&frame)) Hear(frame);
    return count;
  }
  void Close() override { closed_ = true; }
  std::string peer() const override { return "127.0.0.1:1"; }

  int pings = 0;    ///< that came
  int rewards = 2;  ///< that a RELABEL is answered with

 private:
  void Say(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    const std::vector<std::byte> bytes = FrameBytes(type, request, payload);
    out_.insert(out_.end(), bytes.begin(), bytes.end());
  }
  void Hear(const Frame& frame) {
    const auto say = [&](FrameType type, const std::string& json) {
      Say(type, frame.header.request, std::as_bytes(std::span(json)));
    };
    if (frame.header.type == FrameType::kPing) ++pings;
    if (frame.header.type == FrameType::kHello) say(FrameType::kWelcome, EncodeWelcome(welcome_));
    if (frame.header.type == FrameType::kConfigure) say(FrameType::kSpec, EncodeSpec(spec_));
    const Blocks blocks(spec_.env);
    std::vector<std::byte> result(blocks.result_bytes);
    result[blocks.behaviours[0].states] = static_cast<std::byte>(kFirst | kActive);
    if (frame.header.type == FrameType::kReset) Say(FrameType::kResult, frame.header.request, result);
    const std::vector<std::byte> prices(static_cast<std::size_t>(rewards) * sizeof(double));
    if (frame.header.type == FrameType::kRelabel) Say(FrameType::kRewards, frame.header.request, prices);
  }

  FrameReader reader_;
  Welcome welcome_;
  SpecMessage spec_;
  std::vector<std::byte> out_;
  bool closed_ = false;
};

/// A client of a PromptEngine, which it owns, in a session that has begun.
struct PromptSession {
  explicit PromptSession(EnvClientOptions options = OverProtocol2()) {
    auto transport = std::make_unique<PromptEngine>();
    engine = transport.get();
    auto opened = EnvClient::Open(std::move(transport), options);
    EXPECT_TRUE(opened.ok()) << opened.status().message();
    if (!opened.ok()) return;
    client = std::move(*opened);
    BatchBuffer buffer(client->spec().behaviours[0]);
    EXPECT_TRUE(client->Reset(1, {&buffer.batch(), 1}).ok());
  }
  Status PriceTwo() const {
    const float seen[4] = {};
    float rewards[2] = {};
    return client->PriceGoals(0, reinterpret_cast<const std::byte*>(seen), 2, rewards);
  }
  PromptEngine* engine = nullptr;
  std::unique_ptr<EnvClient> client;
};

// Whoever learns asks again and again; a session that is over cannot be taken up.
TEST(Relabel, ASessionThatIsOverIsNotAskedAgain) {
  int connections = 0;
  EnvClientOptions options = OverProtocol2();
  options.resume_s = 0.3;
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> {
    ++connections;
    return Status{StatusCode::kUnavailable, "nobody listens"};
  };
  const PromptSession session(options);
  ASSERT_NE(session.client, nullptr);
  EXPECT_TRUE(session.PriceTwo().ok());
  session.engine->rewards = 3;
  EXPECT_THAT(session.PriceTwo().message(), HasSubstr("(R94)"));
  const Status again = session.PriceTwo();
  EXPECT_EQ(again.code(), StatusCode::kUnavailable);
  EXPECT_THAT(again.message(), HasSubstr("the session with 127.0.0.1:1 is over, while asking"));
  EXPECT_EQ(connections, 0);
}

TEST(Relabel, APingFollowsTheLatestAnswerByHalfAHeartbeat) {
  run::FakeClock clock;
  const PromptSession session;
  ASSERT_NE(session.client, nullptr);
  const auto pings_after = [&](double seconds) {
    clock.now += seconds;
    session.client->KeepAlive();
    return std::exchange(session.engine->pings, 0);
  };
  EXPECT_EQ(pings_after(0.9), 0);
  EXPECT_EQ(pings_after(0.2), 1) << "RESULT is 1.1 s ago";
  EXPECT_EQ(pings_after(0.9), 0);
  EXPECT_TRUE(session.PriceTwo().ok());
  EXPECT_EQ(pings_after(0.9), 0) << "PING is 1.8 s ago, REWARDS 0.9 s";
  EXPECT_EQ(pings_after(0.2), 1);
}

// ---- in a run

RunConfig Flipping(const std::string& directory, const std::string& world, const char* algorithm) {
  RunConfig config = run::SmallRun(directory, "flipping");
  config.world = world;
  config.algorithm = algorithm;
  config.steps = 400;
  config.seed = 5;
  config.envs = 1;
  config.force = true;
  config.hyperparameters = {{"replay_buffer_class", "HerReplayBuffer"},
                            {"learning_starts", "50"},
                            {"batch_size", "32"},
                            {"buffer_size", "200"},
                            {"net_arch", "[16]"}};
  return config;
}

TEST(RelabelInARun, AnEngineTeachesWhatTheWorldInProcessTeaches) {
  ScratchFolder scratch("relabel_run");
  for (const char* algorithm : {"dqn", "sac", "td3", "ddpg"}) {
    const char* world = std::string_view(algorithm) == "dqn" ? kBits : "bit-flipping-continuous-v0";
    const auto near = run::Train(Flipping(scratch.path(), world, algorithm), kUntilItEnds);
    ASSERT_TRUE(near.ok()) << near.status().message();
    ASSERT_GT(near->models[0].updates, 50);
    for (const bool lockstep : {true, false}) {
      const Engine engine({}, world, 1);
      RunConfig config = Flipping(scratch.path(), engine.url(), algorithm);
      config.lockstep = lockstep;
      const auto far = run::Train(config, kUntilItEnds);
      ASSERT_TRUE(far.ok()) << far.status().message();
      EXPECT_EQ(far->steps, near->steps);
      EXPECT_EQ(far->models[0].updates, near->models[0].updates);
      if (lockstep) {
        EXPECT_EQ(far->weights_hash, near->weights_hash) << algorithm;
      }
    }
  }
}

/// What an engine is asked, and what becomes of it.
struct Pricing {
  std::atomic<std::int64_t> asked{0};    // how often so far
  std::atomic<std::int64_t> breaks{-1};  // which time, from 0, no price comes of it
  std::atomic<bool>* stop = nullptr;     // set then, and nothing is answered until `answers`; null: infinity is
  std::atomic<bool> answers{false};
};

/// Bit flipping that prices goals as `pricing` says.
class BreakingEnv final : public VectorEnv {
 public:
  explicit BreakingEnv(Pricing& pricing) : pricing_(pricing), bits_((*worlds::FindWorld(kBits))->create(1)) {}
  const EnvSpec& spec() const override { return bits_->spec(); }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { bits_->Reset(seed, batches); }
  void Step(std::span<Batch> batches) override { bits_->Step(batches); }
  bool prices_goals() const override { return true; }
  void PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) const override {
    bits_->PriceGoals(b, observations, rows, rewards);
    if (pricing_.asked++ != pricing_.breaks) return;
    rewards[0] = std::numeric_limits<float>::infinity();
    if (pricing_.stop == nullptr) return;
    *pricing_.stop = true;
    pricing_.answers.wait(false);
  }
  void Visit(Archive& archive) override { bits_->Visit(archive); }

 private:
  Pricing& pricing_;
  std::unique_ptr<VectorEnv> bits_;
};

// What was due then is learned first, from the same prices: the weights are those of a run that nobody broke off.
TEST(RelabelInARun, LearningThatAPriceHasBrokenOffIsMadeUpForOnResume) {
  ScratchFolder scratch("relabel_resumed");
  for (const bool stopped : {false, true}) {
    std::atomic<bool> stop{false};
    Pricing pricing;
    const Engine engine(std::make_unique<BreakingEnv>(pricing), {});
    RunConfig config = Flipping(scratch.path(), engine.url(), "dqn");
    config.lockstep = true;
    const auto whole = run::Train(config, stop);
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    pricing.breaks = 2 * pricing.asked - 1;  // the last of the next run
    if (stopped) pricing.stop = &stop;
    const auto broken = run::Train(config, stop);
    EXPECT_EQ(broken.ok(), stopped) << broken.status().message();
    EXPECT_EQ(pricing.asked, pricing.breaks + 1);
    const char* const why = stopped ? "" : "would have paid inf";
    EXPECT_THAT(broken.status().message(), HasSubstr(why));
    stop = false;
    pricing.answers = true;
    pricing.answers.notify_all();
    config.force = false;
    config.resume = true;
    const auto rest = run::Train(config, stop);
    ASSERT_TRUE(rest.ok()) << rest.status().message();
    EXPECT_EQ(rest->models[0].updates, whole->models[0].updates);
    EXPECT_EQ(rest->weights_hash, whole->weights_hash);
  }
}

TEST(RelabelInARun, WhereOneOfSeveralEnginesCannotPriceTheNextOneIsAsked) {
  ScratchFolder scratch("relabel_engines");
  Pricing first, second;
  first.breaks = 20;
  const Engine one(std::make_unique<BreakingEnv>(first), {}), other(std::make_unique<BreakingEnv>(second), {});
  RunConfig config = Flipping(scratch.path(), one.url() + "," + other.url(), "dqn");
  config.steps = 600;
  const auto summary = run::Train(config, kUntilItEnds);
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  EXPECT_EQ(summary->steps, 600);
  EXPECT_GT(first.asked, first.breaks);
  EXPECT_GT(second.asked, 0);
}

TEST(RelabelInARun, AnEngineWithoutItIsNamedInOneLine) {
  ScratchFolder scratch("relabel_refused");
  const Engine engine({}, "road-v0", 1);
  const auto summary = run::Train(Flipping(scratch.path(), engine.url(), "dqn"), kUntilItEnds);
  EXPECT_THAT(summary.status().message(),
              HasSubstr("HerReplayBuffer needs a world that can say what other goals would have paid, and 127.0.0.1"));
  EXPECT_THAT(summary.status().message(), HasSubstr("cannot (protocol 2's capability 'relabel'); choose ReplayBuffer"));
}

}  // namespace
}  // namespace consac
