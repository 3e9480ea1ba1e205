// Accepting trainers: which protocol each speaks, who is served and who is turned away.
#include "consac/server/env_server.h"

#include <algorithm>
#include <array>

#include "consac/protocol/protocol2.h"
#include "server/limits.h"
#include "server/session.h"

namespace consac {
namespace {

constexpr double kIdleWait = 0.1;           // s between looks at the stop flag and at further trainers
constexpr double kShortWait = 0.005;        // s, while somebody has connected who has said nothing yet
constexpr int kMostFramesPerPoll = 64;      // a peer that floods does not keep the engine's tick either
constexpr std::size_t kMostUndecided = 16;  // connections that have said nothing; more are closed at once
constexpr std::string_view kBusyLine =
    "busy: another trainer is connected to this engine; try again when it has left\n";

/// A connection whose protocol is not known yet.
struct Undecided {
  std::unique_ptr<Transport> transport;
  double since = 0.0;
  std::array<std::byte, 64> first = {};
  std::size_t count = 0;

  std::span<const std::byte> heard() const { return std::span(first).first(count); }
};

class EnvServerOfEither final : public EnvServer {
 public:
  EnvServerOfEither(VectorEnv& env, std::unique_ptr<Listener> listener, const EnvServerOptions& options)
      : env_(env),
        listener_(std::move(listener)),
        options_(options),
        text_fits_(CheckTextSession(env.spec(), options).ok()),
        session2_(Session2::Create({env_, options_, steps_})) {}
  ~EnvServerOfEither() override { Close(); }

  Status Poll() override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    CONSAC_RETURN_IF_ERROR(Accept(0.0));
    ServerSession* session = present();
    if (session == nullptr) return Status::Ok();
    // Up to one step of the world: a fast trainer must not keep the engine's tick, a slow one not lose one.
    const std::int64_t before = steps_;
    for (int frames = 0; frames < kMostFramesPerPoll && steps_ == before; ++frames) {
      const Result<bool> progressed = session->Pump(0.0);
      if (!progressed.ok()) return End(progressed.status());
      if (session2_connected_ && session2_->finished()) return End(Status::Ok());
      if (!*progressed) break;
    }
    return Status::Ok();
  }

  Status ServeSession(const std::atomic<bool>& stop) override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    bool served = false;
    double next_look = 0.0;
    while (true) {
      if (ServerSession* session = present(); session != nullptr) {
        served = true;
        const Result<bool> progressed = session->Pump(waiting_.empty() ? kIdleWait : kShortWait);
        if (!progressed.ok()) {
          const Status ended = End(progressed.status());
          if (!session2_->resumable()) return ended;
          broken_ = ended;
        } else if (session2_connected_ && session2_->finished()) {
          return End(Status::Ok());
        }
        if (progressed.ok() && *progressed && Now() < next_look) continue;
      } else if (served && !session2_->resumable()) {
        return broken_;
      }
      next_look = Now() + kIdleWait;
      if (stop.load(std::memory_order_relaxed)) return Stopped(served);
      CONSAC_RETURN_IF_ERROR(Accept(present() != nullptr ? 0.0 : waiting_.empty() ? kIdleWait : kShortWait));
    }
  }

  SessionState state() const override {
    return present() == nullptr ? SessionState::kWaiting : SessionState::kConnected;
  }
  std::int64_t session_steps() const override { return steps_.load(std::memory_order_relaxed); }
  int port() const override { return listener_->port(); }
  void SetPaused(bool paused) override {
    if (ServerSession* session = present(); session != nullptr) session->SetPaused(paused);
  }

  void Close() override {
    if (present() != nullptr) (void)End({StatusCode::kCancelled, "the engine closes"});
    waiting_.clear();
    listener_->Close();
    open_ = false;
  }

 private:
  ServerSession* present() const {
    if (text_ != nullptr) return text_.get();
    return session2_connected_ ? session2_.get() : nullptr;
  }

  Status Stopped(bool served) {
    if (!served) return {StatusCode::kCancelled, "stopped while waiting for a trainer"};
    if (present() != nullptr) (void)End({StatusCode::kCancelled, "the engine stops"});
    return {StatusCode::kCancelled,
            "stopped in the middle of a session, after " + std::to_string(session_steps()) + " steps"};
  }

  Status End(const Status& why) {
    const Status status = present()->End(why);
    text_.reset();
    session2_connected_ = false;
    return status;
  }

