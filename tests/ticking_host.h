#pragma once
// A built-in world in the ticks of an engine that serves it: what tests across parts put behind a connection.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "engines/host/test/ticked_engine.h"

namespace consac::testing {

/// An engine that ticks on a thread of its own and waits for its trainer within a tick, or not.
class TickingHost {
 public:
  static constexpr std::int64_t kSteps = 4096;  ///< of a training
  static constexpr double kPatience = 30.0;     ///< s, for what never comes

  TickingHost(const char* world, std::int32_t copies, int period, double wait_s,
              std::optional<host::Goals> goals = std::nullopt) {
    host::ServeOptions options;
    options.endpoint.port = 0;
    options.server.training_length = kSteps;
    engine_ = std::make_unique<TickedEngine>((*worlds::FindWorld(world))->create(copies), period, false, goals);
    driver_ = *host::Serve(engine_->world(), options);
    thread_ = std::thread([this, wait_s] {
      while (!stop_) {
        in_step_ = engine_->world().cue() == host::Cue::kAct;
        if (in_step_ && held_) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
          continue;
        }
        (void)engine_->Tick(*driver_, wait_s);
        finished_ = driver_->finished();
        if (wait_s == 0.0) std::this_thread::yield();
      }
    });
  }
  ~TickingHost() {
    finished_ = true;
    Stop();
  }
  /// Whether the training ended in order, as the engine sees it soon.
  bool Stop() {
    for (const double until = Now() + kPatience; !finished_ && Now() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return finished_;
  }
  /// Steps that begin from now on do not end until it is called with false.
  void Hold(bool held) { held_ = held; }
  void AwaitStep() const {
    for (const double until = Now() + kPatience; !in_step_ && Now() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ASSERT_TRUE(in_step_);
  }
  const EnvSpec& spec() const { return engine_->world().spec(); }
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(driver_->port()); }

 private:
  std::unique_ptr<TickedEngine> engine_;
  std::unique_ptr<host::Driver> driver_;
  std::atomic<bool> stop_{false}, finished_{false}, held_{false}, in_step_{false};
  std::thread thread_;
};

}  // namespace consac::testing
