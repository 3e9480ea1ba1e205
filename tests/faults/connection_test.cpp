// Group A of docs/faults.md: the life of a connection. Each test is named after its row.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>

#include <algorithm>
#include <atomic>

#include "tests/faults/ticking_engine.h"

namespace {
std::atomic<std::int64_t> wall_clock_jump_s{0};
}  // namespace

// The wall clock as row A17 wants it. Libraries find this one before the system's.
extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = static_cast<int>(::syscall(SYS_clock_gettime, clock, time));
  if (clock == CLOCK_REALTIME) time->tv_sec += wall_clock_jump_s.load();
  return result;
}

namespace consac {
namespace {

using namespace testing;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Text protocol 1 fits this one.
std::unique_ptr<VectorEnv> OneRoad() {
  return (*worlds::FindWorld("road-v0"))->create(1);
}

class FaultAEachWay : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Each, FaultAEachWay, ::testing::Values(Way::kText1, Way::kTcp, Way::kShared), WayName);

// Text protocol 1 has no word for what these are about.
class FaultAOverProtocol2 : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Each, FaultAOverProtocol2, ::testing::Values(Way::kTcp, Way::kShared), WayName);

TEST(FaultA, A3_AnotherServiceIsToldByItsFirstBytes) {
  using namespace std::string_literals;
  const struct {
    std::string says, shown;
  } services[] = {{"SSH-2.0-OpenSSH_9.2\r\n", "SSH-2.0"},
                  {"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n", "HTTP/1.1 400"},
                  {"\0\0\x12\4\0\0\0\0\0\0\3\x7f\xff\xff\xff\0\4\0\x10\0\0"s, "\\x04"}};  // gRPC: HTTP/2 SETTINGS
  for (const Protocol protocol : {Protocol::kAuto, Protocol::kText1, Protocol::kProtocol2}) {
    for (const auto& service : services) {
      auto listener = *ListenTcp({"127.0.0.1", 0});
      auto near_end = *ConnectTcp({"127.0.0.1", listener->port()}, 2.0);
      auto far_end = *listener->Accept(2.0);
      ASSERT_TRUE(Say(*far_end, service.says).ok());
      EnvClientOptions options;
      options.protocol = protocol;
      options.setup_timeout_s = 1.0;
      const Status status = EnvClient::Open(std::move(near_end), options).status();
      EXPECT_EQ(status.code(), StatusCode::kProtocol) << status.message();
      EXPECT_THAT(status.message(), AllOf(HasSubstr("no CONSAC engine"), HasSubstr(service.shown)));
    }
  }
}

TEST(FaultA, A4_ASilentConnectionIsServedText1AfterTheGraceTime) {
  EnvServerOptions options;
  options.grace_s = 0.1;
  const Engine engine(OneRoad(), options);
  const double start = Now();
  const auto silent = engine.Connect();
  std::byte first[64];
  const auto count = silent->Read(first, 5.0);
  ASSERT_TRUE(count.ok() && *count > 0);
  EXPECT_THAT(std::string(reinterpret_cast<const char*>(first), *count), StartsWith("D#3#0#B#2#"));
  EXPECT_GE(Now() - start, 0.09);
}

TEST(FaultA, A4_WhereText1DoesNotFitASilentConnectionHearsWhyAndIsClosedAtTheHandshakeDeadline) {
  EnvServerOptions options;
  options.handshake_s = 0.2;
  const Engine engine(options);
  const double start = Now();
  const auto silent = engine.Connect();
  EXPECT_THAT(Listen(*silent, 5.0), HasSubstr("protocol 2 only: text protocol 1 serves one world"));
  EXPECT_GE(Now() - start, 0.19);
  EXPECT_LT(Now() - start, 3.0);
}

TEST(FaultA, A4_AnEngineOfProtocol2AloneWritesNoTextToASilentConnection) {
  EnvServerOptions options;
  options.handshake_s = 0.2;
  options.protocol = Protocol::kProtocol2;
  const Engine engine(options);
  RawTrainer silent(engine.Connect());
  const Frame answer = silent.Next();
  ASSERT_EQ(answer.header.type, FrameType::kError);
  EXPECT_EQ(protocol2::ParseError(answer.payload)->code, "MALFORMED");
}

