#pragma once
// What tests across parts share: a served world on a thread, a scratch folder (folder.h), the road's accuracy, a
// counter of allocations (tests/allocation_counter.cpp).

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "consac/policy/policy.h"
#include "consac/server/env_server.h"
#include "tests/folder.h"
#include "worlds/registry.h"

namespace consac::testing {

/// For who trains until it ends: nothing stops it.
inline const std::atomic<bool> kUntilItEnds{false};

/// Serves a built-in world over TCP loopback on a thread of its own until destroyed.
class ServedWorld {
 public:
  /// Opens a free port and waits for trainers, one session after another.
  ServedWorld(const std::string& world, const EnvServerOptions& options)
      : ServedWorld((*worlds::FindWorld(world))->create(1), options) {}
  /// The same with a world of the caller's, on a port of its choice.
  ServedWorld(std::unique_ptr<VectorEnv> env, const EnvServerOptions& options, int port = 0) : env_(std::move(env)) {
    auto listener = ListenTcp({"127.0.0.1", port});
    auto server = EnvServer::Create(*env_, std::move(*listener), options);
    server_ = std::move(*server);
    thread_ = std::thread([this] {
      while (!stop_) (void)server_->ServeSession(stop_);
    });
  }
  ~ServedWorld() {
    stop_ = true;
    thread_.join();
  }
  /// "tcp://127.0.0.1:PORT".
  std::string url() const { return "tcp://127.0.0.1:" + std::to_string(server_->port()); }
  /// The port.
  int port() const { return server_->port(); }
  /// Steps of its present or latest sessions.
  std::int64_t steps() const { return server_->session_steps(); }

 private:
  std::unique_ptr<VectorEnv> env_;
  std::unique_ptr<EnvServer> server_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// Share of the 1,640 states of the road in which actor and coin differ where the model steps nearer to the coin.
inline double RoadAccuracy(Policy& policy) {
  Rng rng(0, 0);
  int nearer = 0, states = 0;
  for (int actor = 0; actor <= 40; ++actor) {
    for (int coin = 0; coin <= 40; ++coin) {
      if (actor == coin) continue;
      const float observation[2] = {static_cast<float>(actor), static_cast<float>(coin)};
      std::int32_t action = 0;
      policy.Act(reinterpret_cast<const std::byte*>(observation), nullptr, 1, ActionMode::kDeterministic, rng,
                 reinterpret_cast<std::byte*>(&action));
      const int next = actor + action - 1;
      nearer += next >= 0 && next <= 40 && std::abs(next - coin) < std::abs(actor - coin) ? 1 : 0;
      ++states;
    }
  }
  return static_cast<double>(nearer) / states;
}

/// Heap allocations of this process so far, by any thread.
std::int64_t AllocationCount();

}  // namespace consac::testing
