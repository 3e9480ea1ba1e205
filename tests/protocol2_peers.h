#pragma once
// Both ends of protocol 2 as tests want them: an engine on a thread, a trainer that is driven frame by frame, and an
// engine that is.

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "consac/protocol/protocol2.h"
#include "consac/server/env_client.h"
#include "tests/support.h"

namespace consac::testing {

using namespace protocol2;

inline constexpr std::int32_t kCopies = 4;  ///< worlds of an Engine unless it is told otherwise

/// An engine with some poles, or with any other world, that serves one session after another for one test.
class Engine {
 public:
  explicit Engine(EnvServerOptions options = {}, const char* world = "cartpole-v1", std::int32_t copies = kCopies)
      : Engine((*worlds::FindWorld(world))->create(copies), options) {}
  Engine(std::unique_ptr<VectorEnv> env, EnvServerOptions options) : env_(std::move(env)) {
    if (options.training_length == 0) options.training_length = 1000000;
    server_ = *EnvServer::Create(*env_, std::move(*ListenTcp({"127.0.0.1", 0})), options);
    thread_ = std::thread([this] {
      while (!stop_) last_ = server_->ServeSession(stop_);
    });
  }
  ~Engine() { Stop(); }
  /// Ends its session and closes its port.
  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    server_->Close("the engine closes");
  }
  std::unique_ptr<Transport> Connect() const { return *ConnectTcp({"127.0.0.1", port()}, 2.0); }
  int port() const { return server_->port(); }
  /// "tcp://127.0.0.1:PORT".
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(port()); }
  const EnvSpec& spec() const { return env_->spec(); }
  std::int64_t steps() const { return server_->session_steps(); }

 private:
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<EnvServer> server_;
  std::atomic<bool> stop_{false};
  Status last_;
  std::thread thread_;
};

inline std::vector<std::byte> FrameBytes(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
  std::vector<std::byte> bytes(kHeaderBytes);
  WriteHeader({type, false, static_cast<std::uint32_t>(payload.size()), 0, request, 0}, bytes.data());
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

inline std::vector<std::byte> FrameBytes(FrameType type, std::uint64_t request, std::string_view json) {
  return FrameBytes(type, request, std::as_bytes(std::span(json)));
}

/// A trainer that is driven frame by frame.
class RawTrainer {
 public:
  explicit RawTrainer(std::unique_ptr<Transport> transport)
      : transport_(std::move(transport)), reader_(kLargestFrame) {}

  void Send(std::span<const std::byte> bytes) { ASSERT_TRUE(transport_->Write(bytes, 2.0).ok()); }
  void Send(FrameType type, std::uint64_t request, std::string_view json) { Send(FrameBytes(type, request, json)); }
  /// The next frame; an empty one of type 0 when the connection has ended.
  Frame Next() {
    Frame frame;
    frame.header.type = static_cast<FrameType>(0);
    for (auto whole = reader_.Next(&frame); whole.ok() && !*whole; whole = reader_.Next(&frame)) {
      const auto count = transport_->Read(reader_.Writable(), 5.0);
      if (!count.ok() || *count == 0) return frame;
      reader_.Commit(*count);
    }
    return frame;
  }
  Transport& transport() { return *transport_; }

  /// HELLO and CONFIGURE; the behaviours are those of `spec`.
  void Begin(const EnvSpec& spec, std::string_view configure = "{}") {
    Send(FrameType::kHello, 0, EncodeHello({}));
    const Frame welcome = Next();
    ASSERT_EQ(welcome.header.type, FrameType::kWelcome);
    resume = ParseWelcome(welcome.payload)->resume;
    Send(FrameType::kConfigure, 1, configure);
    ASSERT_EQ(Next().header.type, FrameType::kSpec);
    blocks = Blocks(spec);
  }
  std::vector<std::byte> ResetPayload(std::uint64_t seed, std::vector<int> chosen) const {
    std::vector<std::byte> payload(blocks.options);
    std::memcpy(payload.data(), &kWithSeeds, sizeof(kWithSeeds));
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      payload[kActiveOffset + i] = static_cast<std::byte>(chosen[i]);
      const std::uint64_t own = seed + i;
      std::memcpy(payload.data() + blocks.seeds + i * sizeof(own), &own, sizeof(own));
    }
    return payload;
  }
  std::vector<std::byte> StepPayload(std::vector<std::int32_t> actions, std::vector<int> chosen) const {
    std::vector<std::byte> payload(blocks.step_bytes);
    for (std::size_t i = 0; i < chosen.size(); ++i) payload[kActiveOffset + i] = static_cast<std::byte>(chosen[i]);
    std::memcpy(payload.data() + blocks.behaviours[0].actions, actions.data(), actions.size() * sizeof(std::int32_t));
    return payload;
  }
  std::vector<std::byte> Ask(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    Send(FrameBytes(type, request, payload));
    const Frame frame = Next();
    EXPECT_EQ(frame.header.request, request);
    last_type = frame.header.type;
    std::vector<std::byte> answer(frame.payload.begin(), frame.payload.end());
    if (last_type == FrameType::kResult) WriteEngineTime(0.0, answer.data());  // no two are alike
    return answer;
  }
  std::string ErrorOf(FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    const std::vector<std::byte> answer = Ask(type, request, payload);
    return last_type == FrameType::kError ? ParseError(answer)->code : "no error";
  }

  Blocks blocks;
  std::string resume;
  FrameType last_type = FrameType::kHello;

 private:
  std::unique_ptr<Transport> transport_;
  FrameReader reader_;
};

