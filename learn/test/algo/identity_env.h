#pragma once
// Stable Baselines' IdentityEnv for tests: the observation is the action that pays. 100 steps an episode.

#include <cstring>

#include "consac/env/vector_env.h"

namespace consac::learn {

/// N copies. Works for any action space whose value can be observed.
class IdentityEnv final : public VectorEnv {
 public:
  /// Observation and action space are the same; a Box pays when every element is within 0.3.
  IdentityEnv(const Space& space, std::int32_t copies)
      : layout_(Layout::Of(space)), steps_(static_cast<std::size_t>(copies)) {
    spec_.id = "identity";
    spec_.behaviours.push_back(BehaviourSpec::Of("default", space, space, copies));
  }
  const EnvSpec& spec() const override { return spec_; }
  void Reset(std::uint64_t seed, std::span<Batch> batches) override {
    rng_ = Rng(seed, 77);
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      steps_[i] = 0;
      Draw(batches[0].next_observations, i);
    }
  }
  void Step(std::span<Batch> batches) override {
    Batch& batch = batches[0];
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      batch.rewards[i] =
          Matches(batch.observations + i * layout_.row_bytes, batch.actions + i * layout_.row_bytes) ? 1.0f : 0.0f;
      batch.terminated[i] = 0;
      batch.truncated[i] = ++steps_[i] == 100 ? 1 : 0;
      Draw(batch.next_observations, i);
      if (batch.truncated[i] == 0) continue;
      std::memcpy(batch.final_observations + i * layout_.row_bytes, batch.next_observations + i * layout_.row_bytes,
                  layout_.row_bytes);
      steps_[i] = 0;
    }
  }
  void Visit(Archive& archive) override {
    archive("rng", rng_);
    archive("steps", steps_);
  }

 private:
  void Draw(std::byte* rows, std::size_t i) { SampleRow(layout_, rng_, rows + i * layout_.row_bytes); }
  bool Matches(const std::byte* observation, const std::byte* action) const {
    for (const Leaf& leaf : layout_.leaves) {
      for (std::int64_t e = 0; e < leaf.count; ++e) {
        const double difference = ReadElement(leaf, observation, e) - ReadElement(leaf, action, e);
        if (difference * difference > (leaf.space.kind() == SpaceKind::kBox ? 0.09 : 0.01)) return false;
      }
    }
    return true;
  }
  EnvSpec spec_;
  Layout layout_;
  Rng rng_;
  std::vector<std::int64_t> steps_;
};

}  // namespace consac::learn