/// What a trainer that begins with HELLO hears: WELCOME, or why not.
std::string AnswerToHello(const Engine& engine) {
  RawTrainer trainer(engine.Connect());
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  const Frame answer = trainer.Next();
  if (answer.header.type == FrameType::kWelcome) return "WELCOME";
  return answer.header.type == FrameType::kError ? ParseError(answer.payload)->code : "the connection's end";
}

TEST(FaultA, A4_WhoHasNeverSaidAnythingGivesItsPlaceToAnother) {
  EnvServerOptions options;
  options.grace_s = 0.05;
  options.handshake_s = 0.5;  // 2 s of saying nothing
  const Engine engine(OneRoad(), options);
  const auto mute = engine.Connect();
  std::byte first[256];
  ASSERT_TRUE(mute->Read(first, 5.0).ok());
  const double served = Now();
  EXPECT_EQ(AnswerToHello(engine), "CAPACITY") << "a trainer may take its time";
  EXPECT_TRUE(Soon([&] { return AnswerToHello(engine) == "WELCOME"; }));
  EXPECT_GE(Now() - served, 1.9);
  (void)Listen(*mute, 5.0);
  EXPECT_EQ(mute->Read(first, 0.0).status().code(), StatusCode::kUnavailable) << "it is closed";
}

TEST(FaultA, A4_WhoHasSpokenKeepsItsPlaceHoweverLongItThinks) {
  EnvServerOptions options;
  options.grace_s = 0.05;
  options.handshake_s = 0.1;  // 0.4 s of saying nothing
  const Engine engine(OneRoad(), options);
  Session thinking(engine.Connect(), Impatient(Way::kText1));
  ASSERT_TRUE(thinking.Step().ok());
  for (const double end = Now() + 1.0; Now() < end;) ASSERT_EQ(AnswerToHello(engine), "CAPACITY");
  EXPECT_TRUE(thinking.Step().ok());
}

TEST(FaultA, A4_AtTheDoorWhoSpeaksComesBeforeWhoSaysNothing) {
  EnvServerOptions options;
  options.handshake_s = 60.0;
  const Engine engine(options);  // of worlds that text protocol 1 does not fit: nobody is served unheard
  std::vector<std::unique_ptr<Transport>> mute;
  for (int i = 0; i < 40; ++i) mute.push_back(engine.Connect());
  EXPECT_EQ(AnswerToHello(engine), "WELCOME");
  EXPECT_THAT(Listen(*mute.front(), 5.0), StartsWith("busy: "));
}

TEST(FaultA, A5_SlowLorisIsClosedAtTheHandshakeDeadline) {
  EnvServerOptions options;
  options.handshake_s = 0.3;
  const Engine engine(options);
  const std::vector<std::byte> hello = FrameBytes(FrameType::kHello, 0, EncodeHello({}));
  const auto loris = engine.Connect();
  const double start = Now();
  const std::size_t sent = Trickle(*loris, hello, 0.03, [] { return false; });
  EXPECT_LT(sent, hello.size()) << "each byte came in time, the whole did not";
  EXPECT_LT(Now() - start, 3.5) << "0.3 s, and 2 s in which what still comes is read (R80)";
  Session next(engine.Connect(), Impatient(Way::kTcp));
  EXPECT_TRUE(next.Step().ok());
}

TEST(FaultA, A5_AnAnswerThatTricklesIsADeadline) {
  RawEngine engine;
  std::atomic<bool> given_up{false};
  std::thread peer([&] {
    engine.Begin();
    const Frame step = engine.Next();
    const std::vector<std::byte> result = FrameBytes(FrameType::kResult, step.header.request, engine.ResultPayload());
    for (std::size_t i = 0; i < result.size() && !given_up; ++i) {
      engine.Send(std::span(result).subspan(i, 1));
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
    }
  });
  Session session(engine.Connect(), Impatient(Way::kTcp));
  const double start = Now();
  EXPECT_EQ(session.Step().code(), StatusCode::kDeadlineExceeded);
  EXPECT_LT(Now() - start, 2.0);
  given_up = true;
  peer.join();
}

