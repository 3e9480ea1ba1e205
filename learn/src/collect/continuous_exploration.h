#pragma once
// How algorithms of continuous actions explore besides what their policy draws: uniform actions, and noise added to
// what was chosen. Actions are raw ones, from -1 to 1. Private to learn.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/rng.h"
#include "consac/env/batch.h"

namespace consac::learn {

/// Which noise.
enum class ActionNoiseKind : std::uint8_t { kNone, kNormal, kOrnsteinUhlenbeck };

/// Noise that is added to actions.
struct ActionNoiseOptions {
  ActionNoiseKind kind = ActionNoiseKind::kNone;  ///< which
  double mean = 0.0;                              ///< of each number, or what it is drawn back to
  double sigma = 0.1;                             ///< deviation, or that of a unit of time
  double theta = 0.15;                            ///< Ornstein-Uhlenbeck: how strongly it is drawn back
  double dt = 0.01;                               ///< Ornstein-Uhlenbeck: time of a step

  /// The noise after `before`, given a standard normal number. Source: Stable Baselines, NormalActionNoise and
  /// OrnsteinUhlenbeckActionNoise.
  double Next(double before, double normal) const {
    if (kind == ActionNoiseKind::kNormal) return mean + sigma * normal;
    return before + theta * (mean - before) * dt + sigma * std::sqrt(dt) * normal;
  }
};

/// What is done besides what the policy says.
struct ContinuousExplorationOptions {
  ActionNoiseOptions noise;         ///< added to what the policy says
  double random_exploration = 0.0;  ///< probability of a uniform action instead
  bool policy_warms_up = false;     ///< the policy acts before learning_starts, too, in place of uniform actions
};

/// Draws for every slot. Never allocates after creation.
class ContinuousExploration {
 public:
  /// For `slots` agents with actions of `size` numbers.
  ContinuousExploration(const ContinuousExplorationOptions& options, std::int64_t slots, std::int64_t size,
                        std::uint64_t seed)
      : options_(options),
        size_(static_cast<std::size_t>(size)),
        rng_(seed, StreamId("exploration")),
        noise_(static_cast<std::size_t>(slots) * size_) {}

  /// raw [rows, size], what the policy chose for these slots, becomes what they do: uniform where `random`, and as
  /// often as random_exploration says; elsewhere with noise, within -1 and 1.
  void Explore(std::span<const std::int32_t> slots, bool random, float* raw) {
    for (const std::int32_t slot : slots) {
      if (random || (options_.random_exploration > 0.0 && rng_.UniformDouble() < options_.random_exploration)) {
        for (std::size_t i = 0; i < size_; ++i) raw[i] = 2.0f * rng_.Uniform() - 1.0f;
      } else if (options_.noise.kind != ActionNoiseKind::kNone) {
        AddNoise(noise_.data() + static_cast<std::size_t>(slot) * size_, raw);
      }
      raw += size_;
    }
  }
  /// A slot's episode begins: its noise begins at zero.
  void Begin(std::int32_t slot) {
    std::fill_n(noise_.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(slot) * size_), size_, 0.0);
  }
  /// Episodes that the batch ended begin anew.
  void Record(const Batch& batch) {
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      if ((batch.terminated[i] | batch.truncated[i]) != 0) Begin(batch.slots[i]);
    }
  }

  /// Generator and noise.
  void Visit(Archive& archive) {
    archive("exploration_rng", rng_);
    archive("action_noise", std::span<double>(noise_));
  }

 private:
  void AddNoise(double* noise, float* raw) {
    for (std::size_t i = 0; i < size_; ++i) {
      noise[i] = options_.noise.Next(noise[i], static_cast<double>(rng_.Normal()));
      raw[i] = std::clamp(raw[i] + static_cast<float>(noise[i]), -1.0f, 1.0f);
    }
  }

  ContinuousExplorationOptions options_;
  std::size_t size_;
  Rng rng_;
  std::vector<double> noise_;  // [N, size] of each slot's latest action
};

}  // namespace consac::learn
