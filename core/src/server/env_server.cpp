// Accepting trainers: which protocol each speaks, who is served, with which worlds, and who is turned away.
#include "consac/server/env_server.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "consac/base/memory.h"
#include "consac/base/refusals.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "server/limits.h"
#include "server/seats.h"
#include "server/secret.h"

namespace consac {
namespace {

using protocol2::Fault;
using protocol2::FrameType;

constexpr double kIdleWait = 0.1;           // s between looks at the stop flag and at further trainers
constexpr double kShortWait = 0.005;        // s, while somebody has connected who has said nothing yet
constexpr double kAfterRefusal = 0.1;       // s before the next try where the system let nobody in
constexpr double kRefusalAgain = 60.0;      // s before that is said again
constexpr double kSpin = 0.0001;            // s of looking at several sessions in turn before waiting for one
constexpr std::size_t kMostUndecided = 16;  // connections without HELLO; one more, and another is sent away

/// Text protocol 1 has no place for a token.
Status TextFits(const EnvSpec& spec, const EnvServerOptions& options) {
  if (!options.token.empty()) return {StatusCode::kFailedPrecondition, "it asks for a token"};
  return CheckTextSession(spec, options);
}

class EnvServerOfEither final : public EnvServer {
 public:
  EnvServerOfEither(VectorEnv& env, std::unique_ptr<Listener> listener, const EnvServerOptions& options)
      : listener_(std::move(listener)),
        options_(options),
        text_fits_(TextFits(env.spec(), options)),
        seats_(env, options_, farewells_) {}
  ~EnvServerOfEither() override { EnvServerOfEither::Close("the engine closes"); }

  Status Poll(double wait_s) override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    const std::size_t present = seats_.sessions();
    if (!waiting_.empty() || present > 1) wait_s = std::min(wait_s, kShortWait);
    const Status accepted = Accept(present == 0 ? wait_s : 0.0), polled = seats_.Poll(wait_s, present);
    return accepted.ok() ? polled : accepted;
  }

  Status ServeSession(const std::atomic<bool>& stop) override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    bool served = false;
    double next_look = 0.0, last_progress = 0.0;
    Status latest;  // how the latest session ended
    while (true) {
      const std::size_t present = seats_.sessions();
      served = served || present > 0;
      if (served && present == 0 && !seats_.awaited()) return latest;
      bool progressed = false;
      if (present == 1) {
        progressed = seats_.PumpAll(waiting_.empty() ? kIdleWait : kShortWait, &latest);
      } else if (present > 1) {
        progressed = seats_.PumpAll(0.0, &latest);
        const double now = Now();
        if (progressed) last_progress = now;
        if (!progressed && now - last_progress > kSpin) progressed = seats_.PumpInTurn(&latest);
        if (!progressed) std::this_thread::yield();
      }
      if ((progressed || present > 1) && Now() < next_look) continue;
      next_look = Now() + kIdleWait;
      if (stop.load(std::memory_order_relaxed)) return Stopped(served);
      CONSAC_RETURN_IF_ERROR(Accept(seats_.sessions() > 0 ? 0.0 : waiting_.empty() ? kIdleWait : kShortWait));
      if (!waiting_.empty()) next_look = 0.0;
    }
  }

  SessionState state() const override {
    return seats_.sessions() == 0 ? SessionState::kWaiting : SessionState::kConnected;
  }
  std::int64_t session_steps() const override { return seats_.steps(); }
  int port() const override { return listener_->port(); }
  void SetPaused(bool paused) override { seats_.SetPaused(paused); }

  void Close(const std::string& why) override {
    seats_.EndAll({StatusCode::kCancelled, why});
    waiting_.clear();
    farewells_.Clear();
    listener_->Close();
    open_ = false;
  }

 private:
  Status Stopped(bool served) {
    if (!served) return {StatusCode::kCancelled, "stopped while waiting for a trainer"};
    seats_.EndAll({StatusCode::kCancelled, "the engine stops"});
    return {StatusCode::kCancelled,
            "stopped in the middle of a session, after " + std::to_string(session_steps()) + " steps"};
  }

  /// Takes waiting connections and decides about those that have said enough, or nothing for long enough.
  Status Accept(double timeout_s) {
    farewells_.Look();
    refusals_.Look();
    Result<std::unique_ptr<Transport>> accepted = Knock(timeout_s);
    if (!accepted.ok()) return accepted.status();
    if (*accepted != nullptr) {
      if (waiting_.size() >= kMostUndecided) SendAwayOne();
      LetIn(std::move(*accepted));
    }
    for (std::size_t i = 0; i < waiting_.size();) {
      const Result<Protocol> protocol = Decide(waiting_[i]);
      if (protocol.ok() && (*protocol == Protocol::kAuto || LooksForRoom(waiting_[i]))) {
        ++i;
        continue;
      }
      Undecided one = std::move(waiting_[i]);
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
      if (!protocol.ok()) {
        TurnAway(one, protocol.status());
      } else if (*protocol == Protocol::kText1) {
        WelcomeText(std::move(one));
      } else {
        Welcome(std::move(one));
      }
    }
    return Status::Ok();
  }