TEST(FaultA, A5_ASetupThatTricklesIsADeadline) {
  auto listener = *ListenTcp({"127.0.0.1", 0});
  auto near_end = *ConnectTcp({"127.0.0.1", listener->port()}, 2.0);
  auto far_end = *listener->Accept(2.0);
  std::atomic<bool> given_up{false};
  std::thread peer([&] {
    const std::string_view begun = "D#3#", setup = "0#B#4#0,0,0,0,1,1,1,1";
    (void)Say(*far_end, begun);
    Trickle(*far_end, std::as_bytes(std::span(setup)), 0.03, [&] { return given_up.load(); });
  });
  EnvClientOptions options = Impatient(Way::kText1);
  options.setup_timeout_s = 0.3;
  const double start = Now();
  EXPECT_EQ(EnvClient::Open(std::move(near_end), options).status().code(), StatusCode::kDeadlineExceeded);
  EXPECT_LT(Now() - start, 0.7);
  given_up = true;
  peer.join();
}

// Silent ones and ones that say HELLO. The trainer that is there does not notice.
// A trainer that learns for long takes no step, but it lives.
TEST(FaultA, A11_ATrainerThatLearnsForLongKeepsItsSession) {
  EnvServerOptions options;
  options.deadline_s = 0.6;
  const Engine engine(options);
  for (const bool says : {true, false}) {
    EnvClientOptions client = Impatient(Way::kShared);
    auto opened = EnvClient::Open(engine.Connect(), client);
    ASSERT_TRUE(opened.ok()) << opened.status().message();
    BatchBuffer buffer((*opened)->spec().behaviours[0]);
    ASSERT_TRUE((*opened)->Reset(1, {&buffer.batch(), 1}).ok());
    for (const double start = Now(); Now() - start < 1.5;) {
      if (says) (*opened)->KeepAlive();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    buffer.Advance();
    EXPECT_EQ((*opened)->Step({&buffer.batch(), 1}, MoreSteps::kYes).ok(), says);
  }
}

// What does not fit into the text framer's room at once is still read, or refused.
TEST(FaultA, A6_MuchTextBeforeTheSessionBeginsIsNoOverflow) {
  EnvServerOptions options;
  options.grace_s = 0.05;
  const Engine engine((*worlds::FindWorld("road-v0"))->create(1), options);
  const auto talker = engine.Connect();
  (void)Say(*talker, std::string(60000, '7'));
  (void)Listen(*talker, 1.0);
  talker->Close();
  Session next(engine.Connect(), Impatient(Way::kTcp));
  EXPECT_TRUE(next.Step().ok());
}

TEST(FaultA, A15_AnAccessTokenIsNotGoneAroundByTextProtocol1) {
  EnvServerOptions options;
  options.grace_s = 0.05;
  options.handshake_s = 0.3;
  options.token = "secret";
  const Engine engine((*worlds::FindWorld("road-v0"))->create(1), options);
  const auto silent = engine.Connect();
  EXPECT_THAT(Listen(*silent, 1.0), HasSubstr("asks for a token"));
  const auto talker = engine.Connect();
  (void)Say(*talker, "0\n");
  EXPECT_THAT(Listen(*talker, 1.0), HasSubstr("protocol 2 only"));
  EXPECT_EQ(engine.steps(), 0);
}

TEST(FaultA, A6_AFloodOfConnectionsIsTurnedAwayWhileTheSessionGoesOn) {
  EnvServerOptions options;
  options.handshake_s = 0.3;
  const Engine engine(options);
  EnvClientOptions patient = Impatient(Way::kTcp);
  patient.deadline_s = 10.0;
  Session session(engine.Connect(), patient);
  std::vector<std::unique_ptr<Transport>> crowd;
  const std::vector<std::byte> hello = FrameBytes(FrameType::kHello, 0, EncodeHello({}));
  for (int i = 0; i < 80; ++i) {
    auto one = ConnectTcp({"127.0.0.1", engine.port()}, 2.0);
    ASSERT_TRUE(one.ok());
    if (i % 2 == 0) (void)(*one)->Write(hello, 1.0);
    crowd.push_back(std::move(*one));
    const Status status = session.Step();
    ASSERT_TRUE(status.ok()) << status.message();
  }
  for (const auto& one : crowd) {
    const std::string heard = Listen(*one, 10.0);
    const bool told = heard.find("CAPACITY") != std::string::npos || heard.starts_with("busy:") ||
                      heard.find("protocol 2 only") != std::string::npos;
    EXPECT_TRUE(heard.empty() || told) << heard;
    EXPECT_EQ(one->Write(hello, 0.1).ok() && !Listen(*one, 0.2).empty(), false) << "it is closed";
    ASSERT_TRUE(session.Step().ok());
  }
  EXPECT_EQ(engine.steps(), 160 * kCopies);
}

TEST(FaultA, A6_AtAFullDoorWhoeverHasBeenThereForLongestHearsCapacity) {
  LogLines log;
  const Engine engine{EnvServerOptions()};
  const std::vector<std::byte> hello = FrameBytes(FrameType::kHello, 0, EncodeHello({}));
  std::vector<std::unique_ptr<Transport>> crowd;
  for (int i = 0; i < 40; ++i) {
    crowd.push_back(engine.Connect());
    ASSERT_TRUE(crowd.back()->Write(std::span(hello).first(6), 1.0).ok());
  }
  Session session(engine.Connect(), Impatient(Way::kTcp));
  EXPECT_TRUE(session.Step().ok());
  EXPECT_TRUE(std::ranges::any_of(crowd, [](const auto& one) {
    const std::string heard = Listen(*one, 0.1);
    return heard.find("CAPACITY") != heard.npos || heard.starts_with("busy:");
  }));
  EXPECT_THAT(log.lines(), ::testing::Contains(HasSubstr("was turned away: too many connections")));
}

TEST(FaultA, A6_AFloodOfRefusedConnectionsIsToldInAFewLines) {
  LogLines log;
  {
    const Engine engine{EnvServerOptions()};
    for (int i = 0; i < 60; ++i) {
      RawTrainer trainer(engine.Connect());
      trainer.Send(FrameType::kStep, 1, "no HELLO");
      EXPECT_EQ(trainer.Next().header.type, FrameType::kError);
    }
    EXPECT_THAT(log.lines(), ::testing::SizeIs(5));
  }
  EXPECT_THAT(log.lines(), ::testing::SizeIs(6));
  EXPECT_THAT(log.lines().back(), AllOf(HasSubstr("was turned away"), HasSubstr("(and 54 more like it)")));
}

TEST(FaultA, A7_ASessionWhoseTrainerVanishedIsHeldAndThenFreed) {
  EnvServerOptions options;
  options.resume_s = 0.4;
  const Engine engine(options);
  const auto vanish = [&] {
    auto socket = std::make_unique<BrittleSocket>(engine.port());
    BrittleSocket& cable = *socket;
    RawTrainer trainer(std::move(socket));
    trainer.Begin(engine.spec());
    trainer.Ask(FrameType::kReset, 2, trainer.ResetPayload(1, std::vector<int>(kCopies, 1)));
    cable.Reset();
    return trainer.resume;
  };
  EXPECT_EQ(ResumeAnswer(engine, vanish()), "WELCOME");
  const std::string token = vanish();
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  EXPECT_EQ(ResumeAnswer(engine, token), "AUTH_FAILED");
  Session next(engine.Connect(), Impatient(Way::kTcp));
  EXPECT_TRUE(next.Step().ok());
}

TEST(FaultA, A7_ATextTrainerThatVanishedMakesRoomForTheNext) {
  EnvServerOptions options;
  options.grace_s = 0.05;
  const Engine engine(OneRoad(), options);
  BrittleSocket vanishing(engine.port());
  std::byte first[256];
  ASSERT_TRUE(vanishing.Read(first, 5.0).ok());
  vanishing.Reset();
  Session next(engine.Connect(), Impatient(Way::kText1));
  EXPECT_TRUE(next.Step().ok());
}

TEST_P(FaultAEachWay, A8_AnEngineThatClosesInTheMiddleOfAStepIsUnavailableAtThatStep) {
  EnvServerOptions options;
  options.min_step_s = 3.0;  // the second step is under way for so long
  Engine engine(OneRoad(), options);
  EnvClientOptions patient = Impatient(GetParam());
  patient.deadline_s = 20.0;
  Session session(engine.Connect(), patient);
  ASSERT_TRUE(session.Step().ok());
  std::thread closing([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    engine.Stop();
  });
  const double start = Now();
  Status status;
  for (int i = 0; i < 3 && status.ok(); ++i) status = session.Step();
  closing.join();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), StartsWith("at step "));
  EXPECT_LT(Now() - start, 2.5);
}

