// Protocol 2 from outside, frame by frame: what the specification says of states, errors, exactly-once steps and the
// three ways to begin the next episode; and whole sessions against the same world in this process.
#include <gtest/gtest.h>

#include <cstring>

#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "tests/protocol2_peers.h"

namespace consac {
namespace {

using namespace protocol2;
using namespace testing;

/// The observation of an environment and its state in a RESULT.
std::array<float, 4> ObservationOf(const Blocks& blocks, const std::vector<std::byte>& result, std::size_t env) {
  std::array<float, 4> row;
  std::memcpy(row.data(), result.data() + blocks.behaviours[0].observations + env * sizeof(row), sizeof(row));
  return row;
}
int StateOf(const Blocks& blocks, const std::vector<std::byte>& result, std::size_t env) {
  return std::to_integer<int>(result[blocks.behaviours[0].states + env]);
}

class EitherMemory : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Each, EitherMemory, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "Shared" : "Tcp"; });

TEST_P(EitherMemory, ManyWorldsOfAnEngineAreTheSameWorldsInProcess) {
  for (const worlds::World& world : worlds::Worlds()) {
    if (world.argument != nullptr) continue;
    const Engine engine({}, world.id, 8);
    EnvClientOptions options;
    options.protocol = Protocol::kProtocol2;
    options.shared_memory = GetParam();
    auto client = EnvClient::Open(engine.Connect(), options);
    ASSERT_TRUE(client.ok()) << client.status().message();
    EXPECT_EQ((*client)->description().find("shared memory") != std::string::npos, GetParam());
    const std::unique_ptr<VectorEnv> local = world.create(8);
    const BehaviourSpec& behaviour = local->spec().behaviours[0];
    EXPECT_EQ((*client)->spec().behaviours[0].observation_space.ToString(), behaviour.observation_space.ToString());
    BatchBuffer far((*client)->spec().behaviours[0]), near(behaviour);
    ASSERT_TRUE((*client)->Reset(5, {&far.batch(), 1}).ok());
    local->Reset(5, {&near.batch(), 1});
    Rng rng(1, 1);
    int ended = 0;
    for (int step = 0; step < 300; ++step) {
      far.Advance();
      near.Advance();
      for (std::size_t i = 0; i < 8; ++i)
        SampleRow(behaviour.action_layout, rng, near.batch().actions + i * behaviour.action_layout.row_bytes);
      std::memcpy(far.batch().actions, near.batch().actions, 8 * behaviour.action_layout.row_bytes);
      local->Step({&near.batch(), 1});
      ASSERT_TRUE((*client)->Step({&far.batch(), 1}, MoreSteps::kYes).ok());
      const std::size_t row_bytes = behaviour.observation_layout.row_bytes;
      ASSERT_EQ(std::memcmp(far.batch().next_observations, near.batch().next_observations, 8 * row_bytes), 0);
      for (std::size_t i = 0; i < 8; ++i) {
        ASSERT_EQ(far.batch().rewards[i], near.batch().rewards[i]);
        ASSERT_EQ(far.batch().terminated[i], near.batch().terminated[i]);
        ASSERT_EQ(far.batch().truncated[i], near.batch().truncated[i]);
        if ((near.batch().terminated[i] | near.batch().truncated[i]) == 0) continue;
        ++ended;
        ASSERT_EQ(std::memcmp(far.batch().final_observations + i * row_bytes,
                              near.batch().final_observations + i * row_bytes, row_bytes),
                  0);
      }
    }
    EXPECT_GT(ended, 0) << world.id;
    (*client)->Close();
  }
}

