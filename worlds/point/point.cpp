// Source: CONSAC's own.
#include "worlds/point/point.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consac::worlds {
namespace {

constexpr double kTick = 0.1, kPush = 2.0, kDrag = 0.5, kFastest = 2.0;  // s, m/s^2, 1/s, m/s
constexpr double kSide = 1.0;                                            // m, half the square

}  // namespace

EnvSpec Point::Spec(std::int32_t copies) {
  return SimpleSpec("point-v0",
                    Space::Box({-kSide, -kSide, -kFastest, -kFastest, -kSide, -kSide},
                               {kSide, kSide, kFastest, kFastest, kSide, kSide}, {6}),
                    Space::Box(-1, 1, {2}), copies, 100, std::numeric_limits<double>::quiet_NaN());
}

void Point::Observe(float* observation) const {
  for (int axis = 0; axis < 2; ++axis) {
    observation[axis] = static_cast<float>(position_[axis]);
    observation[2 + axis] = static_cast<float>(velocity_[axis]);
    observation[4 + axis] = static_cast<float>(goal_[axis]);
  }
}

void Point::Reset(Rng& rng, float* observation) {
  for (int axis = 0; axis < 2; ++axis) {
    position_[axis] = rng.Between(-kSide, kSide);
    velocity_[axis] = 0.0;
    goal_[axis] = rng.Between(-kSide, kSide);
  }
  Observe(observation);
}

// Costs the distance to the goal and a little of the push, so the best return comes from going there at once.
StepResult Point::Step(const Action* action, Rng&, float* observation) {
  double distance = 0.0, effort = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double push = std::clamp(static_cast<double>(action[axis]), -1.0, 1.0);
    velocity_[axis] =
        std::clamp(velocity_[axis] + kTick * (kPush * push - kDrag * velocity_[axis]), -kFastest, kFastest);
    const double moved = position_[axis] + kTick * velocity_[axis];
    position_[axis] = std::clamp(moved, -kSide, kSide);
    if (position_[axis] != moved) velocity_[axis] = 0.0;  // the wall stops it
    distance += (goal_[axis] - position_[axis]) * (goal_[axis] - position_[axis]);
    effort += push * push;
  }
  Observe(observation);
  return {static_cast<float>(-std::sqrt(distance) - 0.01 * effort), false};
}

void Point::Visit(Archive& archive) {
  archive("position", std::span<double>(position_));
  archive("velocity", std::span<double>(velocity_));
  archive("goal", std::span<double>(goal_));
}

}  // namespace consac::worlds