  void LetIn(std::unique_ptr<Transport> transport) {
    Undecided one{std::move(transport), Now(), protocol2::FrameReader()};
    if (one.reader.capacity() > 0) return waiting_.push_back(std::move(one));
    refusals_.Say(one.transport->peer() + " was turned away: there is no memory to read what it says");
    Dismiss(one, kNoMemoryLine);
  }

  /// The next connection. Where the system has no more of what one takes, that is said once, the sessions there are go
  /// on, and whoever waits is let in once somebody has left.
  Result<std::unique_ptr<Transport>> Knock(double timeout_s) {
    const double pause = shut_until_ - Now();
    if (pause > 0.0) {
      if (timeout_s > 0.0) std::this_thread::sleep_for(std::chrono::duration<double>(std::min(pause, timeout_s)));
      return std::unique_ptr<Transport>();
    }
    Result<std::unique_ptr<Transport>> accepted = listener_->Accept(timeout_s);
    if (accepted.ok() || accepted.status().code() != StatusCode::kResourceExhausted) return accepted;
    shut_until_ = Now() + kAfterRefusal;
    if (shut_until_ > quiet_until_) Log(LogLevel::kWarning, accepted.status().message());
    quiet_until_ = std::max(quiet_until_, shut_until_ + kRefusalAgain);
    return std::unique_ptr<Transport>();
  }

  /// Whoever has said least makes room; of those, who has been there for longest.
  void SendAwayOne() {
    const auto one = std::min_element(waiting_.begin(), waiting_.end(),
                                      [](const Undecided& a, const Undecided& b) { return a.said() < b.said(); });
    refusals_.Say(one->transport->peer() + " was turned away: too many connections at once have not said a HELLO");
    if (one->said() > 0) {
      DismissWithError(*one, Fault("CAPACITY", "too many are at this engine's door; try again later"), farewells_);
    } else {
      Dismiss(*one, kBusyLine);
    }
    waiting_.erase(one);
  }

  /// A trainer may have left whose session has not noticed yet: before a further one is turned away, each is asked.
  /// True while the answer is awaited.
  bool LooksForRoom(Undecided& one) {
    const bool goes_on = one.hello.has_value() && !one.hello->resume.empty();
    if (goes_on || one.looked_for_room || !seats_.full()) return false;
    seats_.LookForTrainers();
    return one.looked_for_room = true;
  }

  /// kAuto: not yet; kProtocol2: its HELLO is there. An error when the connection is gone, has outstayed its time or
  /// said what it may not.
  Result<Protocol> Decide(Undecided& one) {
    if (options_.protocol == Protocol::kText1) return Protocol::kText1;
    if (one.hello.has_value()) return Protocol::kProtocol2;
    const Result<std::size_t> count = one.transport->Read(one.reader.Writable(), 0.0);
    if (!count.ok()) return count.status();
    one.reader.Commit(*count);
    const double waited = Now() - one.since;
    if (one.reader.pending().empty() && !one.speaks_2) {
      if (text_fits_.ok() && options_.protocol == Protocol::kAuto)
        return waited >= options_.grace_s ? Protocol::kText1 : Protocol::kAuto;
      if (waited < options_.handshake_s) return Protocol::kAuto;
      if (options_.protocol == Protocol::kProtocol2)
        return Fault("MALFORMED", "no HELLO came within " + NumberText(options_.handshake_s) + " s");
      // Whoever waits for the engine to speak first speaks text protocol 1.
      DismissText(one);
      return Status{StatusCode::kDeadlineExceeded, one.transport->peer() + " said nothing"};
    }
    if (!one.speaks_2 && one.reader.pending()[0] != std::byte{0xC0}) return Protocol::kText1;
    protocol2::Frame frame;
    Result<bool> whole = one.reader.Next(&frame);
    while (whole.ok() && *whole && MayComeBeforeHello(frame.header.type)) {
      one.speaks_2 = true;
      whole = one.reader.Next(&frame);
    }
    if (!whole.ok()) {
      one.request = one.reader.refused_request();
      return whole.status();
    }
    if (!*whole) {
      if (waited < options_.handshake_s) return Protocol::kAuto;
      return Fault("MALFORMED", "no whole HELLO came within " + NumberText(options_.handshake_s) + " s");
    }
    if (frame.header.type == FrameType::kBye) return Status{StatusCode::kUnavailable, "it left without a HELLO"};
    protocol2::Hello hello;
    one.request = frame.header.request;
    CONSAC_RETURN_IF_ERROR(ReadHello(frame, &hello));
    one.hello = std::move(hello);
    return Protocol::kProtocol2;
  }

  /// Whoever left by itself, or never said which protocol it speaks, hears and is worth nothing.
  void TurnAway(Undecided& one, const Status& why) {
    if (why.code() != StatusCode::kProtocol) return one.transport->Close();
    refusals_.Say(one.transport->peer() + " was turned away: " + why.message());
    DismissWithError(one, why, farewells_);
  }