TEST(Protocol2, StatesErrorsAndTheirNames) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  const std::vector<int> all(kCopies, 1);
  const std::vector<std::int32_t> legal(kCopies, 0);
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 2, trainer.StepPayload(legal, all)), "BAD_STATE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kReset, 3, trainer.ResetPayload(1, {1, 0, 0, 0})), "BAD_STATE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kReset, 9, trainer.ResetPayload(1, all)), "BAD_STATE") << "not the next number";
  EXPECT_EQ(trainer.ErrorOf(FrameType::kReset, 4, trainer.ResetPayload(1, all)), "no error");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kConfigure, 5, std::as_bytes(std::span("{}", 2))), "BAD_STATE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 6, trainer.StepPayload({0, 0, 7, 0}, all)), "OUT_OF_RANGE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 7, trainer.StepPayload({0, 0, 7, 0}, {1, 1, 0, 1})), "no error");
  std::vector<std::byte> cut = trainer.StepPayload(legal, all);
  cut.pop_back();
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 8, cut), "WRONG_SIZE");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kRender, 9, std::as_bytes(std::span("{}", 2))), "UNSUPPORTED");
  EXPECT_EQ(trainer.ErrorOf(static_cast<FrameType>(99), 10, {}), "UNKNOWN_MESSAGE");
  trainer.Send(static_cast<FrameType>(kOptionalType | 99), 0, "anything");
  EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, 11, trainer.StepPayload(legal, all)), "no error");
  EXPECT_EQ(engine.steps(), 3 + kCopies);
}

TEST(Protocol2, AnAnswerIsRepeatedNotCarriedOutTwice) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, std::vector<int>(kCopies, 1)));
  const std::vector<std::byte> step =
      trainer.StepPayload(std::vector<std::int32_t>(kCopies, 1), std::vector<int>(kCopies, 1));
  const std::vector<std::byte> first = trainer.Ask(FrameType::kStep, 3, step);
  EXPECT_EQ(trainer.Ask(FrameType::kStep, 3, step), first);
  EXPECT_EQ(engine.steps(), kCopies);
  EXPECT_NE(trainer.Ask(FrameType::kStep, 4, step), first);
}

// The connection is cut after every byte of a STEP, and of its RESULT: whoever comes back with the token and repeats
// the request gets the one result.
TEST(Protocol2, AStepIsTakenOnceWhereverTheConnectionBreaks) {
  const Engine engine;
  RawTrainer whole(engine.Connect());
  whole.Begin(engine.spec());
  const std::vector<int> all(kCopies, 1);
  whole.Ask(FrameType::kReset, 2, whole.ResetPayload(3, all));
  const std::vector<std::byte> step = whole.StepPayload({0, 1, 0, 1}, all);
  const std::vector<std::byte> request = FrameBytes(FrameType::kStep, 3, step);
  const std::vector<std::byte> expected = whole.Ask(FrameType::kStep, 3, step);
  whole.Send(FrameType::kBye, 0, "");
  const std::size_t answer_bytes = kHeaderBytes + expected.size();
  for (std::size_t cut = 0; cut <= request.size() + answer_bytes; ++cut) {
    auto first = std::make_unique<RawTrainer>(engine.Connect());
    first->Begin(engine.spec());
    first->Ask(FrameType::kReset, 2, first->ResetPayload(3, all));
    first->Send(std::span(request).first(std::min(cut, request.size())));
    const std::string token = first->resume;
    std::vector<std::byte> heard(cut > request.size() ? cut - request.size() : 0);  // so much of the RESULT
    for (std::size_t got = 0; got < heard.size();) {
      const auto count = first->transport().Read(std::span(heard).subspan(got), 5.0);
      ASSERT_TRUE(count.ok() && *count > 0);
      got += *count;
    }
    first->transport().Close();
    RawTrainer second(engine.Connect());
    Hello hello;
    hello.resume = token;
    Frame welcome;
    for (int attempt = 0; attempt < 50; ++attempt) {  // the engine may not have noticed the end yet
      second.Send(FrameType::kHello, 0, EncodeHello(hello));
      welcome = second.Next();
      if (welcome.header.type == FrameType::kWelcome) break;
      second = RawTrainer(engine.Connect());
    }
    ASSERT_EQ(welcome.header.type, FrameType::kWelcome) << cut;
    EXPECT_TRUE(ParseWelcome(welcome.payload)->resumed);
    second.blocks = whole.blocks;
    ASSERT_EQ(second.Ask(FrameType::kStep, 3, step), expected) << "cut after byte " << cut;
    EXPECT_EQ(engine.steps(), kCopies);
    second.Send(FrameType::kBye, 0, "");
  }
}

