#include "server/seats.h"

#include <algorithm>
#include <cmath>

#include "consac/base/memory.h"
#include "consac/base/text.h"

namespace consac {
namespace {

constexpr double kMutePatience = 4.0;   // handshake deadlines: a trainer that is mute for longer gives way
constexpr double kTurnWait = 0.0005;    // s of waiting for one of several sessions
constexpr int kMostFramesPerPoll = 64;  // a peer that floods does not keep the engine's tick either

/// Up to one step of the seat's worlds: a fast trainer must not keep the engine's tick, a slow one not lose one.
Status PollSeat(Seat& seat, double wait_s) {
  const std::int64_t before = seat.steps();
  for (int frames = 0; frames < kMostFramesPerPoll && seat.steps() == before; ++frames) {
    const Result<bool> progressed = seat.Pump(frames == 0 ? wait_s : 0.0);
    if (!progressed.ok()) return seat.End(progressed.status());
    if (seat.finished()) return seat.End(Status::Ok());
    if (!*progressed) break;
  }
  return Status::Ok();
}

bool PumpSeat(Seat& seat, double timeout_s, Status* latest) {
  const Result<bool> progressed = seat.Pump(timeout_s);
  if (!progressed.ok())
    *latest = seat.End(progressed.status());
  else if (seat.finished())
    *latest = seat.End(Status::Ok());
  return progressed.ok() && *progressed;
}

}  // namespace

Seats::Seats(VectorEnv& env, const EnvServerOptions& options, Farewells& farewells)
    : options_(options), farewells_(farewells) {
  seats_.push_back(std::make_unique<Seat>(env, options_, steps_, farewells_));
}

std::size_t Seats::sessions() const {
  return static_cast<std::size_t>(
      std::count_if(seats_.begin(), seats_.end(), [](const auto& seat) { return seat->present() != nullptr; }));
}

bool Seats::awaited() const {
  return std::any_of(seats_.begin(), seats_.end(), [](const auto& seat) { return seat->resumable(); });
}

void Seats::SetPaused(bool paused) {
  for (const std::unique_ptr<Seat>& seat : seats_) seat->SetPaused(paused);
}

// ---- driving sessions

Status Seats::Poll(double wait_s, std::size_t sessions) {
  Status first;
  turn_ = (turn_ + 1) % seats_.size();
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    if (seats_[i]->present() == nullptr) continue;
    const double patience = sessions == 1 ? wait_s : i == turn_ ? std::min(wait_s, kTurnWait) : 0.0;
    const Status status = PollSeat(*seats_[i], patience);
    if (first.ok()) first = status;
  }
  return first;
}

bool Seats::PumpAll(double timeout_s, Status* latest) {
  bool progressed = false;
  for (const std::unique_ptr<Seat>& seat : seats_) {
    if (seat->present() != nullptr) progressed = PumpSeat(*seat, timeout_s, latest) || progressed;
  }
  return progressed;
}

bool Seats::PumpInTurn(Status* latest) {
  for (std::size_t i = 0; i < seats_.size(); ++i) {
    turn_ = (turn_ + 1) % seats_.size();
    if (seats_[turn_]->present() != nullptr) return PumpSeat(*seats_[turn_], kTurnWait, latest);
  }
  return false;
}

void Seats::EndAll(const Status& why) {
  for (const std::unique_ptr<Seat>& seat : seats_) {
    if (seat->present() != nullptr) (void)seat->End(why);
  }
}

// ---- sitting down

void Seats::LookForTrainers() {
  for (const std::unique_ptr<Seat>& seat : seats_) {
    if (seat->present() != nullptr) seat->present()->LookForTrainer();
  }
}

Seat* Seats::Owned(const protocol2::Hello& hello) const {
  const auto found = std::find_if(seats_.begin(), seats_.end(), [&](const auto& seat) { return seat->Owns(hello); });
  return found == seats_.end() ? nullptr : found->get();
}

bool Seats::CanMakeRoom() const {
  return options_.make_env && seats_.size() < static_cast<std::size_t>(std::max(1, options_.max_sessions));
}

Seat* Seats::Free() {
  if (sessions() == 0) {
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
  Seat* mute = Mute();
  return mute != nullptr ? mute : left;
}

/// The seat, free now, of whoever was served text protocol 1 because it said nothing, and has said nothing since.
Seat* Seats::Mute() {
  Seat* longest = seats_.front().get();
  for (const std::unique_ptr<Seat>& seat : seats_) longest = seat->mute_s() > longest->mute_s() ? seat.get() : longest;
  const double silence = longest->mute_s();
  if (silence <= kMutePatience * options_.handshake_s) return nullptr;
  Log(LogLevel::kWarning, longest->present()->peer() + " has said nothing for " + NumberText(std::round(silence)) +
                              " s; its place goes to another trainer");
  (void)longest->End({StatusCode::kDeadlineExceeded, "it said nothing, and another trainer came"});
  return longest;
}

}  // namespace consac
