#pragma once
// An engine for tests: a built-in world that is stepped in ticks, as a game would be, through a TickWorld.

#include <cstring>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "consac/env/buffer.h"
#include "consac/host/driver.h"
#include "consac/host/recorder.h"
#include "worlds/registry.h"

namespace consac::testing {

/// Carries out what a driver wants of the agents; an action takes `period` ticks.
class TickedEngine {
 public:
  /// `goals`, where others than the inner world's own are to be priced.
  TickedEngine(std::unique_ptr<VectorEnv> inner, int period, bool agents_leave = false,
               std::optional<host::Goals> goals = std::nullopt)
      : inner_(std::move(inner)), period_(period), rows_(inner_->spec().behaviours[0]) {
    const BehaviourSpec& behaviour = inner_->spec().behaviours[0];
    host::TickWorldOptions options;
    options.id = inner_->spec().id;
    options.agents_leave = agents_leave;
    host::Offering offering;
    offering.name = behaviour.name;
    offering.observations = {{"seen", behaviour.observation_space}};
    if (behaviour.observation_space.kind() == SpaceKind::kDict) {
      offering.observations.clear();
      for (const auto& [part, space] : behaviour.observation_space.children())
        offering.observations.push_back({part, space});
    }
    if (inner_->prices_goals()) offering.goals = goals.value_or(GoalsOfInner());
    offering.actions = {{"done", behaviour.action_space}};
    offering.agents = behaviour.slots;
    options.offerings = {offering};
    world_ = *host::TickWorld::Create(options);
    for (std::int32_t a = 0; a < behaviour.slots; ++a) (void)*world_->Join(0);
  }
  TickedEngine(const std::string& name, std::int32_t copies, int period)
      : TickedEngine((*worlds::FindWorld(name))->create(copies), period) {}
  /// With goals that the host prices by their distance.
  TickedEngine(const std::string& name, std::int32_t copies, int period, const host::Goals& goals)
      : TickedEngine((*worlds::FindWorld(name))->create(copies), period, false, goals) {}

  host::TickWorld& world() { return *world_; }

  /// One tick of the engine. The status is Poll's.
  Status Tick(host::Driver& driver, double wait_s) {
    ++ticks_;
    thread_ = std::this_thread::get_id();
    if (world_->cue() == host::Cue::kAct && --left_ > 0) return Status::Ok();
    if (world_->cue() != host::Cue::kWait) Offer();
    const Status status = driver.Poll(wait_s);
    if (world_->cue() == host::Cue::kAct) left_ = period_;
    return status;
  }

  std::int64_t ticks() const { return ticks_; }
  /// Whether the inner world was asked for prices by another thread than the one that ticked last.
  bool priced_elsewhere() const { return priced_elsewhere_; }
  host::Recorder* recorder = nullptr;

 private:
  /// What the inner world pays and says that it would have paid.
  host::Goals GoalsOfInner() {
    host::Goals goals;
    goals.reward = host::GoalReward::kFunction;
    goals.pays = false;
    goals.price = [this](const std::byte* observations, std::int64_t rows, float* rewards) {
      priced_elsewhere_ = priced_elsewhere_ || std::this_thread::get_id() != thread_;
      inner_->PriceGoals(0, observations, rows, rewards);
    };
    return goals;
  }

  void Offer() {
    const BehaviourSpec& behaviour = inner_->spec().behaviours[0];
    Batch& batch = rows_.batch();
    const std::size_t seen = behaviour.observation_layout.row_bytes, done = behaviour.action_layout.row_bytes;
    if (world_->cue() == host::Cue::kReset) {
      inner_->Reset(world_->Seed(0).value_or(0), {&batch, 1});
    } else {
      for (std::int32_t a = 0; a < behaviour.slots; ++a)
        std::memcpy(batch.actions + static_cast<std::size_t>(a) * done, world_->Action(a), done);
      inner_->Step({&batch, 1});
    }
    for (std::int32_t a = 0; a < behaviour.slots; ++a) {
      const auto row = static_cast<std::size_t>(a);
      if (world_->cue() == host::Cue::kAct) {
        world_->AddReward(a, batch.rewards[row]);
        if (batch.terminated[row] != 0) world_->EndEpisode(a, host::EpisodeEnd::kTerminated);
        if (batch.truncated[row] != 0) world_->EndEpisode(a, host::EpisodeEnd::kTruncated);
        if (world_->Ending(a)) std::memcpy(world_->FinalObservation(a), batch.final_observations + row * seen, seen);
      }
      std::memcpy(world_->Observation(a), batch.next_observations + row * seen, seen);
    }
    if (recorder != nullptr) recorder->Note();
    (void)world_->Offer();
  }

  std::unique_ptr<VectorEnv> inner_;
  const int period_;
  BatchBuffer rows_;
  std::unique_ptr<host::TickWorld> world_;
  int left_ = 0;
  std::int64_t ticks_ = 0;
  std::thread::id thread_;
  bool priced_elsewhere_ = false;
};

}  // namespace consac::testing