// An engine that keeps a rate has taken a STEP but not carried it out when the connection breaks.
TEST(Protocol2, AStepThatWaitsForItsFrameIsTakenOnceToo) {
  EnvServerOptions options;
  options.min_step_s = 0.2;
  const Engine engine(options);
  const std::vector<int> all(kCopies, 1);
  RawTrainer first(engine.Connect());
  first.Begin(engine.spec());
  first.Ask(FrameType::kReset, 2, first.ResetPayload(3, all));
  first.Ask(FrameType::kStep, 3, first.StepPayload({0, 0, 0, 0}, all));
  const std::vector<std::byte> step = first.StepPayload({0, 1, 0, 1}, all);
  first.Send(FrameBytes(FrameType::kStep, 4, step));
  first.transport().Close();
  RawTrainer second(engine.Connect());
  Hello hello;
  hello.resume = first.resume;
  for (int attempt = 0; attempt < 100; ++attempt) {
    second.Send(FrameType::kHello, 0, EncodeHello(hello));
    if (second.Next().header.type == FrameType::kWelcome) break;
    second = RawTrainer(engine.Connect());
  }
  second.blocks = first.blocks;
  second.Ask(FrameType::kStep, 4, step);
  EXPECT_EQ(second.last_type, FrameType::kResult);
  EXPECT_EQ(engine.steps(), 2 * kCopies);
}

TEST(Protocol2, ThreeWaysToBeginTheNextEpisode) {
  std::vector<std::vector<std::byte>> seen[3];
  const char* configure[3] = {R"({"autoreset":"same_step"})", R"({"autoreset":"next_step"})",
                              R"({"autoreset":"disabled"})"};
  const std::vector<int> all(kCopies, 1);
  const std::vector<std::int32_t> push(kCopies, 1);
  for (int mode = 0; mode < 3; ++mode) {
    const Engine engine;
    RawTrainer trainer(engine.Connect());
    trainer.Begin(engine.spec(), configure[mode]);
    std::uint64_t request = 2;
    trainer.Ask(FrameType::kReset, request, trainer.ResetPayload(7, all));
    const std::vector<std::byte> step = trainer.StepPayload(push, all);
    std::vector<std::byte> result;
    int ended = -1;
    while (ended < 0) {
      result = trainer.Ask(FrameType::kStep, ++request, step);
      for (std::size_t env = 0; env < kCopies && ended < 0; ++env) {
        if ((StateOf(trainer.blocks, result, env) & (kTerminated | kTruncated)) != 0) ended = static_cast<int>(env);
      }
    }
    const auto env = static_cast<std::size_t>(ended);
    std::array<float, 4> last = ObservationOf(trainer.blocks, result, env), next;
    if (mode == 0) {
      EXPECT_EQ(StateOf(trainer.blocks, result, env), kTerminated | kFinal | kFirst | kActive);
      next = last;
      std::memcpy(last.data(), result.data() + trainer.blocks.result_bytes, sizeof(last));
    } else {
      EXPECT_EQ(StateOf(trainer.blocks, result, env), static_cast<int>(kTerminated));
    }
    if (mode == 1) {
      result = trainer.Ask(FrameType::kStep, ++request, step);
      next = ObservationOf(trainer.blocks, result, env);
    }
    if (mode == 2) {
      EXPECT_EQ(trainer.ErrorOf(FrameType::kStep, ++request, step), "RESET_REQUIRED");
      std::vector<std::byte> reset(trainer.blocks.seeds);
      reset[kActiveOffset + env] = std::byte{1};
      result = trainer.Ask(FrameType::kReset, ++request, reset);
      next = ObservationOf(trainer.blocks, result, env);
    }
    if (mode > 0) {
      double reward = 1.0;
      std::memcpy(&reward, result.data() + trainer.blocks.behaviours[0].rewards + env * sizeof(reward), sizeof(reward));
      EXPECT_EQ(reward, 0.0);
      EXPECT_EQ(StateOf(trainer.blocks, result, env) & kFirst, static_cast<int>(kFirst));
    }
    seen[mode].push_back({reinterpret_cast<std::byte*>(last.data()), reinterpret_cast<std::byte*>(last.data() + 4)});
    seen[mode].push_back({reinterpret_cast<std::byte*>(next.data()), reinterpret_cast<std::byte*>(next.data() + 4)});
  }
  EXPECT_EQ(seen[0], seen[1]);
  EXPECT_EQ(seen[0], seen[2]);
}

