#pragma once
// A world of which some agents have goals and some have none.

#include <cstdint>
#include <memory>
#include <span>

#include "consac/env/vector_env.h"
#include "worlds/registry.h"

namespace consac::testing {

/// Bit flipping whose agents are of two kinds, of which the second has no goals.
class MixedEnv final : public VectorEnv {
 public:
  MixedEnv() : bits_((*worlds::FindWorld("bit-flipping-v0"))->create(1)), spec_(bits_->spec()) {
    spec_.behaviours.push_back(BehaviourSpec::Of("plain", *Space::Box(-1, 1, {2}), *Space::Discrete(2), 1));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override { bits_->Reset(seed, batches.first(1)); }
  void Step(std::span<Batch> batches) override {
    bits_->Step(batches.first(1));
    batches[1].rewards[0] = 0.0f;
    batches[1].terminated[0] = batches[1].truncated[0] = 0;
  }
  bool prices_goals() const override { return true; }
  void PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) const override {
    bits_->PriceGoals(b, observations, rows, rewards);
  }
  void Visit(Archive& archive) override { bits_->Visit(archive); }

 private:
  std::unique_ptr<VectorEnv> bits_;
  EnvSpec spec_;
};

}  // namespace consac::testing
