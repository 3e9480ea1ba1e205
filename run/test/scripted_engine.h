#pragma once
// What the tests of engines share: their runs, and an engine made of lines.

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "consac/transport/transport.h"
#include "small_run.h"

namespace consac::run {

/// A run on an engine, which says how long it is.
inline RunConfig EngineRun(const std::string& directory, const std::string& url) {
  RunConfig config = SmallRun(directory, "engine");
  config.world = url;
  config.steps = -1;
  config.connect_timeout_s = 5.0;
  config.deadline_s = 5.0;
  config.lockstep = true;  // as in process, to the bit
  return config;
}

/// The same without a name of its own, so that the engine's counts.
inline RunConfig Nameless(const std::string& directory, const std::string& url) {
  RunConfig config = EngineRun(directory, url);
  config.name = "";
  return config;
}

/// An engine made of lines: says each of `messages` when the trainer has answered the one before, then does `end`.
class ScriptedEngine {
 public:
  enum class End { kClose, kStaySilent };
  ScriptedEngine(std::vector<std::string> messages, End end)
      : listener_(*ListenTcp({"127.0.0.1", 0})), messages_(std::move(messages)), end_(end) {
    thread_ = std::thread([this] { Serve(); });
  }
  ~ScriptedEngine() {
    stop_ = true;
    thread_.join();
  }
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(listener_->port()); }

 private:
  void Serve() {
    std::unique_ptr<Transport> trainer;
    while (trainer == nullptr && !stop_) trainer = std::move(*listener_->Accept(0.05));
    if (trainer == nullptr) return;
    std::byte answer[256];
    for (std::size_t i = 0; i < messages_.size() && !stop_; ++i) {
      const std::string line = messages_[i] + "\n";
      if (!trainer->Write(std::as_bytes(std::span(line)), 5.0).ok()) return;
      if (i == 0) continue;  // the setup is not answered
      Result<std::size_t> count = std::size_t{0};
      while (!stop_ && count.ok() && *count == 0) count = trainer->Read(answer, 0.05);
      if (!count.ok()) return;
    }
    while (end_ == End::kStaySilent && !stop_) (void)trainer->Read(answer, 0.05);
    trainer->Close();
  }

  std::unique_ptr<Listener> listener_;
  std::vector<std::string> messages_;
  End end_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// `config` on `engine`. Names the protocol: to find it out a trainer waits 0.1 s for the first line, which may come
/// later on a busy machine.
inline RunConfig On(const ScriptedEngine& engine, RunConfig config) {
  config.world = engine.url();
  config.protocol = "text1";
  return config;
}

inline RunConfig EngineRun(const std::string& directory, const ScriptedEngine& engine) {
  return On(engine, EngineRun(directory, engine.url()));
}
inline RunConfig Nameless(const std::string& directory, const ScriptedEngine& engine) {
  return On(engine, Nameless(directory, engine.url()));
}

/// Why a training that must fail does.
inline Status FailureWith(const RunConfig& config) {
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_FALSE(summary.ok());
  return summary.status();
}

/// A small trained road model in `directory`.
inline std::string TrainRoad(const std::string& directory, const std::string& name) {
  RunConfig config = SmallRun(directory, name);
  config.steps = 256;
  const Result<RunSummary> summary = Train(config, kNeverStop);
  EXPECT_TRUE(summary.ok()) << summary.status().message();
  return summary.ok() ? summary->models[0].path : "";
}

}  // namespace consac::run
