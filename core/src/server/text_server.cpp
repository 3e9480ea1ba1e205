// The engine's end of text protocol 1. One session at a time; everything that must wait (the quiet time after a
// message, the frame rate) is a time before which nothing is sent, so that the same code serves tick and loop mode.
#include <algorithm>
#include <chrono>
#include <thread>

#include "consac/base/text.h"
#include "consac/env/buffer.h"
#include "consac/server/env_server.h"

namespace consac {
namespace {

using text1::Framer;
using text1::Terminator;

constexpr double kIdleWait = 0.1;       // s between looks at the stop flag and at further trainers
constexpr double kWriteTimeout = 10.0;  // s that a trainer may take no data
// Without terminators a setup that arrives together with the first observation cannot be told apart from it, and a
// trainer that has just connected may be slow to read: so this once the pause is long.
constexpr double kSetupPause = 0.05;  // s
constexpr std::string_view kBusyLine =
    "busy: another trainer is connected to this engine; try again when it has left\n";

class TextServer final : public EnvServer {
 public:
  TextServer(VectorEnv& env, std::unique_ptr<Listener> listener, const EnvServerOptions& options, std::string setup)
      : env_(env),
        behaviour_(env.spec().behaviours[0]),
        listener_(std::move(listener)),
        options_(options),
        setup_(std::move(setup)),
        buffer_(behaviour_),
        text_(2 * text1::MaxText(behaviour_.observation_layout)) {}

  ~TextServer() override { Close(); }

  Status Poll() override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    CONSAC_RETURN_IF_ERROR(AcceptOne(0.0));
    if (transport_ == nullptr) return Status::Ok();
    // Up to one step of the world: a fast trainer must not keep the engine's tick, a slow one not lose one.
    const std::int64_t steps_before = steps_;
    while (steps_ == steps_before) {
      const Result<bool> progressed = Pump(0.0);
      if (!progressed.ok()) return EndSession(progressed.status());
      if (!*progressed) break;
    }
    return Status::Ok();
  }

  Status ServeSession(const std::atomic<bool>& stop) override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    while (transport_ == nullptr) {
      if (stop.load(std::memory_order_relaxed)) return {StatusCode::kCancelled, "stopped while waiting for a trainer"};
      CONSAC_RETURN_IF_ERROR(AcceptOne(kIdleWait));
    }
    double next_look = Now() + kIdleWait;
    while (true) {
      const Result<bool> progressed = Pump(kIdleWait);
      if (!progressed.ok()) return EndSession(progressed.status());
      if (*progressed && Now() < next_look) continue;
      next_look = Now() + kIdleWait;
      if (stop.load(std::memory_order_relaxed)) {
        (void)EndSession(Status::Ok());
        return {StatusCode::kCancelled,
                "stopped in the middle of a session, after " + std::to_string(session_steps()) + " steps"};
      }
      CONSAC_RETURN_IF_ERROR(AcceptOne(0.0));
    }
  }

  SessionState state() const override {
    return transport_ == nullptr ? SessionState::kWaiting : SessionState::kConnected;
  }
  std::int64_t session_steps() const override { return steps_.load(std::memory_order_relaxed); }
  int port() const override { return listener_->port(); }

  void Close() override {
    if (transport_ != nullptr) transport_->Close();
    transport_.reset();
    listener_->Close();
    open_ = false;
  }

 private:
  /// What the trainer is to send next.
  enum class Phase : std::uint8_t {
    kSendFirst,     // the setup is out; the first observation follows
    kAwaitAction,   // an observation is out
    kStep,          // an action is here; the step may have to wait for the frame rate
    kAwaitIgnored,  // an episode's end is out and the engine waits for an answer that it ignores
    kSendEpisode,   // the first observation of the next episode follows
  };

  /// Takes a waiting connection: as the trainer, or to turn it away.
  Status AcceptOne(double timeout_s) {
    Result<std::unique_ptr<Transport>> accepted = listener_->Accept(timeout_s);
    if (!accepted.ok()) {
      if (transport_ == nullptr) return accepted.status();
      if (!accept_failed_) Log(LogLevel::kWarning, accepted.status().message());  // the session there is goes on
      accept_failed_ = true;
      return Status::Ok();
    }
    accept_failed_ = false;
    if (*accepted == nullptr) return Status::Ok();
    if (transport_ != nullptr) {
      (void)(*accepted)->Write(std::as_bytes(std::span(kBusyLine)), 0.0);
      (*accepted)->Close();
      Log(LogLevel::kWarning,
          "a second trainer, " + (*accepted)->peer() + ", was turned away: this engine serves " + transport_->peer());
      return Status::Ok();
    }
    transport_ = std::move(*accepted);
    return BeginSession();
  }

