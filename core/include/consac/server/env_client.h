#pragma once
// The trainer's end of a connection to an engine: worlds that can fail. Looks like VectorEnv, but every call returns a
// Status. Behind it is text protocol 1 (one world, one agent) or protocol 2, whichever the engine speaks.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "consac/env/vector_env.h"
#include "consac/server/protocol.h"
#include "consac/transport/transport.h"

namespace consac {

/// How patient and how exact the client is.
struct EnvClientOptions {
  double setup_timeout_s = 10.0;  ///< for the engine's first message
  double deadline_s = 60.0;       ///< for every later one; a paused editor needs more
  double quiet_s = 0.002;         ///< an engine without terminators: a message ends after this silence
  double after_end_s = 2.0;       ///< silence after an episode's end that is reported with a hint at answer_done
  const std::atomic<bool>* stop = nullptr;  ///< once true, a waiting call returns kCancelled within 0.1 s
  bool answer_done = false;             ///< answer an episode's last observation with an action that the engine ignores
  Protocol protocol = Protocol::kAuto;  ///< kProtocol2 says HELLO at once; kAuto first waits 0.1 s for a text setup
  std::string token;                    ///< protocol 2: the engine's access token
  /// Protocol 2: a new connection after the first has broken, to go on with the session; null: do not.
  std::function<Result<std::unique_ptr<Transport>>()> reconnect;
  /// Protocol 2: where it is kept when an engine that sends its trainer away wants to be tried again, in seconds of
  /// Now(); null: nobody asks.
  std::shared_ptr<std::atomic<double>> not_before;
  bool waits_while_paused = true;  ///< protocol 2: time does not count while the engine says that it is paused
  bool shared_memory = true;       ///< protocol 2: ask for it; goes on over TCP where it cannot be had
  /// Protocol 2: NaN and infinity end the session; false: the caller looks for them. Text protocol 1 cannot carry them.
  bool refuse_non_finite = true;
  double resume_s = 10.0;  ///< how long a lost connection is tried again
};

/// What the engine asked for in its setup.
struct SessionRequest {
  std::int64_t training_length = 0;  ///< steps; 0 with a model name: act only
  std::string model_name;            ///< "" when none was given
};

/// Whether more steps follow: after the last action of a training the client reads the one observation that answers
/// it and does not wait for a new episode.
enum class MoreSteps : std::uint8_t { kYes, kLast };

/// A session with one engine.
class EnvClient {
 public:
  virtual ~EnvClient() = default;
  /// Reads the engine's setup. Another service on the port is told apart by its first bytes, which the error shows.
  static Result<std::unique_ptr<EnvClient>> Open(std::unique_ptr<Transport> transport, const EnvClientOptions& options);

  /// What the engine offers.
  virtual const EnvSpec& spec() const = 0;
  /// What the engine asked for.
  virtual const SessionRequest& request() const = 0;
  /// Begins every environment, environment i from `seed` + i (text protocol 1: as the engine pleases), and writes
  /// next_observations.
  virtual Status Reset(std::uint64_t seed, std::span<Batch> batches) = 0;
  /// Sends the actions and waits for what comes of them; writes everything below `actions`. After an episode's end it
  /// also waits for the next episode's first observation, unless `more` is kLast. Never allocates once warm.
  virtual Status Step(std::span<Batch> batches, MoreSteps more) = 0;
  /// One byte per slot of behaviour `b`: whether an agent is there, as VectorEnv::present says it. Empty: all, always.
  virtual std::span<const std::uint8_t> present(std::size_t b) const {
    (void)b;
    return {};
  }
  /// VectorEnv::SetParameters: goes to the engine with the next Reset or Step (protocol 2, capability `parameters`).
  /// Without spec().parameters there is nothing to set.
  virtual void SetParameters(std::int32_t environment, std::span<const double> values) {
    (void)environment, (void)values;
  }
  /// What the engine has noted for the latest Reset or Step (capability `statistics`); until the next.
  virtual std::span<const Statistic> statistics() const { return {}; }
  /// VectorEnv::group_rewards, of the latest Step (capability `groups`).
  virtual std::span<const float> group_rewards() const { return {}; }
  /// True when PriceGoals works.
  virtual bool prices_goals() const { return false; }
  /// VectorEnv::PriceGoals, asked of the engine (protocol 2, capability `relabel`). A session in which it fails is
  /// over.
  virtual Status PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) {
    (void)b, (void)observations, (void)rows, (void)rewards;
    return {StatusCode::kFailedPrecondition, description() + " cannot say what other goals would have paid"};
  }
  /// How long the engine says it took for the latest Step [s]; 0 when it does not say.
  virtual double engine_seconds() const { return 0.0; }
  /// To be called now and then while no Step is under way for long: the engine hears that its trainer lives.
  virtual void KeepAlive() {}
  /// Ends the session; calling it again does nothing.
  virtual void Close() = 0;
  /// "127.0.0.1:5005, text protocol 1", for people.
  virtual std::string description() const = 0;
};

}  // namespace consac