// Nothing tells a pulled cable from a quiet peer but asking. The kernel asks, also while a trainer learns or a world
// steps for long.
TEST(FaultA, A9_TheKernelFindsAHalfOpenConnectionWithin30Seconds) {
  auto listener = *ListenTcp({"127.0.0.1", 0});
  const auto near_end = *ConnectTcp({"127.0.0.1", listener->port()}, 2.0);
  const auto far_end = *listener->Accept(2.0);
  int ends = 0;
  for (int socket = 0; socket < 256; ++socket) {
    sockaddr_in local = {}, remote = {};
    socklen_t local_size = sizeof(local), remote_size = sizeof(remote);
    if (::getsockname(socket, reinterpret_cast<sockaddr*>(&local), &local_size) != 0) continue;
    if (::getpeername(socket, reinterpret_cast<sockaddr*>(&remote), &remote_size) != 0) continue;
    if (ntohs(local.sin_port) != listener->port() && ntohs(remote.sin_port) != listener->port()) continue;
    ++ends;
    const auto option = [&](int level, int name) {
      int value = -1;
      socklen_t size = sizeof(value);
      ::getsockopt(socket, level, name, &value, &size);
      return value;
    };
    EXPECT_EQ(option(SOL_SOCKET, SO_KEEPALIVE), 1);
    EXPECT_LE(option(IPPROTO_TCP, TCP_KEEPIDLE) + option(IPPROTO_TCP, TCP_KEEPINTVL) * option(IPPROTO_TCP, TCP_KEEPCNT),
              30);
    EXPECT_GT(option(IPPROTO_TCP, TCP_USER_TIMEOUT), 0);
    EXPECT_LE(option(IPPROTO_TCP, TCP_USER_TIMEOUT), 30000);
  }
  EXPECT_EQ(ends, 2);
}