  /// Takes waiting connections and decides about those that have said enough, or nothing for long enough.
  Status Accept(double timeout_s) {
    Result<std::unique_ptr<Transport>> accepted = listener_->Accept(timeout_s);
    if (!accepted.ok()) {
      if (present() == nullptr) return accepted.status();
      if (!accept_failed_) Log(LogLevel::kWarning, accepted.status().message());  // the session there is goes on
      accept_failed_ = true;
      return Status::Ok();
    }
    accept_failed_ = false;
    if (*accepted != nullptr && waiting_.size() < kMostUndecided)
      waiting_.push_back({std::move(*accepted), Now(), {}, 0});
    for (std::size_t i = 0; i < waiting_.size();) {
      const Result<Protocol> protocol = Decide(waiting_[i]);
      if (protocol.ok() && *protocol == Protocol::kAuto) {
        ++i;
        continue;
      }
      Undecided one = std::move(waiting_[i]);
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
      if (protocol.ok()) CONSAC_RETURN_IF_ERROR(Welcome(std::move(one), *protocol));
    }
    return Status::Ok();
  }

  /// kAuto: not yet. An error when the connection is gone or has outstayed its time.
  Result<Protocol> Decide(Undecided& one) const {
    if (options_.protocol == Protocol::kText1) return Protocol::kText1;
    const Result<std::size_t> count = one.transport->Read(std::span(one.first).subspan(one.count), 0.0);
    if (!count.ok()) return count.status();
    one.count += *count;
    if (one.count > 0) return one.first[0] == std::byte{0xC0} ? Protocol::kProtocol2 : Protocol::kText1;
    const double waited = Now() - one.since;
    if (text_fits_ && options_.protocol == Protocol::kAuto)
      return waited >= options_.grace_s ? Protocol::kText1 : Protocol::kAuto;
    if (waited < options_.handshake_s) return Protocol::kAuto;
    return Status{StatusCode::kDeadlineExceeded, one.transport->peer() + " said nothing"};
  }

  Status Welcome(Undecided one, Protocol protocol) {
    if (present() != nullptr) {
      Log(LogLevel::kWarning,
          "a second trainer, " + one.transport->peer() + ", was turned away: this engine serves " + present()->peer());
      if (protocol == Protocol::kProtocol2)
        TurnAway2(*one.transport);
      else
        (void)one.transport->Write(std::as_bytes(std::span(kBusyLine)), 0.0);
      one.transport->Close();
      return Status::Ok();
    }
    if (protocol == Protocol::kProtocol2) {
      session2_->Connect(std::move(one.transport), one.heard());
      session2_connected_ = true;
      return Status::Ok();
    }
    if (!text_fits_ || options_.protocol == Protocol::kProtocol2) {
      constexpr std::string_view kNoText = "error: this engine speaks protocol 2 only\n";
      (void)one.transport->Write(std::as_bytes(std::span(kNoText)), 0.0);
      one.transport->Close();
      return Status::Ok();
    }
    Result<std::unique_ptr<ServerSession>> session =
        BeginTextSession({env_, options_, steps_}, std::move(one.transport), one.heard(), sessions_++);
    session2_->Forget();
    if (!session.ok()) return session.status();
    text_ = std::move(*session);
    return Status::Ok();
  }

  VectorEnv& env_;
  std::unique_ptr<Listener> listener_;
  const EnvServerOptions options_;
  const bool text_fits_;
  std::atomic<std::int64_t> steps_{0};
  std::unique_ptr<Session2> session2_;
  bool session2_connected_ = false;
  std::unique_ptr<ServerSession> text_;
  std::vector<Undecided> waiting_;
  std::int64_t sessions_ = 0;
  Status broken_;  // how the last connection of a session that may be taken up again ended
  bool open_ = true, accept_failed_ = false;
};

}  // namespace

Result<std::unique_ptr<EnvServer>> EnvServer::Create(VectorEnv& env, std::unique_ptr<Listener> listener,
                                                     const EnvServerOptions& options) {
  if (options.training_length == 0 && options.model_name.empty()) {
    return Status{StatusCode::kInvalidArgument,
                  "a session needs a training length above 0, or a model name to act with"};
  }
  if (options.protocol == Protocol::kText1) CONSAC_RETURN_IF_ERROR(CheckTextSession(env.spec(), options));
  return std::unique_ptr<EnvServer>(std::make_unique<EnvServerOfEither>(env, std::move(listener), options));
}

}  // namespace consac