  Status BeginSession() {
    steps_ = 0;
    last_heard_ = Now();
    framer_ = Framer();
    const Leaf& action = behaviour_.action_layout.leaves[0];
    framer_.SetExpect(Framer::Expect::kAction, action.space.kind() == SpaceKind::kDiscrete && action.space.n() <= 10);
    env_.Reset(options_.seed + static_cast<std::uint64_t>(sessions_), {&buffer_.batch(), 1});
    ++sessions_;
    Schedule(Phase::kSendFirst);
    const Status status = Send(setup_);
    return status.ok() ? status : EndSession(status);
  }

  /// The next thing to send; without terminators it must keep its distance from the message before.
  void Schedule(Phase phase) {
    phase_ = phase;
    const double pause = phase == Phase::kSendFirst ? std::max(options_.quiet_s, kSetupPause) : options_.quiet_s;
    not_before_ = options_.terminator == Terminator::kNone ? Now() + pause : 0.0;
  }

  /// Waits at most `timeout_s` for what is due and does it. False when there was nothing to do.
  Result<bool> Pump(double timeout_s) {
    switch (phase_) {
      case Phase::kSendFirst:
      case Phase::kSendEpisode:
        if (!WaitUntil(not_before_, timeout_s)) return false;
        return Then(SendObservation(buffer_.batch().next_observations, 0.0f, false), Phase::kAwaitAction);
      case Phase::kStep:
        if (!WaitUntil(not_before_, timeout_s)) return false;
        return StepWorld();
      case Phase::kAwaitAction:
      case Phase::kAwaitIgnored:
        break;
    }
    return ReadAction(timeout_s);
  }

