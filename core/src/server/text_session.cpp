// The engine's end of text protocol 1. Everything that must wait (the quiet time after a message, the frame rate) is a
// time before which nothing is sent, so that the same code serves tick and loop mode.
#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include "consac/base/hooks.h"
#include "consac/base/text.h"
#include "consac/env/buffer.h"
#include "consac/transport/outbox.h"
#include "server/session.h"

namespace consac {
namespace {

using text1::Framer;
using text1::Terminator;

// Without terminators a setup that arrives together with the first observation cannot be told apart from it, and a
// trainer that has just connected may be slow to read: so this once the pause is long.
constexpr double kSetupPause = 0.05;  // s

text1::Setup SetupOf(const EnvSpec& spec, const EnvServerOptions& options) {
  text1::Setup setup;
  setup.action_space = spec.behaviours[0].action_space;
  setup.observation_space = spec.behaviours[0].observation_space;
  setup.training_length = options.training_length;
  setup.model_name = options.model_name;
  return setup;
}

class TextSession final : public ServerSession {
 public:
  TextSession(const SessionHost& host, std::unique_ptr<Transport> transport)
      : env_(host.env),
        behaviour_(host.env.spec().behaviours[0]),
        options_(host.options),
        buffer_(behaviour_),
        text_(2 * text1::MaxText(behaviour_.observation_layout)),
        transport_(std::move(transport)),
        steps_(host.steps) {}
  ~TextSession() override {
    if (!env_.settled()) env_.Abandon();
  }

  void Begin(std::int64_t number) {
    steps_.Restart();
    last_heard_ = Now();
    const Leaf& action = behaviour_.action_layout.leaves[0];
    framer_.SetExpect(Framer::Expect::kAction, action.space.kind() == SpaceKind::kDiscrete && action.space.n() <= 10);
    env_.Reset(options_.seed + static_cast<std::uint64_t>(number), {&buffer_.batch(), 1});
    Schedule(Phase::kSendFirst);
  }

  /// Bytes that came before the session began.
  Status Take(std::span<const std::byte> first) {
    spoken_ = !first.empty();
    while (!first.empty()) {
      const std::span<std::byte> room = framer_.Writable();
      const std::size_t count = std::min(room.size(), first.size());
      if (count == 0) return {StatusCode::kProtocol, transport_->peer() + " says too much before the session begins"};
      std::memcpy(room.data(), first.data(), count);
      CONSAC_RETURN_IF_ERROR(framer_.Commit(count));
      first = first.subspan(count);
    }
    return Status::Ok();
  }

  Status SendSetup() {
    std::string setup;
    CONSAC_RETURN_IF_ERROR(text1::EncodeSetup(SetupOf(env_.spec(), options_), &setup));
    if (options_.terminator == Terminator::kNewline) setup += '\n';
    return Send(setup);
  }

  Result<bool> Pump(double timeout_s) override {
    if (!outbox_.empty()) {
      CONSAC_RETURN_IF_ERROR(outbox_.Flush(*transport_, timeout_s, options_.write_s));
      return outbox_.empty();
    }
    switch (phase_) {
      case Phase::kSendFirst:
      case Phase::kSendEpisode:
        if (!env_.settled() || !WaitUntil(not_before_, timeout_s)) return false;
        return Then(SendObservation(buffer_.batch().next_observations, 0.0f, false), Phase::kAwaitAction);
      case Phase::kStep:
        if (!WaitUntil(not_before_, timeout_s)) return false;
        return StepWorld();
      case Phase::kStepping:
        if (!env_.settled()) return false;
        return SendOutcome();
      case Phase::kAwaitAction:
      case Phase::kAwaitIgnored:
        break;
    }
    return ReadAction(timeout_s);
  }

  // A trainer that left after its whole training left in order.
  Status End(const Status& why) override {
    if (!outbox_.empty()) (void)outbox_.Flush(*transport_, 0.0, options_.write_s);
    transport_->Close();
    if (why.ok() || why.code() != StatusCode::kUnavailable) return why;
    if (steps_.session() >= options_.training_length) return Status::Ok();
    return {StatusCode::kUnavailable, "the trainer left after " + std::to_string(steps_.session()) + " of " +
                                          std::to_string(options_.training_length) + " steps: " + why.message()};
  }

  std::string peer() const override { return transport_->peer(); }
  double mute_s() const override { return spoken_ || phase_ != Phase::kAwaitAction ? 0.0 : Now() - last_heard_; }
  void SetPaused(bool) override {}  // text protocol 1 has no word for it

