// Both ends of a session against each other and against bad peers: every fault has its expected outcome.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <limits>
#include <thread>

#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "consac/server/env_server.h"

namespace consac {
namespace {

const std::atomic<bool> kNeverStop{false};

/// A world that counts: observation (episode, step), ends after three steps, reward is the action.
class Counter final : public VectorEnv {
 public:
  /// `rich`: it offers what text protocol 1 does not carry, too.
  explicit Counter(bool rich = false) {
    spec_.id = "counter-v0";
    spec_.behaviours.push_back(BehaviourSpec::Of("default", *Space::Box(0, 1000, {2}), *Space::Discrete(3), 1));
    spec_.behaviours[0].masks_actions = rich;
    if (rich) spec_.parameters = {{"gravity", 9.8}};
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override {
    episode_ = step_ = 0;
    Observe(batches[0].next_observations);
  }
  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    ++step_;
    batch.rewards[0] = static_cast<float>(*reinterpret_cast<const std::int32_t*>(batch.actions));
    batch.terminated[0] = step_ == 3 ? 1 : 0;
    batch.truncated[0] = 0;
    if (step_ == 3) {
      Observe(batch.final_observations);
      ++episode_;
      step_ = 0;
    }
    Observe(batch.next_observations);
  }
  void Visit(Archive&) override {}

