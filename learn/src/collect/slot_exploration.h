#pragma once
// What each agent explores by where its action's distribution follows the state (gSDE): a matrix that is drawn at the
// beginning of a rollout and every sde_sample_freq steps. Private to learn.

#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/rng.h"
#include "consac/policy/head.h"

namespace consac::learn {

/// The matrices of all slots. Never allocates after creation.
class SlotExploration {
 public:
  /// For `slots` agents that act by `head`; nothing where no head follows the state.
  SlotExploration(const ActionHead& head, std::int64_t slots, std::uint64_t seed)
      : rng_(seed, StreamId("exploration_matrices")), matrices_(Floats(head, slots)) {}

  /// Floats that it takes.
  static std::size_t Floats(const ActionHead& head, std::int64_t slots) {
    return static_cast<std::size_t>(slots * head.exploration_size());
  }

  /// These slots act: draws for those that have no matrix yet, begin a rollout or have taken sample_freq steps since
  /// the last draw; `taken`(slot) is how many steps it has taken in the rollout.
  template <class Taken>
  SlotNoise Act(const ActionHead& head, std::span<const std::int32_t> slots, const float* log_std, Taken&& taken) {
    if (matrices_.empty()) return {};
    for (const std::int32_t slot : slots) {
      const std::int64_t steps = taken(slot);
      float* matrix = matrices_.data() + slot * head.exploration_size();
      // One of zeros was never drawn: random actions of a warm-up need none, and it may end within a rollout.
      const bool drawn = matrix[0] != 0.0f;
      if (drawn && steps != 0 && (head.sample_freq() <= 0 || steps % head.sample_freq() != 0)) continue;
      head.DrawExploration(log_std, rng_, matrix);
    }
    return {matrices_.data(), slots.data()};
  }

  /// Generator and matrices, where there are any.
  void Visit(Archive& archive) {
    if (matrices_.empty()) return;
    archive("exploration_matrices_rng", rng_);
    archive("exploration_matrices", std::span<float>(matrices_));
  }

 private:
  Rng rng_;
  std::vector<float> matrices_;  // [slots, ActionHead::exploration_size]
};

}  // namespace consac::learn
