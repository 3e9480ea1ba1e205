#pragma once
// A world for tests with two kinds of agents, each in a built-in world of its own.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "worlds/registry.h"

namespace consac::testing {

/// A built-in world, the name of its agents' behaviour, and how many there are.
struct Half {
  std::string behaviour;
  std::string world;
  std::int32_t agents = 1;  ///< places for agents
  std::int32_t empty = 0;   ///< how many of them nobody takes
};

/// Two behaviours that know nothing of each other.
class TwoWorlds final : public VectorEnv {
 public:
  TwoWorlds(const Half& first, const Half& second) {
    spec_.id = "two-v0";
    for (const Half& half : {first, second}) {
      worlds_.push_back((*worlds::FindWorld(half.world))->create(half.agents));
      spec_.behaviours.push_back(worlds_.back()->spec().behaviours[0]);
      BehaviourSpec& behaviour = spec_.behaviours.back();
      behaviour.name = half.behaviour;
      behaviour.agents.clear();  // all in one environment
      for (std::int32_t a = 0; a < half.agents; ++a)
        behaviour.agents.push_back(half.behaviour + "_" + std::to_string(a));
      present_.emplace_back(static_cast<std::size_t>(half.agents), 1);
      std::fill_n(present_.back().begin(), half.empty, std::uint8_t{0});
    }
  }
  /// Three walk the road, two balance poles.
  TwoWorlds() : TwoWorlds({"walker", "road-v0", 3}, {"balancer", "cartpole-v1", 2}) {}
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    for (std::size_t b = 0; b < 2; ++b) worlds_[b]->Reset(seed, batches.subspan(b, 1));
  }
  void Step(std::span<Batch> batches) override {
    for (std::size_t b = 0; b < 2; ++b) worlds_[b]->Step(batches.subspan(b, 1));
  }
  std::span<const std::uint8_t> present(std::size_t b) const override { return present_[b]; }
  void Visit(Archive& archive) override {
    archive("first", *worlds_[0]);
    archive("second", *worlds_[1]);
  }

 private:
  std::vector<std::unique_ptr<VectorEnv>> worlds_;
  std::vector<std::vector<std::uint8_t>> present_;
  EnvSpec spec_;
};

}  // namespace consac::testing