  static bool MayComeBeforeHello(FrameType type) {
    return type == FrameType::kPong || (static_cast<std::uint16_t>(type) & protocol2::kOptionalType) != 0;
  }

  void Welcome(Undecided&& one) {
    Result<Seat*> seat = SeatFor(*one.hello);
    if (!seat.ok()) return TurnAway(one, seat.status());
    Arrival arrival;
    arrival.hello = std::move(*one.hello);
    arrival.transport = std::move(one.transport);
    arrival.reader = std::move(one.reader);
    arrival.since = one.since;
    arrival.number = static_cast<std::uint32_t>(arrival.hello.resume.empty() ? ++sessions_ : 0);
    (void)(*seat)->Connect(std::move(arrival));  // gone again at once: the seat is free
  }

  Status ReadHello(const protocol2::Frame& frame, protocol2::Hello* hello) const {
    if (frame.header.type != FrameType::kHello) return Fault("BAD_STATE", "a session begins with HELLO");
    Result<protocol2::Hello> parsed = protocol2::ParseHello(frame.payload);
    if (!parsed.ok()) return parsed.status();
    *hello = std::move(*parsed);
    if (hello->lowest > protocol2::kVersion || hello->highest < protocol2::kVersion) {
      return Fault("UNSUPPORTED_VERSION", "this engine speaks protocol " + std::to_string(protocol2::kVersion) +
                                              ", the trainer " + std::to_string(hello->lowest) + " to " +
                                              std::to_string(hello->highest) + "; update the older one");
    }
    if (!options_.token.empty() && !SameSecret(options_.token, hello->token))
      return Fault("AUTH_FAILED", "the access token is missing or wrong; give the engine's --token");
    return Status::Ok();
  }

  /// The seat of the session that HELLO takes up, or one for a new session.
  Result<Seat*> SeatFor(const protocol2::Hello& hello) {
    if (!hello.resume.empty()) {
      Seat* const owned = seats_.Owned(hello);
      if (owned == nullptr) return Fault("AUTH_FAILED", "that session is over; begin a new one");
      CONSAC_RETURN_IF_ERROR(owned->MayComeBack(hello));
      return owned;
    }
    if (options_.protocol == Protocol::kText1)
      return Fault("UNSUPPORTED_VERSION", "this engine speaks text protocol 1");
    Seat* seat = seats_.Free();
    if (seat == nullptr)
      return Fault(
          "CAPACITY",
          "another trainer is connected to this engine, and it serves no more at once; try again when it has left");
    return seat;
  }

  void WelcomeText(Undecided&& one) {
    if (!text_fits_.ok() || options_.protocol == Protocol::kProtocol2) {
      return DismissText(one);
    }
    Seat* seat = seats_.Free();
    if (seat == nullptr) {
      refusals_.Say("a further trainer, " + one.transport->peer() + ", was turned away");
      return Dismiss(one, kBusyLine);
    }
    const Status status = seat->Connect(std::move(one), sessions_++);
    if (!status.ok()) refusals_.Say("a trainer left before its session began: " + status.message());
  }

  /// A trainer of text protocol 1, which hears why.
  void DismissText(Undecided& one) const {
    const std::string why = text_fits_.ok() ? "it was told to" : text_fits_.message();
    Dismiss(one, "error: this engine speaks protocol 2 only: " + why + "\n");
  }

  std::unique_ptr<Listener> listener_;
  Farewells farewells_;  // outlives the seats
  Refusals refusals_;
  const EnvServerOptions options_;
  const Status text_fits_;
  Seats seats_;
  std::vector<Undecided> waiting_;
  std::int64_t sessions_ = 0;
  double shut_until_ = 0.0, quiet_until_ = 0.0;  // nobody is let in, and nothing said about it
  bool open_ = true;
};

}  // namespace

Status CheckExposure(const Endpoint& endpoint, std::string_view token) {
  const std::string_view host = endpoint.host;
  if (host == "localhost" || host == "::1" || host.starts_with("127.") || !token.empty()) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          "the address " + Quote(host) + " lets other machines in; that needs an access token"};
}

Result<std::unique_ptr<EnvServer>> EnvServer::Create(VectorEnv& env, std::unique_ptr<Listener> listener,
                                                     const EnvServerOptions& options) {
  if (options.training_length == 0 && options.model_name.empty()) {
    return Status{StatusCode::kInvalidArgument,
                  "a session needs a training length above 0, or a model name to act with"};
  }
  if (options.protocol == Protocol::kText1) CONSAC_RETURN_IF_ERROR(CheckTextSession(env.spec(), options));
  CONSAC_RETURN_IF_ERROR(CheckMemory(SeatBytes(env.spec()), "a session of these worlds"));
  return std::unique_ptr<EnvServer>(std::make_unique<EnvServerOfEither>(env, std::move(listener), options));
}

}  // namespace consac