TEST(Protocol2, HandshakesThatAreRefused) {
  EnvServerOptions options;
  options.token = "open sesame";
  const Engine engine(options);
  const auto refusal = [&](const std::string& hello) {
    RawTrainer trainer(engine.Connect());
    trainer.Send(FrameType::kHello, 0, hello);
    const Frame frame = trainer.Next();
    return frame.header.type == FrameType::kError ? ParseError(frame.payload)->code : std::string("no error");
  };
  Hello hello;
  EXPECT_EQ(refusal(EncodeHello(hello)), "AUTH_FAILED");
  hello.token = "open sesamf";
  EXPECT_EQ(refusal(EncodeHello(hello)), "AUTH_FAILED");
  hello.token = "open sesame";
  hello.lowest = hello.highest = 3;
  EXPECT_EQ(refusal(EncodeHello(hello)), "UNSUPPORTED_VERSION");
  hello.lowest = 1;
  hello.resume = "0123";
  EXPECT_EQ(refusal(EncodeHello(hello)), "AUTH_FAILED");
  EXPECT_EQ(refusal("{\"protocol\": [2, 2], \"protocol\": [2, 2]}"), "MALFORMED");
  EXPECT_EQ(refusal("[" + std::string(100, '[')), "MALFORMED");
  hello.resume.clear();
  RawTrainer trainer(engine.Connect());
  trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
  EXPECT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  EXPECT_EQ(refusal(EncodeHello(hello)), "CAPACITY");
}

TEST(Protocol2, SeveralTrainersHaveWorldsOfTheirOwn) {
  EnvServerOptions options;
  options.make_env = [] { return (*worlds::FindWorld("cartpole-v1"))->create(kCopies); };
  options.max_sessions = 3;
  const Engine engine(options);
  const std::vector<int> all(kCopies, 1);
  std::vector<std::unique_ptr<RawTrainer>> trainers;
  std::vector<std::vector<std::byte>> results;
  for (int i = 0; i < 3; ++i) {
    trainers.push_back(std::make_unique<RawTrainer>(engine.Connect()));
    trainers.back()->Begin(engine.spec());
    trainers.back()->Ask(FrameType::kReset, 2, trainers.back()->ResetPayload(7, all));
  }
  // Steps of one do not move the others' worlds: interleaved, each sees what it would see alone.
  for (std::uint64_t step = 0; step < 20; ++step) {
    for (int i = 0; i < 3; ++i) {
      const std::vector<std::int32_t> actions(kCopies, static_cast<std::int32_t>(step % 2));
      results.push_back(trainers[static_cast<std::size_t>(i)]->Ask(
          FrameType::kStep, 3 + step, trainers[static_cast<std::size_t>(i)]->StepPayload(actions, all)));
      EXPECT_EQ(results.back(), results[results.size() - 1 - static_cast<std::size_t>(i)]);
    }
  }
  EXPECT_EQ(engine.steps(), 3 * 20 * kCopies);
  RawTrainer fourth(engine.Connect());
  fourth.Send(FrameType::kHello, 0, EncodeHello({}));
  EXPECT_EQ(ParseError(fourth.Next().payload)->code, "CAPACITY");
  trainers[1]->Send(FrameType::kBye, 0, "");
  RawTrainer fifth(engine.Connect());
  for (int attempt = 0; attempt < 50; ++attempt) {  // the engine may not have read the BYE yet
    fifth.Send(FrameType::kHello, 0, EncodeHello({}));
    if (fifth.Next().header.type == FrameType::kWelcome) return;
    fifth = RawTrainer(engine.Connect());
  }
  FAIL() << "the place of a trainer that left is not given to another";
}