  static bool WaitUntil(double time, double timeout_s) {
    const double left = time - Now();
    if (left <= 0.0) return true;
    if (timeout_s <= 0.0) return false;
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(left, timeout_s)));
    return Now() >= time;
  }

  Result<bool> Then(const Status& status, Phase phase) {
    if (!status.ok()) return status;
    phase_ = phase;
    return true;
  }

  Result<bool> ReadAction(double timeout_s) {
    std::string_view message = framer_.Next();
    if (message.empty()) {
      const bool partial = !framer_.pending().empty();
      const Result<std::size_t> count =
          transport_->Read(framer_.Writable(), partial ? std::min(timeout_s, options_.quiet_s) : timeout_s);
      if (!count.ok()) return count.status();
      const Status fits = framer_.Commit(*count);
      if (!fits.ok()) return Refuse(fits);
      if (*count > 0) last_heard_ = Now();
      message = framer_.Next();
      if (message.empty() && *count == 0) {
        const double silence = Now() - last_heard_;
        if (silence > options_.deadline_s) {
          return Status{StatusCode::kDeadlineExceeded, transport_->peer() + " is silent for " +
                                                           NumberText(options_.deadline_s) + " s; its session is over"};
        }
        if (partial && silence >= options_.quiet_s) message = framer_.Quiet();
      }
      if (message.empty()) return *count > 0;
    }
    if (phase_ == Phase::kAwaitIgnored) {
      Schedule(Phase::kSendEpisode);
      return true;
    }
    const Status status = text1::ParseAction(message, behaviour_.action_layout, buffer_.batch().actions);
    if (!status.ok()) return Refuse(status);
    phase_ = Phase::kStep;
    not_before_ = options_.min_step_s > 0.0 ? last_step_ + options_.min_step_s : 0.0;
    return true;
  }

  /// Tells the trainer what was wrong before its session ends.
  Status Refuse(const Status& status) {
    (void)Send("error: " + status.message() + "\n");
    return status;
  }

  Result<bool> StepWorld() {
    Batch& batch = buffer_.batch();
    if (options_.min_step_s > 0.0) last_step_ = std::max(Now(), last_step_ + options_.min_step_s);
    env_.Step({&batch, 1});
    steps_.fetch_add(1, std::memory_order_relaxed);
    const bool done = (batch.terminated[0] | batch.truncated[0]) != 0;
    if (!done) return Then(SendObservation(batch.next_observations, batch.rewards[0], false), Phase::kAwaitAction);
    if (options_.wait_after_end)
      return Then(SendObservation(batch.final_observations, batch.rewards[0], true), Phase::kAwaitIgnored);
    if (options_.terminator == Terminator::kNone) {
      const Status status = SendObservation(batch.final_observations, batch.rewards[0], true);
      if (!status.ok()) return status;
      Schedule(Phase::kSendEpisode);
      return true;
    }
    // Both messages in one write: the end of this episode and the first observation of the next.
    const Layout& layout = behaviour_.observation_layout;
    for (const std::byte* row : {batch.final_observations, batch.next_observations}) {
      const Status sendable = text1::CheckSendable("observation", layout, row, batch.rewards[0]);
      if (!sendable.ok()) return Refuse(sendable);
    }
    std::size_t length =
        text1::EncodeObservation(layout, batch.final_observations, batch.rewards[0], true, options_.terminator, text_);
    length += text1::EncodeObservation(layout, batch.next_observations, 0.0f, false, options_.terminator,
                                       std::span(text_).subspan(length));
    return Then(Send({text_.data(), length}), Phase::kAwaitAction);
  }

  Status SendObservation(const std::byte* row, float reward, bool done) {
    const Status sendable = text1::CheckSendable("observation", behaviour_.observation_layout, row, reward);
    if (!sendable.ok()) return Refuse(sendable);
    const std::size_t length =
        text1::EncodeObservation(behaviour_.observation_layout, row, reward, done, options_.terminator, text_);
    return Send({text_.data(), length});
  }

  Status Send(std::string_view text) { return transport_->Write(std::as_bytes(std::span(text)), kWriteTimeout); }

  /// Closes the session. A trainer that left after its whole training left in order.
  Status EndSession(const Status& why) {
    transport_->Close();
    transport_.reset();
    if (why.ok() || why.code() != StatusCode::kUnavailable) return why;
    if (steps_ >= options_.training_length) return Status::Ok();
    return {StatusCode::kUnavailable, "the trainer left after " + std::to_string(session_steps()) + " of " +
                                          std::to_string(options_.training_length) + " steps: " + why.message()};
  }

  VectorEnv& env_;
  const BehaviourSpec& behaviour_;
  std::unique_ptr<Listener> listener_;
  const EnvServerOptions options_;
  const std::string setup_;  // with its terminator
  BatchBuffer buffer_;
  std::vector<char> text_;  // one or two outgoing observations
  Framer framer_;
  std::unique_ptr<Transport> transport_;
  bool open_ = true, accept_failed_ = false;
  Phase phase_ = Phase::kSendFirst;
  std::atomic<std::int64_t> steps_{0};
  std::int64_t sessions_ = 0;
  double not_before_ = 0.0, last_heard_ = 0.0, last_step_ = 0.0;
};

}  // namespace

Result<std::unique_ptr<EnvServer>> EnvServer::Create(VectorEnv& env, std::unique_ptr<Listener> listener,
                                                     const EnvServerOptions& options) {
  const EnvSpec& spec = env.spec();
  if (spec.behaviours.size() != 1 || spec.behaviours[0].slots != 1) {
    return Status{StatusCode::kInvalidArgument, "text protocol 1 serves one world with one agent; '" + spec.id +
                                                    "' offers " + std::to_string(spec.behaviours.size()) +
                                                    " behaviours with " + std::to_string(spec.behaviours[0].slots) +
                                                    " agents"};
  }
  text1::Setup setup;
  setup.action_space = spec.behaviours[0].action_space;
  setup.observation_space = spec.behaviours[0].observation_space;
  setup.training_length = options.training_length;
  setup.model_name = options.model_name;
  if (setup.training_length == 0 && setup.model_name.empty()) {
    return Status{StatusCode::kInvalidArgument,
                  "a session needs a training length above 0, or a model name to act with"};
  }
  std::string text;
  CONSAC_RETURN_IF_ERROR(text1::EncodeSetup(setup, &text));
  if (options.terminator == Terminator::kNewline) text += '\n';
  return std::unique_ptr<EnvServer>(std::make_unique<TextServer>(env, std::move(listener), options, std::move(text)));
}

}  // namespace consac
