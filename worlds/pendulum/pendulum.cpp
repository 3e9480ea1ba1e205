// Source: Gymnasium's Pendulum-v1: its equations of motion, cost and constants.
#include "worlds/pendulum/pendulum.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consac::worlds {
namespace {

constexpr double kHalfTurn = 3.141592653589793;
constexpr double kMaxSpeed = 8.0, kStep = 0.05;  // rad/s, s
constexpr float kMaxTorque = 2.0f;               // N m

// Python's %: the result has the sign of the divisor.
double WrappedAngle(double angle) {
  const double turned = std::fmod(angle + kHalfTurn, 2.0 * kHalfTurn);
  return (turned < 0.0 ? turned + 2.0 * kHalfTurn : turned) - kHalfTurn;
}

}  // namespace

EnvSpec Pendulum::Spec(std::int32_t copies) {
  EnvSpec spec =
      SimpleSpec("pendulum-v1", Space::Box({-1, -1, -kMaxSpeed}, {1, 1, kMaxSpeed}, {3}),
                 Space::Box(-kMaxTorque, kMaxTorque, {1}), copies, 200, std::numeric_limits<double>::quiet_NaN());
  spec.parameters = {{"gravity", 10.0, 0.0, 100.0, "m/s^2"},
                     {"mass", 1.0, 0.01, 100.0, "of the pendulum, kg"},
                     {"length", 1.0, 0.01, 100.0, "of the pendulum, m"}};
  return spec;
}

void Pendulum::SetParameters(std::span<const double> values) {
  gravity_ = values[0];
  mass_ = values[1];
  length_ = values[2];
}

void Pendulum::Observe(float* observation) const {
  observation[0] = static_cast<float>(std::cos(angle_));
  observation[1] = static_cast<float>(std::sin(angle_));
  observation[2] = static_cast<float>(speed_);
}

void Pendulum::Reset(Rng& rng, float* observation) {
  angle_ = rng.Between(-kHalfTurn, kHalfTurn);
  speed_ = rng.Between(-1.0, 1.0);
  Observe(observation);
}

StepResult Pendulum::Step(const Action* action, Rng&, float* observation) {
  // Gymnasium keeps the torque's own terms in float32, the action's type; the rest is float64.
  const float torque = std::clamp(*action, -kMaxTorque, kMaxTorque);
  const double angle = WrappedAngle(angle_);
  const double cost = angle * angle + 0.1 * (speed_ * speed_) + static_cast<double>(0.001f * (torque * torque));
  const auto pull = static_cast<float>(3.0 / (mass_ * length_ * length_));
  const double acceleration = 3.0 * gravity_ / (2.0 * length_) * std::sin(angle_) + static_cast<double>(pull * torque);
  speed_ = std::clamp(speed_ + acceleration * kStep, -kMaxSpeed, kMaxSpeed);
  angle_ += speed_ * kStep;
  Observe(observation);
  return {static_cast<float>(-cost), false};
}

void Pendulum::SetState(const double (&state)[2]) {
  angle_ = state[0];
  speed_ = state[1];
}

void Pendulum::Visit(Archive& archive) {
  archive("angle", angle_);
  archive("speed", speed_);
  archive("gravity", gravity_);
  archive("mass", mass_);
  archive("length", length_);
}

}  // namespace consac::worlds
