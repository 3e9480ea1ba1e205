#pragma once
// All places at an engine: whose turn it is, and where a further trainer may sit down. Who is let in is decided at the
// door (env_server.cpp). Private to core/server.

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/seat.h"

namespace consac {

/// At least one seat; never fewer than there have been.
class Seats {
 public:
  /// The first seat has the host's `env`; further ones have worlds of options.make_env. All three outlive it.
  Seats(VectorEnv& env, const EnvServerOptions& options, Farewells& farewells);

  /// Sessions that have a connection.
  std::size_t sessions() const;
  /// Whether a session that lost its connection may still be taken up.
  bool awaited() const;
  /// Of all sessions that count; for any thread.
  std::int64_t steps() const { return steps_.load(std::memory_order_relaxed); }
  void SetPaused(bool paused);

  /// Up to one step of each session's worlds; the first error. Waits up to `wait_s` where `sessions`, those there were
  /// when the tick began, is 1, and a little for one of several, each in its turn.
  Status Poll(double wait_s, std::size_t sessions);
  /// What is due in each session. False when there was nothing to do. `latest`: how the latest one to end has ended.
  bool PumpAll(double timeout_s, Status* latest);
  /// Waits a little for the next of several sessions.
  bool PumpInTurn(Status* latest);
  void EndAll(const Status& why);

  /// Whether all seats are taken, and no further one can be made.
  bool full() const { return sessions() == seats_.size() && !CanMakeRoom(); }
  /// Asks each session whether its trainer has left.
  void LookForTrainers();
  /// The seat of the session that HELLO takes up; null: nobody's.
  Seat* Owned(const protocol2::Hello& hello) const;
  /// Nobody's, rather than one more where worlds can be made and memory is there for them, one that a mute trainer must
  /// give up, or one whose trainer may come back; null when there is none.
  Seat* Free();

 private:
  bool CanMakeRoom() const;
  Seat* Mute();

  const EnvServerOptions& options_;
  Farewells& farewells_;
  std::atomic<std::int64_t> steps_{0};
  std::vector<std::unique_ptr<Seat>> seats_;
  std::size_t turn_ = 0;
};

}  // namespace consac
