// Accepting trainers: which protocol each speaks, who is served, with which worlds, and who is turned away.
#include "consac/server/env_server.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "consac/base/memory.h"
#include "consac/base/refusals.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "server/limits.h"
#include "server/seat.h"
#include "server/secret.h"

namespace consac {
namespace {

using protocol2::Fault;
using protocol2::FrameType;

constexpr double kIdleWait = 0.1;           // s between looks at the stop flag and at further trainers
constexpr double kShortWait = 0.005;        // s, while somebody has connected who has said nothing yet
constexpr double kAfterRefusal = 0.1;       // s before the next try where the system let nobody in
constexpr double kRefusalAgain = 60.0;      // s before that is said again
constexpr double kMutePatience = 4.0;       // handshake deadlines: a trainer that is mute for longer gives way
constexpr double kSpin = 0.0001;            // s of looking at several sessions in turn before waiting for one
constexpr double kTurnWait = 0.0005;        // s of waiting for one of several sessions
constexpr int kMostFramesPerPoll = 64;      // a peer that floods does not keep the engine's tick either
constexpr std::size_t kMostUndecided = 16;  // connections that have said nothing; more are closed at once

/// Text protocol 1 has no place for a token.
Status TextFits(const EnvSpec& spec, const EnvServerOptions& options) {
  if (!options.token.empty()) return {StatusCode::kFailedPrecondition, "it asks for a token"};
  return CheckTextSession(spec, options);
}

class EnvServerOfEither final : public EnvServer {
 public:
  EnvServerOfEither(VectorEnv& env, std::unique_ptr<Listener> listener, const EnvServerOptions& options)
      : listener_(std::move(listener)), options_(options), text_fits_(TextFits(env.spec(), options)) {
    seats_.push_back(std::make_unique<Seat>(env, options_, steps_, farewells_));
  }
  ~EnvServerOfEither() override { EnvServerOfEither::Close("the engine closes"); }

  Status Poll(double wait_s) override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    const std::size_t present = sessions_present();
    if (!waiting_.empty() || present > 1) wait_s = std::min(wait_s, kShortWait);
    Status first = Accept(present == 0 ? wait_s : 0.0);
    turn_ = (turn_ + 1) % seats_.size();
    for (std::size_t i = 0; i < seats_.size(); ++i) {
      if (seats_[i]->present() == nullptr) continue;
      const double patience = present == 1 ? wait_s : i == turn_ ? std::min(wait_s, kTurnWait) : 0.0;
      const Status status = PollSeat(*seats_[i], patience);
      if (first.ok()) first = status;
    }
    return first;
  }

  Status ServeSession(const std::atomic<bool>& stop) override {
    if (!open_) return {StatusCode::kFailedPrecondition, "the server is closed; create it again to serve"};
    bool served = false;
    double next_look = 0.0, last_progress = 0.0;
    Status latest;  // how the latest session ended
    while (true) {
      const std::size_t present = sessions_present();
      served = served || present > 0;
      if (served && present == 0 && !Awaited()) return latest;
      bool progressed = false;
      if (present == 1) {
        progressed = PumpAll(waiting_.empty() ? kIdleWait : kShortWait, &latest);
      } else if (present > 1) {
        progressed = PumpAll(0.0, &latest);
        const double now = Now();
        if (progressed) last_progress = now;
        if (!progressed && now - last_progress > kSpin) progressed = PumpInTurn(&latest);
        if (!progressed) std::this_thread::yield();
      }
      if ((progressed || present > 1) && Now() < next_look) continue;
      next_look = Now() + kIdleWait;
      if (stop.load(std::memory_order_relaxed)) return Stopped(served);
      CONSAC_RETURN_IF_ERROR(Accept(sessions_present() > 0 ? 0.0 : waiting_.empty() ? kIdleWait : kShortWait));
      if (!waiting_.empty()) next_look = 0.0;
    }
  }

  SessionState state() const override {
    return sessions_present() == 0 ? SessionState::kWaiting : SessionState::kConnected;
  }
  std::int64_t session_steps() const override { return steps_.load(std::memory_order_relaxed); }
  int port() const override { return listener_->port(); }
  void SetPaused(bool paused) override {
    for (const std::unique_ptr<Seat>& seat : seats_) seat->SetPaused(paused);
  }

  void Close(const std::string& why) override {
    EndAll({StatusCode::kCancelled, why});
    waiting_.clear();
    farewells_.Clear();
    listener_->Close();
    open_ = false;
  }

 private:
  std::size_t sessions_present() const {
    return static_cast<std::size_t>(
        std::count_if(seats_.begin(), seats_.end(), [](const auto& seat) { return seat->present() != nullptr; }));
  }
  /// Whether a session that lost its connection may still be taken up.
  bool Awaited() const {
    return std::any_of(seats_.begin(), seats_.end(), [](const auto& seat) { return seat->resumable(); });
  }

  // ---- driving sessions

  /// Up to one step of the seat's worlds: a fast trainer must not keep the engine's tick, a slow one not lose one.
  static Status PollSeat(Seat& seat, double wait_s) {
    const std::int64_t before = seat.steps();
    for (int frames = 0; frames < kMostFramesPerPoll && seat.steps() == before; ++frames) {
      const Result<bool> progressed = seat.Pump(frames == 0 ? wait_s : 0.0);
      if (!progressed.ok()) return seat.End(progressed.status());
      if (seat.finished()) return seat.End(Status::Ok());
      if (!*progressed) break;
    }
    return Status::Ok();
  }

  static bool PumpOne(Seat& seat, double timeout_s, Status* latest) {
    const Result<bool> progressed = seat.Pump(timeout_s);
    if (!progressed.ok())
      *latest = seat.End(progressed.status());
    else if (seat.finished())
      *latest = seat.End(Status::Ok());
    return progressed.ok() && *progressed;
  }

