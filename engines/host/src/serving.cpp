// A trainer at the other end of a connection drives the world.
#include <algorithm>
#include <utility>

#include "turn.h"

namespace consac::host {
namespace {

class ServingDriver final : public Driver {
 public:
  explicit ServingDriver(TickWorld& world) : world_(world) {}
  ~ServingDriver() override {
    server_.reset();
    world_.Abandon();
  }

  Status Open(const ServeOptions& options) {
    CONSAC_RETURN_IF_ERROR(CheckExposure(options.endpoint, options.server.token));
    Result<std::unique_ptr<Listener>> listener = ListenTcp(options.endpoint);
    if (!listener.ok()) return listener.status();
    Result<std::unique_ptr<EnvServer>> server = EnvServer::Create(world_, std::move(*listener), options.server);
    if (!server.ok()) return server.status();
    server_ = std::move(*server);
    total_steps_ = options.server.training_length;
    return Status::Ok();
  }

  Status Poll(double wait_s) override {
    const double began = Now(), until = began + wait_s;
    while (world_.cue() == Cue::kWait) {
      const bool connected = server_->state() == SessionState::kConnected;
      const Status status = server_->Poll(std::max(0.0, until - Now()));
      const bool still = server_->state() == SessionState::kConnected;
      if (still) finished_ = false;
      if (!status.ok()) return status;
      if (connected && !still) {
        if (!std::exchange(began_, false)) return Status::Ok();  // it left in the handshake: that was no session
        finished_ = server_->session_steps() >= total_steps_;
        ++ended_;
        return Status::Ok();
      }
      if (Now() >= until) break;
    }
    if (world_.cue() != Cue::kWait) {
      began_ = true;
      meter_.Note(world_.tally().steps, began);
    }
    return Status::Ok();
  }

  bool finished() const override { return finished_; }
  std::int64_t ended() const override { return ended_; }
  void SetPaused(bool paused) override { server_->SetPaused(paused); }
  void Refuse(const std::string& why) override { server_->Close(why); }
  int port() const override { return server_->port(); }

  Progress progress() const override {
    Progress progress;
    progress.state = server_->state() == SessionState::kConnected
                         ? "a trainer is connected"
                         : "waiting for a trainer on port " + std::to_string(port());
    progress.tally = world_.tally();
    progress.steps = server_->session_steps();
    progress.total_steps = total_steps_;
    meter_.Tell(&progress);
    return progress;
  }

 private:
  TickWorld& world_;
  std::unique_ptr<EnvServer> server_;
  std::int64_t total_steps_ = 0, ended_ = 0;
  bool finished_ = false;
  bool began_ = false;  // the present trainer has asked the agents for something
  Meter meter_;
};

}  // namespace

Result<ModelFile> Driver::Model(std::size_t) const {
  return Status{StatusCode::kFailedPrecondition, "there is no model here to save; training inside or acting has one"};
}

Status Driver::SaveModel(std::size_t b, const std::string& path) const {
  const Result<ModelFile> model = Model(b);
  return model.ok() ? model->Save(path) : model.status();
}

Result<std::unique_ptr<Driver>> Serve(TickWorld& world, const ServeOptions& options) {
  CONSAC_RETURN_IF_ERROR(world.EveryoneJoined());
  auto driver = std::make_unique<ServingDriver>(world);
  CONSAC_RETURN_IF_ERROR(driver->Open(options));
  return std::unique_ptr<Driver>(std::move(driver));
}

}  // namespace consac::host
