#pragma once
// point-reach-v0, point-reach-dense-v0: move a point over a plane to where it is wanted; continuous, with goals as
// Gymnasium has them. The least of what Fetch's reaching is. See README.md.

#include <algorithm>
#include <cmath>
#include <limits>

#include "worlds/batched.h"

namespace consac::worlds {

/// How it is paid: the world's id, and what a step pays that led to so many metres from the goal.
struct PaysWhenThere {
  static constexpr const char* kId = "point-reach-v0";
  static float Of(float distance, float threshold) { return distance <= threshold ? 0.0f : -1.0f; }
};
struct PaysByDistance {
  static constexpr const char* kId = "point-reach-dense-v0";
  static float Of(float distance, float) { return -distance; }
};

/// One copy. Goals are Gymnasium's: achieved_goal, desired_goal and observation, each (x, y) [m], in that order.
template <class Pay>
class PointReach {
 public:
  using Action = float;                       ///< speed along x and y, -1 to 1
  static constexpr float kSide = 1.0f;        ///< m, half the square
  static constexpr float kStride = 0.1f;      ///< m that it goes in a step at full speed
  static constexpr float kThreshold = 0.05f;  ///< m from the goal within which it is there

  /// What it offers.
  static EnvSpec Spec(std::int32_t copies) {
    const Space place = *Space::Box(-kSide, kSide, {2});
    return SimpleSpec(Pay::kId,
                      Space::Dict({{"achieved_goal", place}, {"desired_goal", place}, {"observation", place}}),
                      Space::Box(-1, 1, {2}), copies, 50, std::numeric_limits<double>::quiet_NaN());
  }
  /// Point and goal uniform in the square.
  void Reset(Rng& rng, float* observation) {
    for (float& at : position_) at = static_cast<float>(rng.Between(-kSide, kSide));
    for (float& at : goal_) at = static_cast<float>(rng.Between(-kSide, kSide));
    Observe(observation);
  }
  /// Moves; the sides of the square stop it. It never ends by itself.
  StepResult Step(const Action* action, Rng&, float* observation) {
    for (std::size_t axis = 0; axis < 2; ++axis)
      position_[axis] = std::clamp(position_[axis] + kStride * std::clamp(action[axis], -1.0f, 1.0f), -kSide, kSide);
    Observe(observation);
    return {Price(observation), false};
  }
  /// What a step pays that leads to `observation`.
  static float Price(const float* observation) {
    const float x = observation[2] - observation[0], y = observation[3] - observation[1];
    return Pay::Of(std::sqrt(x * x + y * y), kThreshold);
  }
  /// Exact state.
  void Visit(Archive& archive) {
    archive("position", std::span<float>(position_));
    archive("goal", std::span<float>(goal_));
  }

 private:
  void Observe(float* observation) const {
    std::copy_n(position_, 2, observation);
    std::copy_n(goal_, 2, observation + 2);
    std::copy_n(position_, 2, observation + 4);
  }

  float position_[2] = {}, goal_[2] = {};
};

using PointReachSparse = PointReach<PaysWhenThere>;
using PointReachDense = PointReach<PaysByDistance>;

}  // namespace consac::worlds
