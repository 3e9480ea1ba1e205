#pragma once
// A world in which something can be set, that notes numbers, and whose two agents are a group.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "consac/env/vector_env.h"

namespace consac::testing {

/// Two agents of each world walk `speed` a step, and see how far they are; an episode has kLength steps. `height` has
/// no bounds and does nothing. Each notes "walked"; both are paid 0.5 as a group, and 1 of their own.
class RichEnv : public VectorEnv {
 public:
  static constexpr std::int64_t kLength = 7;

  explicit RichEnv(std::int32_t copies = 2) : worlds_(static_cast<std::size_t>(copies)) {
    spec_.id = "rich-v0";
    spec_.behaviours.push_back(
        BehaviourSpec::Of("default", *Space::Box(-1e6f, 1e6f, {1}), *Space::Discrete(2), 2 * copies));
    spec_.behaviours[0].agents = {"left", "right"};
    spec_.parameters = {{"speed", 1.0, 0.0, 10.0, "m in a step"}, {"height", 0.0}};
    spec_.groups = {{"both", {{0, 0}, {0, 1}}}};
    spec_.max_episode_steps = kLength;
    paid_.resize(worlds_.size());
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override {
    for (std::size_t i = 0; i < worlds_.size(); ++i) Begin(i, batches[0]);
  }
  bool ResetWorld(std::int32_t world, std::optional<std::uint64_t>, std::span<Batch> batches) override {
    Begin(static_cast<std::size_t>(world), batches[0]);
    return true;
  }
  bool steps_some() const override { return true; }
  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    for (std::size_t row = 0; row < batch.slots.size(); ++row) {
      const auto i = static_cast<std::size_t>(batch.slots[row] / 2);
      World& world = worlds_[i];
      if (batch.slots[row] % 2 == 0) {
        ++world.steps;
        world.at += world.speed;
      }
      const bool cut = world.steps == kLength;
      batch.rewards[row] = 1.5f;
      batch.terminated[row] = 0;
      batch.truncated[row] = cut ? 1 : 0;
      paid_[i] = 0.5f;
      noted_.push_back({"walked", world.speed});
      Show(world, (cut ? batch.final_observations : batch.next_observations), row);
      if (!cut) continue;
      if (batch.slots[row] % 2 == 1) Start(world);
      Show(World(), batch.next_observations, row);
    }
  }
  void SetParameters(std::int32_t world, std::span<const double> values) override {
    if (!std::isnan(values[0])) worlds_[static_cast<std::size_t>(world)].set_speed = values[0];
  }
  bool tells_statistics() const override { return true; }
  void TakeStatistics(std::vector<Statistic>* noted) override {
    noted->insert(noted->end(), noted_.begin(), noted_.end());
    noted_.clear();
  }
  std::span<const float> group_rewards() const override { return paid_; }
  void Visit(Archive&) override {}

 private:
  struct World {
    double at = 0.0, speed = 1.0, set_speed = 1.0;
    std::int64_t steps = 0;
  };
  static void Start(World& world) {
    world.at = 0.0;
    world.steps = 0;
    world.speed = world.set_speed;
  }
  static void Show(const World& world, std::byte* rows, std::size_t row) {
    const auto at = static_cast<float>(world.at);
    std::memcpy(rows + row * sizeof(at), &at, sizeof(at));
  }
  void Begin(std::size_t i, Batch& batch) {
    Start(worlds_[i]);
    for (std::size_t agent = 0; agent < 2; ++agent) Show(worlds_[i], batch.next_observations, 2 * i + agent);
  }

  EnvSpec spec_;
  std::vector<World> worlds_;
  std::vector<float> paid_;  // [worlds] the one group
  std::vector<Statistic> noted_;
};

}  // namespace consac::testing
