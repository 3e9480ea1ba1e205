#pragma once
// One trainer's session at the engine's end, in either protocol. EnvServer drives whichever it has. Private to
// core/server.

#include <atomic>
#include <memory>
#include <span>

#include "consac/protocol/protocol2.h"
#include "consac/server/env_server.h"
#include "server/farewells.h"

namespace consac {

/// Steps of one session, and with them those of all sessions, which any thread may read.
class StepCount {
 public:
  explicit StepCount(std::atomic<std::int64_t>& of_all) : of_all_(of_all) {}
  void Add(std::int64_t steps) {
    session_ += steps;
    of_all_.fetch_add(steps, std::memory_order_relaxed);
  }
  void Restart() { Add(-session_); }
  std::int64_t session() const { return session_; }

 private:
  std::atomic<std::int64_t>& of_all_;
  std::int64_t session_ = 0;
};

/// What a session works on; outlives it.
struct SessionHost {
  VectorEnv& env;
  const EnvServerOptions& options;
  StepCount& steps;
  Farewells& farewells;  ///< of connections that end with an ERROR
};

/// One trainer's session.
class ServerSession {
 public:
  virtual ~ServerSession() = default;
  /// Does what is due, waiting at most `timeout_s` for the trainer. False when there was nothing to do. An error ends
  /// the connection.
  virtual Result<bool> Pump(double timeout_s) = 0;
  /// Closes the connection and says what the session came to.
  virtual Status End(const Status& why) = 0;
  /// Who is at the other end.
  virtual std::string peer() const = 0;
  /// The next Pump looks at the connection, even where the trainer speaks through memory: has it left?
  virtual void LookForTrainer() {}
  /// Seconds for which a trainer that has never said anything has let the engine wait; 0 once it has said something.
  virtual double mute_s() const { return 0.0; }
  /// Tells the trainer that the engine stands still on purpose, or goes on.
  virtual void SetPaused(bool paused) = 0;
};

/// Text protocol 1: sends the setup. `first` has come already. `number` counts sessions, for the world's seed.
Result<std::unique_ptr<ServerSession>> BeginTextSession(const SessionHost& host, std::unique_ptr<Transport> transport,
                                                        std::span<const std::byte> first, std::int64_t number);
/// Ok when text protocol 1 can carry this environment.
Status CheckTextSession(const EnvSpec& spec, const EnvServerOptions& options);

/// A trainer of protocol 2 whose HELLO was good.
struct Arrival {
  std::unique_ptr<Transport> transport;
  protocol2::FrameReader reader;  ///< with what came behind HELLO
  protocol2::Hello hello;
  double since = 0.0;        ///< when it connected
  std::uint32_t number = 0;  ///< of the session, from 1
};

/// Protocol 2. A session that lost its connection can go on with another.
class Session2 : public ServerSession {
 public:
  /// Serves `host` to one trainer after another.
  static std::unique_ptr<Session2> Create(const SessionHost& host);
  /// A new connection: of a new session or, where HELLO says so, of the one there is, in place of the one it had.
  virtual Status Connect(Arrival arrival) = 0;
  /// Whether HELLO's `resume` is of the session there is.
  virtual bool Owns(const protocol2::Hello& hello) const = 0;
  /// Whether such a HELLO may take it up: AUTH_FAILED otherwise, and the session stays as it is.
  virtual Status MayComeBack(const protocol2::Hello& hello) const = 0;
  /// True once the trainer has said BYE.
  virtual bool finished() const = 0;
  /// Another trainer has the world now: the session cannot be taken up again.
  virtual void Forget() = 0;
  /// True while a session without connection may be taken up again.
  virtual bool resumable() const = 0;
};

}  // namespace consac