  bool PumpAll(double timeout_s, Status* latest) {
    bool progressed = false;
    for (const std::unique_ptr<Seat>& seat : seats_) {
      if (seat->present() != nullptr) progressed = PumpOne(*seat, timeout_s, latest) || progressed;
    }
    return progressed;
  }

  /// Waits a little for the next of several sessions.
  bool PumpInTurn(Status* latest) {
    for (std::size_t i = 0; i < seats_.size(); ++i) {
      turn_ = (turn_ + 1) % seats_.size();
      if (seats_[turn_]->present() != nullptr) return PumpOne(*seats_[turn_], kTurnWait, latest);
    }
    return false;
  }

  void EndAll(const Status& why) {
    for (const std::unique_ptr<Seat>& seat : seats_) {
      if (seat->present() != nullptr) (void)seat->End(why);
    }
  }

  Status Stopped(bool served) {
    if (!served) return {StatusCode::kCancelled, "stopped while waiting for a trainer"};
    EndAll({StatusCode::kCancelled, "the engine stops"});
    return {StatusCode::kCancelled,
            "stopped in the middle of a session, after " + std::to_string(session_steps()) + " steps"};
  }

  // ---- at the door

  /// Takes waiting connections and decides about those that have said enough, or nothing for long enough.
  Status Accept(double timeout_s) {
    farewells_.Look();
    refusals_.Look();
    Result<std::unique_ptr<Transport>> accepted = Knock(timeout_s);
    if (!accepted.ok()) return accepted.status();
    if (*accepted != nullptr && (waiting_.size() < kMostUndecided || SendAwayMute())) LetIn(std::move(*accepted));
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

  /// Of those at the door, whoever has said nothing for longest makes room. False where all have begun to speak.
  bool SendAwayMute() {
    const auto mute = std::find_if(waiting_.begin(), waiting_.end(), [](const Undecided& one) {
      return one.reader.pending().empty() && !one.hello.has_value();
    });
    if (mute == waiting_.end()) return false;
    Dismiss(*mute, kBusyLine);
    waiting_.erase(mute);
    return true;
  }

  /// A trainer may have left whose session has not noticed yet: before a further one is turned away, each is asked.
  /// True while the answer is awaited.
  bool LooksForRoom(Undecided& one) {
    const bool goes_on = one.hello.has_value() && !one.hello->resume.empty();
    if (goes_on || one.looked_for_room || sessions_present() < seats_.size() || CanMakeRoom()) return false;
    for (const std::unique_ptr<Seat>& seat : seats_) seat->present()->LookForTrainer();
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

  void Welcome(Undecided one) {
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
      for (const std::unique_ptr<Seat>& seat : seats_) {
        if (seat->Owns(hello)) return seat.get();
      }
      return Fault("AUTH_FAILED", "that session is over, or had a larger max_frame; begin a new one");
    }
    if (options_.protocol == Protocol::kText1)
      return Fault("UNSUPPORTED_VERSION", "this engine speaks text protocol 1");
    Seat* seat = FreeSeat();
    if (seat == nullptr)
      return Fault(
          "CAPACITY",
          "another trainer is connected to this engine, and it serves no more at once; try again when it has left");
    return seat;
  }

  bool CanMakeRoom() const {
    return options_.make_env && seats_.size() < static_cast<std::size_t>(std::max(1, options_.max_sessions));
  }

  /// Nobody's, rather than one more where worlds can be made and memory is there for them, one that a mute trainer must
  /// give up, or one whose trainer may come back; null when there is none.
  Seat* FreeSeat() {
    if (sessions_present() == 0) {
      for (const std::unique_ptr<Seat>& seat : seats_) {
        if (!seat->resumable()) seat->RestartCount();
      }
    }
    Seat* left = nullptr;
    for (const std::unique_ptr<Seat>& seat : seats_) {
      if (seat->present() != nullptr) continue;
      if (!seat->resumable()) return seat.get();
      if (left == nullptr) left = seat.get();
    }
    if (CanMakeRoom()) {
      std::unique_ptr<VectorEnv> env = options_.make_env();
      const bool afforded = env != nullptr && CheckMemory(SeatBytes(env->spec()), "a further trainer").ok();
      if (afforded)
        return seats_.emplace_back(std::make_unique<Seat>(std::move(env), options_, steps_, farewells_)).get();
    }
    Seat* mute = MuteSeat();
    return mute != nullptr ? mute : left;
  }

  /// The seat, free now, of whoever was served text protocol 1 because it said nothing, and has said nothing since.
  Seat* MuteSeat() {
    Seat* longest = seats_.front().get();
    for (const std::unique_ptr<Seat>& seat : seats_)
      longest = seat->mute_s() > longest->mute_s() ? seat.get() : longest;
    const double silence = longest->mute_s();
    if (silence <= kMutePatience * options_.handshake_s) return nullptr;
    Log(LogLevel::kWarning, longest->present()->peer() + " has said nothing for " + NumberText(std::round(silence)) +
                                " s; its place goes to another trainer");
    (void)longest->End({StatusCode::kDeadlineExceeded, "it said nothing, and another trainer came"});
    return longest;
  }

  void WelcomeText(Undecided one) {
    if (!text_fits_.ok() || options_.protocol == Protocol::kProtocol2) {
      return DismissText(one);
    }
    Seat* seat = FreeSeat();
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
  std::atomic<std::int64_t> steps_{0};
  std::vector<std::unique_ptr<Seat>> seats_;  // at least one; never fewer
  std::size_t turn_ = 0;
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
