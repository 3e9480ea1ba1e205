// Source: CONSAC's own.
#include "worlds/reach3/reach3.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace consac::worlds {
namespace {

constexpr double kUpperArm = 0.5, kForearm = 0.5;                                // m
constexpr double kJointSpeed = 2.0, kArmTick = 0.05;                             // rad/s, s
constexpr double kLowest[3] = {-2.0, -0.2, 0.1}, kHighest[3] = {2.0, 1.6, 2.6};  // rad

// The hand's place: the base turns about z, shoulder and elbow lift in the arm's plane.
void Forward(const double (&joints)[3], double (&hand)[3]) {
  const double lift = joints[1], bend = joints[1] - joints[2];
  const double reach = kUpperArm * std::cos(lift) + kForearm * std::cos(bend);
  hand[0] = reach * std::cos(joints[0]);
  hand[1] = reach * std::sin(joints[0]);
  hand[2] = kUpperArm * std::sin(lift) + kForearm * std::sin(bend);
}

void RandomJoints(Rng& rng, double (&joints)[3]) {
  for (int j = 0; j < 3; ++j) joints[j] = rng.Between(kLowest[j], kHighest[j]);
}

}  // namespace

EnvSpec Reach3::Spec(std::int32_t copies) {
  std::vector<double> high(12, 1.0);
  std::fill(high.begin() + 9, high.end(), 2.0);
  std::vector<double> low = high;
  for (double& bound : low) bound = -bound;
  return SimpleSpec("reach3-v0", Space::Box(low, high, {12}), Space::Box(-1, 1, {3}), copies, 100,
                    std::numeric_limits<double>::quiet_NaN());
}

void Reach3::Observe(float* observation) const {
  for (int j = 0; j < 3; ++j) {
    observation[j] = static_cast<float>(std::sin(joints_[j]));
    observation[3 + j] = static_cast<float>(std::cos(joints_[j]));
    observation[6 + j] = static_cast<float>(hand_[j]);
    observation[9 + j] = static_cast<float>(target_[j] - hand_[j]);
  }
}

void Reach3::Reset(Rng& rng, float* observation) {
  double other[3];
  RandomJoints(rng, joints_);
  RandomJoints(rng, other);
  Forward(joints_, hand_);
  Forward(other, target_);
  Observe(observation);
}

// Costs the distance from hand to target, and a little of the speed.
StepResult Reach3::Step(const Action* action, Rng&, float* observation) {
  double distance = 0.0, effort = 0.0;
  for (int j = 0; j < 3; ++j) {
    const double speed = std::clamp(static_cast<double>(action[j]), -1.0, 1.0);
    joints_[j] = std::clamp(joints_[j] + kArmTick * kJointSpeed * speed, kLowest[j], kHighest[j]);
    effort += speed * speed;
  }
  Forward(joints_, hand_);
  for (int j = 0; j < 3; ++j) distance += (target_[j] - hand_[j]) * (target_[j] - hand_[j]);
  Observe(observation);
  return {static_cast<float>(-std::sqrt(distance) - 0.01 * effort), false};
}

void Reach3::Visit(Archive& archive) {
  archive("joints", std::span<double>(joints_));
  archive("hand", std::span<double>(hand_));
  archive("target", std::span<double>(target_));
}

}  // namespace consac::worlds
