#pragma once
// Stable Baselines' VecNormalize as one object: observations by their running moments, rewards by the running deviation
// of the return. Whoever collects owns one; what acts elsewhere gets its frozen copy. Private to learn.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "collect/shared_moments.h"
#include "consac/env/vector_env.h"
#include "consac/policy/normaliser.h"

namespace consac::learn {

/// What is normalised, and how far it may go.
struct VecNormaliseOptions {
  bool norm_obs = false;      ///< observations
  bool norm_reward = false;   ///< rewards
  double clip_obs = 10.0;     ///< largest normalised observation
  double clip_reward = 10.0;  ///< largest scaled reward
  double epsilon = 1e-8;      ///< added to variances
  double gamma = 0.99;        ///< discount of the return whose deviation scales the rewards
};

/// Moments of one behaviour's observations and returns. Never allocates after creation.
class VecNormalise {
 public:
  /// For `behaviour`, on each of `ranks`.
  VecNormalise(const BehaviourSpec& behaviour, const VecNormaliseOptions& options, const Communicator& ranks = {});

  /// Begins with the statistics that a model acts by, as if they were of kObservationsOfModel observations.
  Status StartFrom(const ObservationNormaliser& normaliser);
  /// A model says what its statistics are, not of how many observations: enough not to be forgotten at once.
  static constexpr double kObservationsOfModel = 10000;
  /// Takes `rows` <= slots observations into the running moments; without norm_obs nothing.
  void Observe(const std::byte* observations, std::int64_t rows);
  /// observations [rows, row_bytes] -> network inputs [rows, feature_count], normalised where that is wanted.
  void Encode(const std::byte* observations, std::int64_t rows, float* features) const;
  /// Writes the batch's rewards as the learner shall see them, [B].
  void Rewards(const Batch& batch, float* rewards);
  /// The two halves of that, for whoever keeps rewards as they came and learns from them later: takes the batch's into
  /// the running moments,
  void ObserveRewards(const Batch& batch);
  /// and makes of one what the learner shall see now.
  float Reward(float reward) const {
    if (!options_.norm_reward) return reward;
    return static_cast<float>(
        std::clamp(static_cast<double>(reward) * reward_scale_, -options_.clip_reward, options_.clip_reward));
  }
  /// The episode of `slot` is lost: its return begins anew.
  void Forget(std::int32_t slot) { discounted_[static_cast<std::size_t>(slot)] = 0.0f; }
  /// Takes in what the other ranks saw since the last time; all call it at once.
  void Share();
  /// What a policy takes along; inactive without norm_obs.
  const ObservationNormaliser& frozen() const { return frozen_; }

  /// Moments and running returns.
  void Visit(Archive& archive);

 private:
  void Refresh();
  void RefreshRewards();

  VecNormaliseOptions options_;
  Layout layout_;
  SharedMoments observation_moments_, return_moments_;
  ObservationNormaliser frozen_;
  std::vector<float> discounted_;  // [N] running discounted return per slot
  std::vector<float> returns_;     // [N] of a batch
  std::vector<float> work_;        // [N, F] observations as numbers
  double reward_scale_ = 1.0;      // 1 / deviation of the return
};

}  // namespace consac::learn