class FaultAGreedy : public ::testing::TestWithParam<Way> {};
INSTANTIATE_TEST_SUITE_P(Each, FaultAGreedy, ::testing::Values(Way::kText1, Way::kTcp), WayName);

TEST_P(FaultAGreedy, A10_ATrainerThatReadsNothingIsDroppedAtTheWriteDeadline) {
  EnvServerOptions options;
  options.write_s = 0.3;
  options.grace_s = 0.05;
  const Engine engine(LargeWorld(GetParam()), options);
  const auto greedy = engine.Connect();
  AskForMuch(*greedy, GetParam(), engine.spec());
  ASSERT_TRUE(Soon([&] { return engine.steps() > 0; }));
  const double start = Now();
  std::unique_ptr<EnvClient> next;
  EXPECT_TRUE(Soon([&] {
    EnvClientOptions patient = Impatient(GetParam());
    patient.deadline_s = 5.0;
    auto client = EnvClient::Open(engine.Connect(), patient);
    if (client.ok()) next = std::move(*client);
    return next != nullptr;
  }));
  EXPECT_LT(Now() - start, 4.0);
}

TEST_P(FaultAOverProtocol2, A11_APauseOfTheEngineStopsTheTrainersDeadline) {
  TickingEngine engine(OneRoad());
  Session session(engine.Connect(), Impatient(GetParam()));
  ASSERT_TRUE(session.Step().ok());
  engine.PauseFor(1.2);
  const double start = Now();
  // The step before the pause, and the one that meets it.
  while (engine.pausing()) {
    const Status status = session.Step();
    ASSERT_TRUE(status.ok()) << status.message();
  }
  EXPECT_GE(Now() - start, 1.1) << "three times the deadline";
  EXPECT_TRUE(session.Step().ok());
}

/// A world that hangs once it is told to, until it is let go.
class HangingWorld final : public PlainWorld {
 public:
  HangingWorld() : PlainWorld(*Space::Box(0, 1, {2}), *Space::Discrete(2)) {}
  void Step(std::span<Batch> batches) override {
    while (hang) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    PlainWorld::Step(batches);
  }
  static inline std::atomic<bool> hang{false};
};