 private:
  void Observe(std::byte* row) const {
    const float values[2] = {static_cast<float>(episode_), static_cast<float>(step_)};
    std::memcpy(row, values, sizeof(values));
  }
  EnvSpec spec_;
  int episode_ = 0, step_ = 0;
};

/// An engine of ours on a thread.
struct Engine {
  explicit Engine(EnvServerOptions options = {}, bool rich = false) : world(rich) {
    if (options.training_length == 0 && options.model_name.empty()) options.training_length = 7;
    options.protocol = Protocol::kText1;
    auto listener = ListenTcp({"127.0.0.1", 0});
    server = *EnvServer::Create(world, std::move(*listener), options);
    thread = std::thread([this] { status = server->ServeSession(stop); });
  }
  ~Engine() {
    stop = true;
    if (thread.joinable()) thread.join();
  }
  std::unique_ptr<Transport> Connect() const { return *ConnectTcp({"127.0.0.1", server->port()}, 2.0); }
  Status Finish() {
    thread.join();
    return status;
  }
  Counter world;
  std::unique_ptr<EnvServer> server;
  std::atomic<bool> stop{false};
  Status status;
  std::thread thread;
};

/// A hand-made engine or trainer: writes a script, byte by byte if asked, then closes or stays silent.
struct ScriptedPeer {
  ScriptedPeer() : listener(*ListenTcp({"127.0.0.1", 0})) {}
  std::unique_ptr<Transport> Connect() { return *ConnectTcp({"127.0.0.1", listener->port()}, 2.0); }
  void Say(std::string_view text, bool close) {
    if (transport == nullptr) transport = *listener->Accept(2.0);
    (void)transport->Write(std::as_bytes(std::span(text)), 1.0);
    if (close) transport->Close();
  }
  std::unique_ptr<Listener> listener;
  std::unique_ptr<Transport> transport;
};

Status OpenScripted(std::string_view text, bool close, EnvClientOptions options = {}) {
  ScriptedPeer peer;
  auto transport = peer.Connect();
  peer.Say(text, close);
  options.setup_timeout_s = 0.3;
  return EnvClient::Open(std::move(transport), options).status();
}

/// Runs `steps` steps with action 2 and checks what comes of each.
void WholeSession(EnvClient& client, int steps) {
  BatchBuffer buffer(client.spec().behaviours[0]);
  ASSERT_TRUE(client.Reset(0, {&buffer.batch(), 1}).ok());
  for (int i = 1; i <= steps; ++i) {
    buffer.Advance();
    Batch& batch = buffer.batch();
    *reinterpret_cast<std::int32_t*>(batch.actions) = 2;
    const Status status = client.Step({&batch, 1}, i == steps ? MoreSteps::kLast : MoreSteps::kYes);
    ASSERT_TRUE(status.ok()) << i << ": " << status.message();
    EXPECT_EQ(batch.rewards[0], 2.0f);
    EXPECT_EQ(batch.terminated[0], i % 3 == 0 ? 1 : 0);
    EXPECT_EQ(batch.truncated[0], 0);
    const auto* next = reinterpret_cast<const float*>(batch.next_observations);
    const auto* last = reinterpret_cast<const float*>(batch.final_observations);
    if (i % 3 == 0) {
      EXPECT_EQ(last[1], 3.0f);
    }
    if (i != steps || i % 3 != 0) {
      EXPECT_EQ(next[1], static_cast<float>(i % 3));
    }
  }
  client.Close();
}

TEST(Session, RunsToItsEndWithNewlinesWithoutAndWithAnAnsweredEnd) {
  for (const int kind : {0, 1, 2}) {
    EnvServerOptions options;
    options.training_length = 9;
    options.terminator = kind == 1 ? text1::Terminator::kNone : text1::Terminator::kNewline;
    options.wait_after_end = kind == 2;
    Engine engine(options);
    EnvClientOptions client_options;
    client_options.answer_done = kind == 2;
    auto client = EnvClient::Open(engine.Connect(), client_options);
    ASSERT_TRUE(client.ok()) << client.status().message();
    EXPECT_EQ((*client)->request().training_length, 9);
    WholeSession(**client, 9);
    const Status status = engine.Finish();
    EXPECT_TRUE(status.ok()) << status.message();
    EXPECT_EQ(engine.server->session_steps(), 9);
  }
}

TEST(Server, WhatTextProtocol1DoesNotCarryIsSaid) {
  static std::string told;
  Hooks hooks;
  hooks.log = [](void*, LogLevel level, std::string_view line) {
    if (level == LogLevel::kWarning) told += line;
  };
  SetHooks(hooks);
  for (const bool rich : {false, true}) {
    told.clear();
    EnvServerOptions options;
    options.training_length = 9;
    Engine engine(options, rich);
    auto client = EnvClient::Open(engine.Connect(), {});
    ASSERT_TRUE(client.ok()) << client.status().message();
    WholeSession(**client, 9);
    EXPECT_TRUE(engine.Finish().ok());
    EXPECT_EQ(
        told,
        rich ? "the trainer speaks text protocol 1, which does not carry what is offered here: action masks (it may "
               "choose what is not legal) and environment parameters (all are at their defaults); protocol 2 does, "
               "which this engine was told not to speak"
             : "");
  }
  SetHooks(Hooks{});
}

TEST(Server, ATrainerThatLeavesEarlyIsNamedWithItsSteps) {
  Engine engine;
  auto client = EnvClient::Open(engine.Connect(), {});
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(0, {&buffer.batch(), 1}).ok());
  ASSERT_TRUE((*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes).ok());
  (*client)->Close();
  const Status status = engine.Finish();
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_NE(status.message().find("1 of 7 steps"), std::string::npos) << status.message();
}

TEST(Server, ABadActionEndsTheSessionWithOneLineToTheTrainer) {
  Engine engine;
  auto transport = engine.Connect();
  const std::string_view bad = "9\n";
  ASSERT_TRUE(transport->Write(std::as_bytes(std::span(bad)), 1.0).ok());
  std::string heard;
  std::byte buffer[4096];
  for (auto count = transport->Read(buffer, 2.0); count.ok() && *count > 0; count = transport->Read(buffer, 2.0)) {
    heard.append(reinterpret_cast<const char*>(buffer), *count);
  }
  EXPECT_NE(heard.find("error: action '9'"), std::string::npos) << heard;
  EXPECT_EQ(engine.Finish().code(), StatusCode::kProtocol);
}

TEST(Server, ASecondTrainerIsTurnedAwayWhileTheFirstGoesOn) {
  Engine engine;
  auto client = EnvClient::Open(engine.Connect(), {});
  ASSERT_TRUE(client.ok());
  const Status second = EnvClient::Open(engine.Connect(), {}).status();
  EXPECT_NE(second.message().find("another trainer"), std::string::npos) << second.message();
  WholeSession(**client, 7);
  EXPECT_TRUE(engine.Finish().ok());
}

TEST(Server, ASilentTrainerIsADeadline) {
  EnvServerOptions options;
  options.training_length = 7;
  options.deadline_s = 0.2;
  Engine engine(options);
  auto transport = engine.Connect();
  EXPECT_EQ(engine.Finish().code(), StatusCode::kDeadlineExceeded);
}

TEST(Server, PollNeverWaitsAndServesAWholeSession) {
  Counter world;
  auto listener = ListenTcp({"127.0.0.1", 0});
  EnvServerOptions options;
  options.protocol = Protocol::kText1;
  options.training_length = 9;
  auto server = *EnvServer::Create(world, std::move(*listener), options);
  const double start = Now();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(server->Poll().ok());
  EXPECT_LT(Now() - start, 1.0);
  std::atomic<bool> over{false};
  std::thread trainer([&] {
    auto client = EnvClient::Open(*ConnectTcp({"127.0.0.1", server->port()}, 2.0), {});
    ASSERT_TRUE(client.ok());
    WholeSession(**client, 9);
    over = true;
  });
  while (!over) ASSERT_TRUE(server->Poll().ok());
  trainer.join();
  server->Close("the test is over");
  server->Close("the test is over");
  EXPECT_EQ(server->Poll().code(), StatusCode::kFailedPrecondition);
}

// The trainer asks as fast as it is answered: then every tick of the engine is one step of the world.
TEST(Server, PollTakesOneStepOfTheWorldATick) {
  Counter world;
  EnvServerOptions options;
  options.protocol = Protocol::kText1;
  options.training_length = 100;
  auto server = *EnvServer::Create(world, std::move(*ListenTcp({"127.0.0.1", 0})), options);
  auto trainer = *ConnectTcp({"127.0.0.1", server->port()}, 2.0);
  ASSERT_TRUE(server->Poll().ok());
  ASSERT_TRUE(server->Poll().ok());
  for (int step = 1; step <= 20; ++step) {
    const std::string_view action = "1\n";
    ASSERT_TRUE(trainer->Write(std::as_bytes(std::span(action)), 1.0).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ASSERT_TRUE(server->Poll().ok());
    EXPECT_EQ(server->session_steps(), step);
  }
}

// A number that is none is the world's fault: its engine says so and ends the session, and sends nothing of it.
TEST(Server, NaNIsNeverSent) {
  class Broken final : public VectorEnv {
   public:
    const EnvSpec& spec() const override { return counter_.spec(); }
    void Reset(std::uint64_t seed, std::span<Batch> batches) override { counter_.Reset(seed, batches); }
    void Step(std::span<Batch> batches) override {
      counter_.Step(batches);
      batches[0].rewards[0] = std::numeric_limits<float>::quiet_NaN();
    }
    void Visit(Archive&) override {}

   private:
    Counter counter_;
  } world;
  EnvServerOptions options;
  options.protocol = Protocol::kText1;
  options.training_length = 100;
  auto server = *EnvServer::Create(world, std::move(*ListenTcp({"127.0.0.1", 0})), options);
  Status served;
  std::thread engine([&] { served = server->ServeSession(kNeverStop); });
  auto client = EnvClient::Open(*ConnectTcp({"127.0.0.1", server->port()}, 2.0), {});
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(0, {&buffer.batch(), 1}).ok());
  const Status step = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
  engine.join();
  EXPECT_EQ(served.code(), StatusCode::kNonFinite);
  EXPECT_NE(step.message().find("the reward is nan"), std::string::npos) << step.message();
}

TEST(Client, ABusyEngineSaysSo) {
  const Status status = OpenScripted("busy: another trainer is connected to this engine\n", false);
  EXPECT_EQ(status.code(), StatusCode::kUnavailable);
  EXPECT_EQ(status.message().find("no CONSAC engine"), std::string::npos) << status.message();
}

TEST(Client, ASetupThatIsJoinedToAnObservationIsHintedAt) {
  const Status status = OpenScripted("D#3#0#B#2#0,0,40,40#100010,30#0#0\n", false);
  EXPECT_NE(status.message().find("0.05 s"), std::string::npos) << status.message();
}

TEST(Client, AnEndBeforeTheFirstStepIsPassedOver) {
  ScriptedPeer peer;
  auto transport = peer.Connect();
  peer.Say("D#3#0#B#2#0,0,40,40#100\n7,7#1#1\n10,20#0#0\n", false);
  auto client = EnvClient::Open(std::move(transport), {});
  ASSERT_TRUE(client.ok()) << client.status().message();
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  ASSERT_TRUE((*client)->Reset(0, {&buffer.batch(), 1}).ok());
  EXPECT_EQ(reinterpret_cast<const float*>(buffer.batch().next_observations)[0], 10.0f);
}

TEST(Server, AFrameBoundEngineKeepsItsRate) {
  EnvServerOptions options;
  options.training_length = 7;
  options.min_step_s = 0.02;
  Engine engine(options);
  auto client = EnvClient::Open(engine.Connect(), {});
  const double start = Now();
  WholeSession(**client, 7);
  EXPECT_GE(Now() - start, 6 * 0.02);
}

TEST(Server, WorldsThatTheProtocolCannotCarryAreRefused) {
  Counter world;
  EnvServerOptions nothing_asked;
  EXPECT_FALSE(EnvServer::Create(world, std::move(*ListenTcp({"127.0.0.1", 0})), nothing_asked).ok());
  EnvServerOptions hash;
  hash.protocol = Protocol::kText1;
  hash.training_length = 1;
  hash.model_name = "a#b";
  EXPECT_FALSE(EnvServer::Create(world, std::move(*ListenTcp({"127.0.0.1", 0})), hash).ok());
}

TEST(Client, OtherServicesAreToldApartByTheirFirstBytes) {
  const Status status = OpenScripted("SSH-2.0-OpenSSH_9.2\r\n", false);
  EXPECT_EQ(status.code(), StatusCode::kProtocol);
  EXPECT_NE(status.message().find("SSH-2.0"), std::string::npos);
  const Status unasked = OpenScripted("\xC0NSC\xff\xff\xff\xff", false);
  EXPECT_EQ(unasked.code(), StatusCode::kProtocol) << unasked.message();
  EXPECT_NE(unasked.message().find("\\xc0NSC\\xff"), std::string::npos) << unasked.message();
  EnvClientOptions told;
  told.protocol = Protocol::kText1;
  EXPECT_EQ(OpenScripted("\xC0NSC\x02", false, told).code(), StatusCode::kFailedPrecondition) << "the caller's choice";
  EXPECT_EQ(OpenScripted("", false).code(), StatusCode::kDeadlineExceeded);
  EXPECT_EQ(OpenScripted("", true).code(), StatusCode::kUnavailable);
  EXPECT_EQ(OpenScripted("D#3#0#B#2#0,0,40#10\n", false).code(), StatusCode::kProtocol);
  EXPECT_EQ(OpenScripted(std::string_view("D#3#0#B#1#0,1#10\0\n", 18), false).code(), StatusCode::kProtocol);
}

// The engine dies after every byte of its half of a session: always an error that says so, never a hang.
TEST(Client, AnEngineThatDiesAtAnyByteIsAnError) {
  const std::string script = "D#3#0#B#2#0,0,40,40#100\n10,20#0#0\n11,20#1#0\n";
  for (std::size_t length = 0; length < script.size(); ++length) {
    ScriptedPeer peer;
    auto transport = peer.Connect();
    peer.Say(std::string_view(script).substr(0, length), true);
    EnvClientOptions options;
    options.setup_timeout_s = options.deadline_s = 2.0;
    auto client = EnvClient::Open(std::move(transport), options);
    if (!client.ok()) continue;
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    Status status = (*client)->Reset(0, {&buffer.batch(), 1});
    for (int i = 0; i < 3 && status.ok(); ++i) {
      buffer.Advance();
      status = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
    }
    EXPECT_EQ(status.code(), StatusCode::kUnavailable) << length << ": " << status.message();
  }
}

TEST(Client, BadObservationsAreNamedWithTheirStep) {
  const struct {
    const char* observation;
    StatusCode code;
  } cases[] = {{"11,nan#1#0\n", StatusCode::kNonFinite},
               {"11,1e999#1#0\n", StatusCode::kNonFinite},
               {"11#1#0\n", StatusCode::kProtocol},
               {"11,20#1#7\n", StatusCode::kProtocol},
               {"garbage\n", StatusCode::kProtocol}};
  for (const auto& entry : cases) {
    ScriptedPeer peer;
    auto transport = peer.Connect();
    peer.Say(std::string("D#3#0#B#2#0,0,40,40#100\n10,20#0#0\n") + entry.observation, false);
    auto client = EnvClient::Open(std::move(transport), {});
    ASSERT_TRUE(client.ok());
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    ASSERT_TRUE((*client)->Reset(0, {&buffer.batch(), 1}).ok());
    const Status status = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
    EXPECT_EQ(status.code(), entry.code) << status.message();
    EXPECT_TRUE(status.message().starts_with("at step 1: 127.0.0.1:")) << status.message();
  }
}

TEST(Client, SilenceIsADeadlineAndStopEndsAWait) {
  ScriptedPeer peer;
  auto transport = peer.Connect();
  peer.Say("D#3#0#B#2#0,0,40,40#100\n", false);
  EnvClientOptions options;
  options.deadline_s = 0.2;
  std::atomic<bool> stop{false};
  options.stop = &stop;
  auto client = EnvClient::Open(std::move(transport), options);
  BatchBuffer buffer((*client)->spec().behaviours[0]);
  EXPECT_EQ((*client)->Reset(0, {&buffer.batch(), 1}).code(), StatusCode::kDeadlineExceeded);
  stop = true;
  EXPECT_EQ((*client)->Reset(0, {&buffer.batch(), 1}).code(), StatusCode::kCancelled);
}

TEST(Client, AnEngineThatWaitsAfterAnEndIsHintedAt) {
  static std::string logged;
  logged.clear();
  Hooks hooks;
  hooks.log = [](void*, LogLevel, std::string_view line) { logged += line; };
  SetHooks(hooks);
  EnvServerOptions engine_options;
  engine_options.training_length = 9;
  engine_options.wait_after_end = true;
  {
    Engine engine(engine_options);
    EnvClientOptions options;
    options.after_end_s = 0.1;
    options.deadline_s = 0.5;
    auto client = EnvClient::Open(engine.Connect(), options);
    BatchBuffer buffer((*client)->spec().behaviours[0]);
    Status status = (*client)->Reset(0, {&buffer.batch(), 1});
    for (int i = 0; i < 3 && status.ok(); ++i) status = (*client)->Step({&buffer.batch(), 1}, MoreSteps::kYes);
    EXPECT_EQ(status.code(), StatusCode::kDeadlineExceeded);
    (*client)->Close();
  }
  SetHooks({});
  EXPECT_NE(logged.find("--answer-done"), std::string::npos);
}

}  // namespace
}  // namespace consac