/// An engine that is driven frame by frame: what it does wrong is up to the test. It offers one world with a box of two
/// observations and two choices.
class RawEngine {
 public:
  RawEngine() : listener_(*ListenTcp({"127.0.0.1", 0})), reader_(kLargestFrame) {
    message.env.behaviours.push_back(BehaviourSpec::Of("default", *Space::Box(-1, 1, {2}), *Space::Discrete(2), 1));
    message.training_length = 100;
    blocks = Blocks(message.env);
  }
  std::unique_ptr<Transport> Connect() const { return *ConnectTcp({"127.0.0.1", port()}, 2.0); }
  int port() const { return listener_->port(); }
  /// Waits for the trainer's connection, or one more of it: whether it came.
  bool Accept(double wait_s = 5.0) {
    transport_ = *listener_->Accept(wait_s);
    reader_ = FrameReader(kLargestFrame);
    return transport_ != nullptr;
  }
  /// The trainer's next frame; type 0 when it is gone.
  Frame Next() {
    Frame frame;
    frame.header.type = static_cast<FrameType>(0);
    for (auto whole = reader_.Next(&frame); whole.ok() && !*whole; whole = reader_.Next(&frame)) {
      const auto count = transport_->Read(reader_.Writable(), 5.0);
      if (!count.ok() || *count == 0) return frame;
      reader_.Commit(*count);
    }
    return frame;
  }
  void Send(std::span<const std::byte> bytes) { (void)transport_->Write(bytes, 2.0); }
  void Send(FrameType type, std::uint64_t request, std::string_view json) { Send(FrameBytes(type, request, json)); }
  /// A RESULT with observation (0.5, -0.5) and the given state; reward 1 unless an episode begins.
  std::vector<std::byte> ResultPayload(int state = kActive) const {
    std::vector<std::byte> payload(blocks.result_bytes);
    const float observation[2] = {0.5f, -0.5f};
    const double reward = state == (kFirst | kActive) ? 0.0 : 1.0;
    std::memcpy(payload.data() + blocks.behaviours[0].observations, observation, sizeof(observation));
    std::memcpy(payload.data() + blocks.behaviours[0].rewards, &reward, sizeof(reward));
    payload[blocks.behaviours[0].states] = static_cast<std::byte>(state);
    return payload;
  }
  /// HELLO, CONFIGURE and, with `reset`, RESET are answered as they should be.
  void Begin(bool reset = true) {
    ASSERT_TRUE(Accept());
    EXPECT_EQ(Next().header.type, FrameType::kHello);
    Welcome welcome;
    welcome.session = 1;
    welcome.resume = "of this session";
    Send(FrameType::kWelcome, 0, EncodeWelcome(welcome));
    EXPECT_EQ(Next().header.type, FrameType::kConfigure);
    Send(FrameType::kSpec, 1, EncodeSpec(message));
    if (!reset) return;
    EXPECT_EQ(Next().header.type, FrameType::kReset);
    Send(FrameBytes(FrameType::kResult, 2, ResultPayload(kFirst | kActive)));
  }
  void Close() { transport_->Close(); }

  SpecMessage message;
  Blocks blocks;

 private:
  std::unique_ptr<Listener> listener_;
  std::unique_ptr<Transport> transport_;
  FrameReader reader_;
};

}  // namespace consac::testing
