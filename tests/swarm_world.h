#pragma once
// A world for tests whose agents come and go, each at a known time.

#include <cstring>
#include <string>
#include <vector>

#include "consac/env/vector_env.h"

namespace consac::testing {

/// Agent a of a copy is terminated at age 2 + 2 a; its observation is (slot, age), its reward its age. A copy begins
/// anew once all its agents have ended; with `respawn` an agent comes back by itself after two steps of absence.
class Swarm : public VectorEnv {
 public:
  Swarm(std::int32_t copies, std::int32_t agents, bool respawn)
      : agents_(agents), respawn_(respawn), there_(static_cast<std::size_t>(copies * agents)) {
    spec_.id = "swarm-v0";
    const Space seen = *Space::Box(0.0, 1e6, {2}, DType::kF32);
    spec_.behaviours.push_back(BehaviourSpec::Of("insect", seen, *Space::Discrete(2), copies * agents));
    spec_.behaviours[0].agents.clear();
    for (std::int32_t a = 0; a < agents; ++a) spec_.behaviours[0].agents.push_back("insect_" + std::to_string(a));
    age_.resize(there_.size());
    away_.resize(there_.size());
    info_.resize(there_.size());
    infos_.push_back({"age", info_});
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t, std::span<Batch> batches) override {
    for (std::int32_t world = 0; world < spec_.environments(); ++world) (void)ResetWorld(world, {}, batches);
  }
  bool ResetWorld(std::int32_t world, std::optional<std::uint64_t>, std::span<Batch> batches) override {
    for (std::int32_t a = 0; a < agents_; ++a)
      Appear(static_cast<std::size_t>(world * agents_ + a), batches[0], world * agents_ + a);
    return true;
  }
  bool steps_some() const override { return true; }
  std::span<const std::uint8_t> present(std::size_t) const override { return there_; }
  std::span<const InfoColumn> infos() const override { return infos_; }
  bool renders() const override { return true; }
  void Render(std::int32_t world, Picture* picture) override {
    picture->width = 2;
    picture->height = 1;
    picture->rgb = {static_cast<std::uint8_t>(world), 1, 2, 3, 4, 5};
  }
  void Visit(Archive& archive) override {
    archive("age", std::span<std::int64_t>(age_));
    archive("away", std::span<std::int64_t>(away_));
    archive("there", std::span<std::uint8_t>(there_));
  }

  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    for (std::size_t begin = 0; begin < batch.slots.size(); begin += static_cast<std::size_t>(agents_)) {
      bool any = false;
      for (std::size_t row = begin; row < begin + static_cast<std::size_t>(agents_); ++row) {
        StepAgent(batch, row);
        any = any || there_[static_cast<std::size_t>(batch.slots[row])] != 0;
      }
      for (std::size_t row = begin; !any && !respawn_ && row < begin + static_cast<std::size_t>(agents_); ++row)
        Appear(static_cast<std::size_t>(batch.slots[row]), batch, static_cast<std::int32_t>(row));
    }
  }

 private:
  void StepAgent(Batch& batch, std::size_t row) {
    const auto slot = static_cast<std::size_t>(batch.slots[row]);
    batch.rewards[row] = 0.0f;
    batch.terminated[row] = batch.truncated[row] = 0;
    if (there_[slot] == 0) {
      if (respawn_ && ++away_[slot] == 2) Appear(slot, batch, static_cast<std::int32_t>(row));
      return;
    }
    ++age_[slot];
    batch.rewards[row] = static_cast<float>(age_[slot]);
    info_[slot] = static_cast<float>(age_[slot]);
    if (age_[slot] < 2 + 2 * (static_cast<std::int64_t>(slot) % agents_)) {
      Write(slot, batch.next_observations, row);
      return;
    }
    batch.terminated[row] = 1;
    Write(slot, batch.final_observations, row);
    there_[slot] = 0;
    away_[slot] = 0;
  }
  void Appear(std::size_t slot, Batch& batch, std::int32_t row) {
    there_[slot] = 1;
    age_[slot] = 0;
    Write(slot, batch.next_observations, static_cast<std::size_t>(row));
  }
  void Write(std::size_t slot, std::byte* rows, std::size_t row) const {
    const float seen[2] = {static_cast<float>(slot), static_cast<float>(age_[slot])};
    std::memcpy(rows + row * sizeof(seen), seen, sizeof(seen));
  }

  std::int32_t agents_;
  bool respawn_;
  EnvSpec spec_;
  std::vector<std::int64_t> age_, away_;
  std::vector<std::uint8_t> there_;
  std::vector<float> info_;
  std::vector<InfoColumn> infos_;
};

}  // namespace consac::testing
