#pragma once
// A place at an engine: worlds, and the session that steps them. Private to core/server.

#include <atomic>
#include <memory>
#include <string_view>

#include "consac/protocol/protocol2.h"
#include "consac/server/env_server.h"
#include "server/door.h"
#include "server/peer.h"
#include "server/session.h"

namespace consac {

/// Worlds and whom they serve: a session of either protocol, or nobody.
class Seat {
 public:
  Seat(VectorEnv& env, const EnvServerOptions& options, std::atomic<std::int64_t>& steps, Farewells& farewells)
      : env_(env),
        options_(options),
        steps_(steps),
        farewells_(farewells),
        session2_(Session2::Create({env_, options_, steps_, farewells_})) {}
  Seat(std::unique_ptr<VectorEnv> env, const EnvServerOptions& options, std::atomic<std::int64_t>& steps,
       Farewells& farewells)
      : Seat(*env, options, steps, farewells) {
    owned_ = std::move(env);
  }

  ServerSession* present() const {
    if (text_ != nullptr) return text_.get();
    return connected2_ ? session2_.get() : nullptr;
  }
  bool resumable() const { return session2_->resumable(); }
  double mute_s() const { return present() == nullptr ? 0.0 : present()->mute_s(); }
  /// Whether HELLO is of its session, and whether it may take that up.
  bool Owns(const protocol2::Hello& hello) const { return session2_->Owns(hello); }
  Status MayComeBack(const protocol2::Hello& hello) const { return session2_->MayComeBack(hello); }
  /// A trainer that comes back meanwhile hears of it too.
  void SetPaused(bool paused) {
    session2_->SetPaused(paused);
    if (text_ != nullptr) text_->SetPaused(paused);
  }
  void RestartCount() { steps_.Restart(); }

  Status Connect(Arrival arrival) {
    connected2_ = true;
    const Status status = session2_->Connect(std::move(arrival));
    return status.ok() ? status : End(status);
  }
  Status Connect(Undecided one, std::int64_t number) {
    session2_->Forget();
    Result<std::unique_ptr<ServerSession>> session =
        BeginTextSession({env_, options_, steps_, farewells_}, std::move(one.transport), one.reader.pending(), number);
    if (session.ok()) text_ = std::move(*session);
    return session.ok() ? Status::Ok() : session.status();
  }

  Result<bool> Pump(double timeout_s) { return present()->Pump(timeout_s); }
  bool finished() const { return connected2_ && session2_->finished(); }
  std::int64_t steps() const { return steps_.session(); }
  Status End(const Status& why) {
    const Status status = present()->End(NamingPeer(why, *present()));
    text_.reset();
    connected2_ = false;
    return status;
  }

 private:
  std::unique_ptr<VectorEnv> owned_;  // null: the host's
  VectorEnv& env_;
  const EnvServerOptions& options_;
  StepCount steps_;
  Farewells& farewells_;
  std::unique_ptr<Session2> session2_;
  bool connected2_ = false;
  std::unique_ptr<ServerSession> text_;
};

/// About what a seat takes beside its worlds: rows and results of a step in their several copies, a request on its way.
inline std::size_t SeatBytes(const EnvSpec& spec) {
  constexpr std::size_t kResults = 8, kRequests = 4;  // copies
  const protocol2::Blocks blocks(spec);
  return kResults * blocks.largest_result + kRequests * blocks.step_bytes + blocks.options + protocol2::kLargestJson;
}

}  // namespace consac