TEST_P(FaultAEachWay, A12_AnEngineThatHangsMeetsTheTrainersDeadline) {
  const Engine engine(std::make_unique<HangingWorld>(), {});
  Session session(engine.Connect(), Impatient(GetParam()));
  ASSERT_TRUE(session.Step().ok());
  HangingWorld::hang = true;
  const double start = Now();
  const Status status = session.Step();
  HangingWorld::hang = false;
  EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded);
  EXPECT_THAT(status.message(), AllOf(HasSubstr("at step 2"), HasSubstr("silent for 0.4 s")));
  EXPECT_LT(Now() - start, 2.0);
}

/// A connection on which a hanging engine sends nothing but PING after PING.
class Pinged final : public Transport {
 public:
  explicit Pinged(std::unique_ptr<Transport> inner) : inner_(std::move(inner)) {}
  Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
    Result<std::size_t> count = inner_->Read(into, std::min(timeout_s, 0.001));
    if (!count.ok() || *count > 0 || !HangingWorld::hang) return count;
    const std::vector<std::byte> ping = FrameBytes(FrameType::kPing, 0, "");
    std::memcpy(into.data(), ping.data(), ping.size());
    return ping.size();
  }
  Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) override {
    return HangingWorld::hang ? Result<std::size_t>(bytes.size()) : inner_->WriteSome(bytes, timeout_s);
  }
  void Close() override { inner_->Close(); }
  std::string peer() const override { return inner_->peer(); }

 private:
  std::unique_ptr<Transport> inner_;
};

TEST_P(FaultAOverProtocol2, A12_PingsOfAnEngineThatHangsGiveItNoMoreTime) {
  const Engine engine(std::make_unique<HangingWorld>(), {});
  Session session(std::make_unique<Pinged>(engine.Connect()), Impatient(GetParam()));
  ASSERT_TRUE(session.Step().ok());
  ASSERT_EQ(session.client().description().find("shared memory") != std::string::npos, GetParam() == Way::kShared);
  std::atomic<bool> answered{false};
  std::thread in_time([&] {  // the engine comes back far too late, so that the test ends however it goes
    for (const double end = Now() + 3.0; Now() < end && !answered;) std::this_thread::yield();
    HangingWorld::hang = false;
  });
  HangingWorld::hang = true;
  const Status status = session.Step();
  answered = true;
  in_time.join();
  EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded) << status.message();
  EXPECT_THAT(status.message(), HasSubstr("silent for 0.4 s"));
}

TEST(FaultA, A15_AForeignTokenOpensNothingAndAnOldOneNothingAnyMore) {
  const Engine engine;
  RawTrainer owner(engine.Connect());
  owner.Begin(engine.spec());
  const std::vector<int> all(kCopies, 1);
  owner.Ask(FrameType::kReset, 2, owner.ResetPayload(1, all));
  owner.transport().Close();
  std::string foreign = owner.resume;
  foreign.back() = foreign.back() == '0' ? '1' : '0';
  EXPECT_EQ(ResumeAnswer(engine, foreign), "AUTH_FAILED");
  RawTrainer back(engine.Connect());
  ASSERT_EQ(ResumeAnswer(back, owner.resume), "WELCOME") << "a stranger's attempt costs the owner nothing";
  back.blocks = owner.blocks;
  back.Ask(FrameType::kStep, 3, back.StepPayload({0, 0, 0, 0}, all));
  EXPECT_EQ(back.last_type, FrameType::kResult);
  back.Send(FrameType::kBye, 0, "");
  EXPECT_EQ(ResumeAnswer(engine, owner.resume), "AUTH_FAILED") << "after BYE there is nothing to resume";
  Session next(engine.Connect(), Impatient(Way::kTcp));
  EXPECT_TRUE(next.Step().ok());
}

TEST_P(FaultAEachWay, A16_AnEngineThatClosesForAnotherLevelEndsTheSession) {
  auto engine = std::make_unique<Engine>(OneRoad(), EnvServerOptions{});
  const int port = engine->port();
  int reconnects = 0;
  EnvClientOptions options = Impatient(GetParam());
  options.reconnect = [&]() -> Result<std::unique_ptr<Transport>> {
    ++reconnects;
    return ConnectTcp({"127.0.0.1", port}, 1.0);
  };
  Session session(engine->Connect(), options);
  ASSERT_TRUE(session.Step().ok());
  engine.reset();
  PlainWorld other(*Space::Box(0, 1, {2}), *Space::Discrete(3));  // as large as the road, but another world
  EnvServerOptions serving;
  serving.training_length = 10;
  auto server = *EnvServer::Create(other, *ListenTcp({"127.0.0.1", port}), serving);
  std::atomic<bool> stop{false};
  std::thread serve([&] { (void)server->ServeSession(stop); });
  const Status status = session.Step();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_EQ(reconnects, 0) << "GOAWAY is no accident";
  EXPECT_EQ(server->session_steps(), 0);
  if (GetParam() != Way::kText1) {
    EXPECT_THAT(status.message(), HasSubstr("ends the session: the engine "));
  }
  stop = true;
  serve.join();
}