TEST(Protocol2, AMatchingTokenTakesTheSessionFromAConnectionThatHangs) {
  const Engine engine;
  const std::vector<int> all(kCopies, 1);
  RawTrainer hanging(engine.Connect());
  hanging.Begin(engine.spec());
  hanging.Ask(FrameType::kReset, 2, hanging.ResetPayload(3, all));
  const std::vector<std::byte> step = hanging.StepPayload({0, 1, 0, 1}, all);
  const std::vector<std::byte> expected = hanging.Ask(FrameType::kStep, 3, step);
  RawTrainer second(engine.Connect());  // the first connection stays open, as after a pulled cable
  Hello hello;
  hello.resume = hanging.resume;
  second.Send(FrameType::kHello, 0, EncodeHello(hello));
  const Frame welcome = second.Next();
  ASSERT_EQ(welcome.header.type, FrameType::kWelcome);
  EXPECT_TRUE(ParseWelcome(welcome.payload)->resumed);
  second.blocks = hanging.blocks;
  EXPECT_EQ(second.Ask(FrameType::kStep, 3, step), expected);
  EXPECT_EQ(engine.steps(), kCopies);
  EXPECT_EQ(static_cast<int>(hanging.Next().header.type), 0) << "the old connection is closed";
}

TEST(Protocol2, ADifferenceIsNamedByItsPath) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  ASSERT_EQ(trainer.Next().header.type, FrameType::kWelcome);
  EnvSpec other = engine.spec();
  other.behaviours[0] = BehaviourSpec::Of("default", *Space::Box(-1, 1, {4}), *Space::Discrete(3), kCopies);
  Configure configure;
  configure.expect_json = BehavioursJson(other);
  trainer.Send(FrameType::kConfigure, 1, EncodeConfigure(configure));
  const Frame frame = trainer.Next();
  ASSERT_EQ(frame.header.type, FrameType::kError);
  EXPECT_EQ(ParseError(frame.payload)->code, "SPEC_MISMATCH");
  EXPECT_EQ(ParseError(frame.payload)->path, "behaviours/0/action/n");
}

TEST(Protocol2, FramesThatAreNone) {
  const Engine engine;
  const auto refusal = [&](std::vector<std::byte> bytes) {
    RawTrainer trainer(engine.Connect());
    trainer.Send(bytes);
    const Frame frame = trainer.Next();
    return frame.header.type == FrameType::kError ? ParseError(frame.payload)->code : std::string("no error");
  };
  std::vector<std::byte> frame = FrameBytes(FrameType::kHello, 0, EncodeHello({}));
  auto changed = frame;
  changed[1] = std::byte{0};
  EXPECT_EQ(refusal(changed), "BAD_MAGIC");
  changed = frame;
  changed[6] = std::byte{2};
  EXPECT_EQ(refusal(changed), "MALFORMED");
  changed = frame;
  changed[31] = std::byte{1};
  EXPECT_EQ(refusal(changed), "MALFORMED");
  changed = frame;
  changed[6] = std::byte{1};
  EXPECT_EQ(refusal(changed), "CRC_MISMATCH");
  for (const std::uint32_t length : {4097u, 0x80000000u, 0xFFFFFFFFu}) {
    changed = frame;
    std::memcpy(changed.data() + 8, &length, sizeof(length));
    EXPECT_EQ(refusal(changed), "FRAME_TOO_LARGE") << length;
  }
}

TEST(Protocol2, PingsAreAnsweredBetweenRequests) {
  const Engine engine;
  RawTrainer trainer(engine.Connect());
  trainer.Begin(engine.spec());
  trainer.Send(FrameType::kPing, 0, "are you there");
  const Frame pong = trainer.Next();
  EXPECT_EQ(pong.header.type, FrameType::kPong);
  EXPECT_EQ(std::memcmp(pong.payload.data(), "are you there", 13), 0);
}

