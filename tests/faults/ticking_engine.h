#pragma once
// An engine that lives in its host's ticks, and a trainer that asks for much and reads nothing.

#include <algorithm>

#include "tests/faults/fault_peers.h"

namespace consac::testing {

/// A world whose answers are large.
inline std::unique_ptr<VectorEnv> LargeWorld(Way way) {
  return std::make_unique<PlainWorld>(*Space::Box(0, 1, {way == Way::kText1 ? 60000 : 500000}), *Space::Discrete(2));
}

/// Asks for some 100 MB of answers.
inline void AskForMuch(Transport& transport, Way way, const EnvSpec& spec) {
  if (way == Way::kText1) {
    std::string actions;
    for (int i = 0; i < 2000; ++i) actions += "1\n";
    (void)Say(transport, actions);
    return;
  }
  RawTrainer frames(nullptr);
  frames.blocks = Blocks(spec);
  std::vector<std::byte> all;
  const auto add = [&](FrameType type, std::uint64_t request, std::span<const std::byte> payload) {
    const std::vector<std::byte> frame = FrameBytes(type, request, payload);
    all.insert(all.end(), frame.begin(), frame.end());
  };
  const std::string hello = EncodeHello({});
  add(FrameType::kHello, 0, std::as_bytes(std::span(hello)));
  add(FrameType::kConfigure, 1, std::as_bytes(std::span("{}", 2)));
  add(FrameType::kReset, 2, frames.ResetPayload(1, {1}));
  for (std::uint64_t i = 3; i < 50; ++i) add(FrameType::kStep, i, frames.StepPayload({0}, {1}));
  (void)transport.Write(all, 2.0);
}

/// An engine whose host calls Poll once a tick, and pauses it now and then.
class TickingEngine {
 public:
  explicit TickingEngine(std::unique_ptr<VectorEnv> env, EnvServerOptions options = {}) : env_(std::move(env)) {
    options.training_length = 1000000;
    server_ = *EnvServer::Create(*env_, *ListenTcp({"127.0.0.1", 0}), options);
    thread_ = std::thread([this] { Tick(); });
  }
  ~TickingEngine() {
    stop_ = true;
    thread_.join();
  }
  std::unique_ptr<Transport> Connect() const { return *ConnectTcp({"127.0.0.1", server_->port()}, 2.0); }
  void PauseFor(double seconds) { pause_s_ = seconds; }
  bool pausing() const { return pause_s_ > 0.0; }
  /// Of Poll, the one under way included.
  double longest_tick_s() const {
    const double began = tick_began_;
    return std::max(longest_.load(), began > 0.0 ? Now() - began : 0.0);
  }
  /// Sessions that Poll has reported as broken.
  int broken() const { return broken_; }
  const EnvSpec& spec() const { return env_->spec(); }
  std::int64_t steps() const { return server_->session_steps(); }

 private:
  void Tick() {
    while (!stop_) {
      if (const double pause_s = pause_s_; pause_s > 0.0) {
        server_->SetPaused(true);
        std::this_thread::sleep_for(std::chrono::duration<double>(pause_s));
        server_->SetPaused(false);
        pause_s_ = 0.0;
      }
      const double start = Now();
      tick_began_ = start;
      if (!server_->Poll().ok()) ++broken_;
      tick_began_ = 0.0;
      longest_ = std::max(longest_.load(), Now() - start);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<EnvServer> server_;
  std::atomic<bool> stop_{false};
  std::atomic<int> broken_{0};
  std::atomic<double> pause_s_{0.0}, longest_{0.0}, tick_began_{0.0};
  std::thread thread_;
};

}  // namespace consac::testing
