#pragma once
// The engine's end: serves a VectorEnv to a trainer over a Listener, in text protocol 1 or protocol 2, whichever the
// trainer speaks. Driven by its host: Poll from an engine's tick never waits; ServeSession is loop mode. A second
// trainer is served worlds of its own where the host can make some, and turned away with one line where it cannot.
// Misuse is an error Status, never a fault.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

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
  std::int32_t max_sessions = 16;       ///< trainers at once, where make_env is given
  /// Worlds for a further trainer while others stay, of the same spec; null: one trainer at a time. It may return null,
  /// where there is no memory for them: then the trainer is turned away.
  std::function<std::unique_ptr<VectorEnv>()> make_env;
  bool wait_after_end = false;  ///< as some hand-made engines: wait for an answer to an episode's last observation
};

/// Ok where nobody but this computer can connect, or a trainer must show a token; else says what to do.
Status CheckExposure(const Endpoint& endpoint, std::string_view token);

/// How a session stands.
enum class SessionState : std::uint8_t { kWaiting, kConnected };

/// Serves a world. One thread, but for session_steps.
class EnvServer {
 public:
  /// `env` must outlive the server and fit the protocol (text protocol 1 alone: one world, one agent, simple spaces).
  static Result<std::unique_ptr<EnvServer>> Create(VectorEnv& env, std::unique_ptr<Listener> listener,
                                                   const EnvServerOptions& options);
  virtual ~EnvServer() = default;

  /// Does what can be done, up to one step of each session's worlds: accepts, reads, steps, answers. Waits at most
  /// `wait_s` for there to be anything to do (0: does not wait). A broken session is reported once and the server then
  /// waits for the next trainer.
  virtual Status Poll(double wait_s = 0.0) = 0;
  /// Waits for a trainer and serves it, and whoever comes meanwhile, until nobody is connected or `stop` is set. Ok
  /// when the last trainer closed in order.
  virtual Status ServeSession(const std::atomic<bool>& stop) = 0;

  /// Whether a trainer is connected.
  virtual SessionState state() const = 0;
  /// Steps that the present sessions (or the latest) have taken. The one call that any thread may make at any time.
  virtual std::int64_t session_steps() const = 0;
  /// The port that is open.
  virtual int port() const = 0;
  /// Tells the trainer that the engine stands still on purpose (a breakpoint, a pause), or goes on: its deadlines stop
  /// meanwhile. Text protocol 1 has no word for it.
  virtual void SetPaused(bool paused) = 0;
  /// Ends every session, telling its trainer why (text protocol 1 has no word for it), and closes the port; calling it
  /// again does nothing.
  virtual void Close(const std::string& why) = 0;
};

}  // namespace consac