// A token of the old world opens nothing in the new one.
TEST(FaultA, A16_AfterACrashTheTrainerDoesNotGoOnInAnotherWorld) {
  auto listener = *ListenTcp({"127.0.0.1", 0});
  const int port = listener->port();
  RawEngine old;
  std::thread peer([&] {
    old.Begin();
    (void)old.Next();
    old.Close();  // in the middle of a step, without a word
  });
  PlainWorld other(*Space::Box(-1, 1, {2}), *Space::Discrete(2));
  EnvServerOptions serving;
  serving.training_length = 10;
  auto server = *EnvServer::Create(other, std::move(listener), serving);
  std::atomic<bool> stop{false};
  std::thread serve([&] {
    while (!stop) (void)server->ServeSession(stop);
  });
  EnvClientOptions options = Impatient(Way::kTcp);
  options.reconnect = [&] { return ConnectTcp({"127.0.0.1", port}, 1.0); };
  Session session(old.Connect(), options);
  const Status status = session.Step();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_THAT(status.message(), HasSubstr("could not be taken up again"));
  EXPECT_EQ(server->session_steps(), 0);
  stop = true;
  peer.join();
  serve.join();
}

TEST_P(FaultAEachWay, A17_AJumpOfTheWallClockIsNotNoticed) {
  EnvServerOptions options;
  options.deadline_s = 1.0;
  const Engine engine(std::make_unique<HangingWorld>(), options);
  Session session(engine.Connect(), Impatient(GetParam()));
  for (const std::int64_t jump : {3600, -3600, 0}) {
    wall_clock_jump_s = jump;
    ASSERT_NEAR(static_cast<double>(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())),
                static_cast<double>(::time(nullptr) + jump), 2.0)
        << "the clock has jumped";
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(session.Step().ok()) << jump;
  }
  // And a wait that is under way when it jumps still ends in time.
  HangingWorld::hang = true;
  std::thread jumping([] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    wall_clock_jump_s = -3600;
  });
  const double start = Now();
  EXPECT_EQ(session.Step().code(), StatusCode::kDeadlineExceeded);
  EXPECT_GE(Now() - start, 0.39);
  EXPECT_LT(Now() - start, 2.0);
  jumping.join();
  HangingWorld::hang = false;
  wall_clock_jump_s = 0;
}

TEST_P(FaultAEachWay, A18_AnEngineThatStopsDuringAStepIsGoneWithin2SecondsAndItsPortIsFree) {
  EnvServerOptions options;
  options.min_step_s = 10.0;
  Engine engine(OneRoad(), options);
  EnvClientOptions patient = Impatient(GetParam());
  patient.deadline_s = 20.0;
  Session session(engine.Connect(), patient);
  ASSERT_TRUE(session.Step().ok());
  std::thread waiting([&] { (void)session.Step(); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const double start = Now();
  engine.Stop();
  EXPECT_LT(Now() - start, 2.0);
  const auto again = ListenTcp({"127.0.0.1", engine.port()});
  EXPECT_TRUE(again.ok()) << again.status().message();
  waiting.join();
  EXPECT_LT(Now() - start, 3.0);
}

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
  std::vector<std::string> capabilities;  // who comes back names them again (R27)
  if (GetParam() == Way::kShared) {
    capabilities = {"shm"};
    Hello hello;
    hello.capabilities = capabilities;
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
  ASSERT_EQ(ResumeAnswer(again, stale.resume, capabilities), "WELCOME");
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
  EXPECT_NE(ResumeAnswer(stranger, foreign, capabilities), "WELCOME");
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

}  // namespace
}  // namespace consac
