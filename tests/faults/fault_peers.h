#pragma once
// What the fault tests (docs/faults.md) share beside tests/protocol2_peers.h: the ways in which our two ends talk, a
// peer that vanishes without a word, an engine of text lines.

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>
#include <mutex>

#include "consac/base/hooks.h"
#include "consac/env/buffer.h"
#include "tests/protocol2_peers.h"

namespace consac::testing {

/// How a trainer of ours talks with an engine of ours.
enum class Way : std::uint8_t { kText1, kTcp, kShared };

/// "Text1", ...: the last part of a test's name.
inline std::string WayName(const ::testing::TestParamInfo<Way>& tested) {
  const char* names[] = {"Text1", "Tcp", "Shared"};
  return names[static_cast<int>(tested.param)];
}

/// One short of patience, so that the suite is quick.
inline EnvClientOptions Impatient(Way way) {
  EnvClientOptions options;
  options.deadline_s = 0.4;
  options.protocol = way == Way::kText1 ? Protocol::kText1 : Protocol::kProtocol2;
  options.shared_memory = way == Way::kShared;
  return options;
}

/// A session that has taken its first observation. One behaviour.
class Session {
 public:
  Session(std::unique_ptr<Transport> transport, const EnvClientOptions& options) {
    auto client = EnvClient::Open(std::move(transport), options);
    EXPECT_TRUE(client.ok()) << client.status().message();
    if (!client.ok()) return;
    client_ = std::move(*client);
    buffer_ = std::make_unique<BatchBuffer>(client_->spec().behaviours[0]);
    const Status reset = client_->Reset(1, {&batch(), 1});
    EXPECT_TRUE(reset.ok()) << reset.message();
  }
  Batch& batch() { return buffer_->batch(); }
  EnvClient& client() { return *client_; }
  /// One step with the first choice everywhere.
  Status Step() {
    buffer_->Advance();
    const BehaviourSpec& behaviour = client_->spec().behaviours[0];
    std::memset(batch().actions, 0, static_cast<std::size_t>(behaviour.slots) * behaviour.action_layout.row_bytes);
    return client_->Step({&batch(), 1}, MoreSteps::kYes);
  }

 private:
  std::unique_ptr<EnvClient> client_;
  std::unique_ptr<BatchBuffer> buffer_;
};

/// A connection that can break as when a process is killed: with RST, without a word.
class BrittleSocket final : public Transport {
 public:
  explicit BrittleSocket(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  }
  ~BrittleSocket() override { Close(); }
  Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
    timeval time = {static_cast<time_t>(timeout_s), 1000};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &time, sizeof(time));
    const ssize_t count = ::recv(socket_, into.data(), into.size(), 0);
    if (count > 0) return static_cast<std::size_t>(count);
    return Status{StatusCode::kUnavailable, "gone"};
  }
  Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double) override {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count >= 0) return static_cast<std::size_t>(count);
    return Status{StatusCode::kUnavailable, "gone"};
  }
  void Close() override {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  std::string peer() const override { return "brittle"; }
  /// Breaks the connection.
  void Reset() {
    const linger none = {1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &none, sizeof(none));
    Close();
  }

 private:
  int socket_;
};

/// What is logged as long as it lives. One at a time, and nothing of ours may be running when it comes and goes.
class LogLines {
 public:
  LogLines() {
    Hooks hooks;
    hooks.log = [](void* user, LogLevel, std::string_view line) {
      auto& self = *static_cast<LogLines*>(user);
      const std::lock_guard lock(self.guard_);
      self.lines_.emplace_back(line);
    };
    hooks.user = this;
    SetHooks(hooks);
  }
  ~LogLines() { SetHooks({}); }
  LogLines(const LogLines&) = delete;
  LogLines& operator=(const LogLines&) = delete;
  /// So far.
  std::vector<std::string> lines() {
    const std::lock_guard lock(guard_);
    return lines_;
  }

 private:
  std::mutex guard_;
  std::vector<std::string> lines_;
};

/// Writes text.
inline Status Say(Transport& transport, std::string_view text) {
  return transport.Write(std::as_bytes(std::span(text)), 2.0);
}

/// Everything that comes until the peer closes or `seconds` are over.
inline std::string Listen(Transport& transport, double seconds) {
  std::string heard;
  std::byte buffer[4096];
  for (const double end = Now() + seconds; Now() < end;) {
    const auto count = transport.Read(buffer, end - Now());
    if (!count.ok()) break;
    heard.append(reinterpret_cast<const char*>(buffer), *count);
  }
  return heard;
}

/// Writes byte by byte, `pause_s` apart, until all is out, nobody takes it any more or `over`. Bytes that went out.
inline std::size_t Trickle(Transport& transport, std::span<const std::byte> bytes, double pause_s,
                           const std::function<bool()>& over) {
  std::size_t sent = 0;
  for (; sent < bytes.size() && !over(); ++sent) {
    if (!transport.Write(bytes.subspan(sent, 1), 1.0).ok()) break;
    std::this_thread::sleep_for(std::chrono::duration<double>(pause_s));
  }
  return sent;
}

/// Waits for what another thread does; false when it has not within 5 s.
inline bool Soon(const std::function<bool()>& condition) {
  for (const double end = Now() + 5.0; Now() < end;) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

/// HELLO with a token to resume: the code of the answer, "WELCOME" when it is one that resumes, "new" when it does not.
inline std::string ResumeAnswer(RawTrainer& trainer, const std::string& token,
                                std::vector<std::string> capabilities = {}) {
  Hello hello;
  hello.resume = token;
  hello.capabilities = std::move(capabilities);
  trainer.Send(FrameType::kHello, 0, EncodeHello(hello));
  const Frame frame = trainer.Next();
  if (frame.header.type == FrameType::kWelcome) return ParseWelcome(frame.payload)->resumed ? "WELCOME" : "new";
  return frame.header.type == FrameType::kError ? ParseError(frame.payload)->code : "nothing";
}

/// The same over connections of its own, until the engine has noticed that the one before is gone.
inline std::string ResumeAnswer(const Engine& engine, const std::string& token) {
  std::string answer;
  for (int attempt = 0; attempt < 200; ++attempt) {
    RawTrainer trainer(engine.Connect());
    answer = ResumeAnswer(trainer, token);
    if (answer != "CAPACITY") break;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return answer;
}

/// One world with the spaces of the caller's choice that sends zeros and never ends.
class PlainWorld : public VectorEnv {
 public:
  PlainWorld(Space observation, Space action, std::int32_t copies = 1) {
    spec_.id = "plain-v0";
    spec_.behaviours.push_back(BehaviourSpec::Of("default", std::move(observation), std::move(action), copies));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override { Observe(batches[0]); }
  void Step(std::span<Batch> batches) override {
    ++stepped_;
    const auto rows = static_cast<std::size_t>(batches[0].rows());
    std::memset(batches[0].rewards, 0, rows * sizeof(float));
    std::memset(batches[0].terminated, 0, rows);
    std::memset(batches[0].truncated, 0, rows);
    Observe(batches[0]);
  }
  void Visit(Archive&) override {}
  /// Steps over all sessions.
  int stepped() const { return stepped_; }

 protected:
  EnvSpec& spec() { return spec_; }

 private:
  void Observe(Batch& batch) const {
    std::memset(batch.next_observations, 0,
                static_cast<std::size_t>(batch.rows()) * spec_.behaviours[0].observation_layout.row_bytes);
  }
  EnvSpec spec_;
  std::atomic<int> stepped_{0};
};

}  // namespace consac::testing