// However a stream is cut, the same frames come out.
TEST(Protocol2, FramesAreTheSameWhereverTheStreamIsCut) {
  std::vector<std::byte> stream;
  for (std::uint64_t i = 1; i < 6; ++i) {
    const std::vector<std::byte> frame =
        FrameBytes(FrameType::kStep, i, std::string(static_cast<std::size_t>(i * i * 7), static_cast<char>('a' + i)));
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  const auto read = [&](std::size_t cut) {
    FrameReader reader(kLargestFrame);
    std::vector<std::string> frames;
    for (const auto& piece : {std::span(stream).first(cut), std::span(stream).subspan(cut)}) {
      if (piece.empty()) continue;
      std::memcpy(reader.Writable().data(), piece.data(), piece.size());
      reader.Commit(piece.size());
      Frame frame;
      for (auto whole = reader.Next(&frame); whole.ok() && *whole; whole = reader.Next(&frame))
        frames.push_back(std::to_string(frame.header.request) +
                         std::string(reinterpret_cast<const char*>(frame.payload.data()), frame.payload.size()));
    }
    return frames;
  };
  const std::vector<std::string> whole = read(stream.size());
  ASSERT_EQ(whole.size(), 5u);
  for (std::size_t cut = 0; cut < stream.size(); ++cut) ASSERT_EQ(read(cut), whole) << cut;
}

// A connection that breaks in the middle of a session costs the trainer nothing.
TEST(Protocol2, TheClientComesBackByItself) {
  const Engine engine;
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  /// Breaks after some writes.
  class Breaking final : public Transport {
   public:
    Breaking(std::unique_ptr<Transport> inner, int writes) : inner_(std::move(inner)), writes_(writes) {}
    Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
      return inner_->Read(into, timeout_s);
    }
    Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) override {
      if (--writes_ == 0) {
        (void)inner_->Write(bytes, timeout_s);
        inner_->Close();
        return Status{StatusCode::kUnavailable, "the cable was pulled"};
      }
      return inner_->WriteSome(bytes, timeout_s);
    }
    void Close() override { inner_->Close(); }
    std::string peer() const override { return inner_->peer(); }

   private:
    std::unique_ptr<Transport> inner_;
    int writes_;
  };
  int connections = 0;
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> {
    ++connections;
    return std::unique_ptr<Transport>(std::make_unique<Breaking>(engine.Connect(), 5));
  };
  options.shared_memory = false;
  auto client = EnvClient::Open(std::make_unique<Breaking>(engine.Connect(), 7), options);
  ASSERT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(1, {&buffer.batch(), 1}).ok());
  for (int i = 1; i <= 40; ++i) {
    buffer.Advance();
    const Status status = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
    ASSERT_TRUE(status.ok()) << status.message();
    ASSERT_EQ(engine.steps(), i * kCopies);
  }
  EXPECT_GT(connections, 5);
}

// The connection beside the memory breaks: the session goes on over a new one, and no step is taken twice.
TEST(Protocol2, SharedMemoryEndsWithItsConnectionAndTcpGoesOn) {
  const Engine engine;
  EnvClientOptions options;
  options.protocol = Protocol::kProtocol2;
  Transport* connection = nullptr;
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> { return engine.Connect(); };
  auto transport = engine.Connect();
  connection = transport.get();
  auto client = EnvClient::Open(std::move(transport), options);
  ASSERT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(1, {&buffer.batch(), 1}).ok());
  for (int i = 1; i <= 20; ++i) {
    if (i == 10) {
      connection->Close();
      std::this_thread::sleep_for(std::chrono::milliseconds(200));  // while frames flow nobody looks at it
    }
    buffer.Advance();
    const Status status = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
    ASSERT_TRUE(status.ok()) << i << ": " << status.message();
  }
  EXPECT_EQ(engine.steps(), 20 * kCopies);
  EXPECT_EQ((*client)->description().find("shared memory"), std::string::npos);
}

}  // namespace
}  // namespace consac
