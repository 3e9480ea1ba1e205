#pragma once
// The engine's end: serves a VectorEnv to one trainer at a time over a Listener, in text protocol 1 or protocol 2,
// whichever the trainer speaks. Driven by its host: Poll from an engine's tick never waits; ServeSession is loop mode.
// A second trainer is turned away with one line while the first stays. Misuse is an error Status, never a fault.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "consac/env/vector_env.h"
#include "consac/protocol/text1.h"
#include "consac/server/protocol.h"
#include "consac/transport/transport.h"

namespace consac {

/// What the server tells its trainer and how it behaves.
struct EnvServerOptions {
  std::int64_t training_length = 0;                            ///< sent in the setup; 0 with a model name: act only
  std::string model_name;                                      ///< sent in the setup; "" leaves the field out
  std::uint64_t seed = 0;                                      ///< of the world; session k uses seed + k
  text1::Terminator terminator = text1::Terminator::kNewline;  ///< kNone: as the thesis' engine
  double quiet_s = 0.002;               ///< a trainer without terminators: a message ends after this silence
  double deadline_s = 60.0;             ///< a trainer silent for longer has left
  Protocol protocol = Protocol::kAuto;  ///< kText1 serves it at once, without the grace time
  double grace_s = 0.3;                 ///< a trainer that says nothing for so long is served text protocol 1
  double handshake_s = 5.0;             ///< protocol 2: from connecting to CONFIGURE
  double write_s = 10.0;                ///< a trainer that takes no data for so long has left
  double resume_s = 60.0;               ///< protocol 2: a session whose connection broke may be taken up for so long
  std::string token;                    ///< protocol 2: what a trainer must show; needed to listen beyond loopback
  double min_step_s = 0.0;              ///< at least this long between steps: acts like a frame-bound engine
  bool wait_after_end = false;  ///< as some hand-made engines: wait for an answer to an episode's last observation
};

/// How a session stands.
enum class SessionState : std::uint8_t { kWaiting, kConnected };

/// Serves one world. One thread, but for session_steps.
class EnvServer {
 public:
  /// `env` must outlive the server and fit the protocol (text protocol 1 alone: one world, one agent, simple spaces).
  static Result<std::unique_ptr<EnvServer>> Create(VectorEnv& env, std::unique_ptr<Listener> listener,
                                                   const EnvServerOptions& options);
  virtual ~EnvServer() = default;

  /// Does what can be done without waiting, up to one step of the world: accepts, reads, steps, answers. A broken
  /// session is reported once and the server then waits for the next trainer.
  virtual Status Poll() = 0;
  /// Waits for a trainer and serves it until it leaves or `stop` is set. Ok when the trainer closed in order.
  virtual Status ServeSession(const std::atomic<bool>& stop) = 0;

  /// Whether a trainer is connected.
  virtual SessionState state() const = 0;
  /// Steps that the present (or latest) session has taken. The one call that any thread may make at any time.
  virtual std::int64_t session_steps() const = 0;
  /// The port that is open.
  virtual int port() const = 0;
  /// Tells the trainer that the engine stands still on purpose (a breakpoint, a pause), or goes on: its deadlines stop
  /// meanwhile. Text protocol 1 has no word for it.
  virtual void SetPaused(bool paused) = 0;
  /// Ends the session and closes the port; calling it again does nothing.
  virtual void Close() = 0;
};

}  // namespace consac