 private:
  /// What the trainer is to send next.
  enum class Phase : std::uint8_t {
    kSendFirst,     // the setup is out; the first observation follows
    kAwaitAction,   // an observation is out
    kStep,          // an action is here; the step may have to wait for the frame rate
    kStepping,      // the world steps
    kAwaitIgnored,  // an episode's end is out and the engine waits for an answer that it ignores
    kSendEpisode,   // the first observation of the next episode follows
  };

  /// The next thing to send; without terminators it must keep its distance from the message before.
  void Schedule(Phase phase) {
    phase_ = phase;
    const double pause = phase == Phase::kSendFirst ? std::max(options_.quiet_s, kSetupPause) : options_.quiet_s;
    not_before_ = options_.terminator == Terminator::kNone ? Now() + pause : 0.0;
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
      if (*count > 0) {
        last_heard_ = Now();
        spoken_ = true;
      }
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
    if (options_.min_step_s > 0.0) last_step_ = std::max(Now(), last_step_ + options_.min_step_s);
    env_.Step({&buffer_.batch(), 1});
    phase_ = Phase::kStepping;
    if (!env_.settled()) return true;
    return SendOutcome();
  }

  Result<bool> SendOutcome() {
    const Batch& batch = buffer_.batch();
    steps_.Add(1);
    last_heard_ = Now();  // from now on the trainer's silence is its own
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
    last_heard_ = Now();  // from now on the trainer's silence is its own
    return Send({text_.data(), length});
  }

  Status Send(std::string_view text) { return outbox_.Send(*transport_, std::as_bytes(std::span(text))); }

  VectorEnv& env_;
  const BehaviourSpec& behaviour_;
  const EnvServerOptions& options_;
  BatchBuffer buffer_;
  std::vector<char> text_;  // one or two outgoing observations
  Framer framer_;
  std::unique_ptr<Transport> transport_;
  Outbox outbox_;
  Phase phase_ = Phase::kSendFirst;
  StepCount& steps_;
  double not_before_ = 0.0, last_heard_ = 0.0, last_step_ = 0.0;
  bool spoken_ = false;  // the trainer has said anything yet
};

std::size_t AgentsOfAWorld(const EnvSpec& spec) {
  std::size_t agents = 0;
  for (const BehaviourSpec& behaviour : spec.behaviours) agents += behaviour.agents.size();
  return agents;
}

/// Said for each trainer that speaks it, since what is lost is lost in silence.
void SayWhatIsNotCarried(const EnvSpec& spec, Protocol spoken) {
  std::string lost;
  if (spec.behaviours[0].masks_actions) lost = "action masks (it may choose what is not legal)";
  if (!spec.parameters.empty())
    lost += std::string(lost.empty() ? "" : " and ") + "environment parameters (all are at their defaults)";
  if (lost.empty()) return;
  Log(LogLevel::kWarning, "the trainer speaks text protocol 1, which does not carry what is offered here: " + lost +
                              (spoken == Protocol::kText1 ? "; protocol 2 does, which this engine was told not to speak"
                                                          : "; protocol 2 does (consac train --protocol 2)"));
}

}  // namespace

Status CheckTextSession(const EnvSpec& spec, const EnvServerOptions& options) {
  if (spec.behaviours.size() != 1 || spec.behaviours[0].slots != 1) {
    return {StatusCode::kInvalidArgument, "text protocol 1 serves one world with one agent; '" + spec.id + "' offers " +
                                              std::to_string(spec.environments()) + " environments with " +
                                              std::to_string(AgentsOfAWorld(spec)) + " agents each"};
  }
  std::string ignored;
  return text1::EncodeSetup(SetupOf(spec, options), &ignored);
}

Result<std::unique_ptr<ServerSession>> BeginTextSession(const SessionHost& host, std::unique_ptr<Transport> transport,
                                                        std::span<const std::byte> first, std::int64_t number) {
  SetDefaultParameters(host.env);  // whatever a trainer of protocol 2 has set before
  auto session = std::make_unique<TextSession>(host, std::move(transport));
  session->Begin(number);
  Status status = session->Take(first);
  if (status.ok()) status = session->SendSetup();
  if (!status.ok()) {
    (void)session->End(status);
    return status;
  }
  SayWhatIsNotCarried(host.env.spec(), host.options.protocol);
  return std::unique_ptr<ServerSession>(std::move(session));
}

}  // namespace consac
