// Source: Barto, Sutton and Anderson 1983; constants and integrator as Gymnasium's CartPole-v1.
#include "worlds/cartpole/cartpole.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace consac::worlds {
namespace {

constexpr double kGravity = 9.8, kCartMass = 1.0, kPoleMass = 0.1, kHalfLength = 0.5;  // m/s^2, kg, kg, m
constexpr double kForce = 10.0, kTimeStep = 0.02;                                      // N, s
constexpr double kTotalMass = kCartMass + kPoleMass, kPoleMassLength = kPoleMass * kHalfLength;
constexpr double kFarthest = 2.4;                                         // m
constexpr double kLargestAngle = 12.0 * 2.0 * 3.141592653589793 / 360.0;  // rad

}  // namespace

EnvSpec CartPole::Spec(std::int32_t copies) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<double> high = {kFarthest * 2, kInfinity, kLargestAngle * 2, kInfinity};
  return SimpleSpec("cartpole-v1", Space::Box({-high[0], -high[1], -high[2], -high[3]}, high, {4}), Space::Discrete(2),
                    copies, 500, 475.0);
}

void CartPole::Observe(float* observation) const {
  for (int i = 0; i < 4; ++i) observation[i] = static_cast<float>(state_[i]);
}

void CartPole::Reset(Rng& rng, float* observation) {
  for (double& value : state_) value = rng.Between(-0.05, 0.05);
  Observe(observation);
}

StepResult CartPole::Step(const Action* action, Rng&, float* observation) {
  auto& [x, x_dot, theta, theta_dot] = state_;
  const double force = *action == 1 ? kForce : -kForce;
  const double cosine = std::cos(theta), sine = std::sin(theta);
  const double push = (force + kPoleMassLength * (theta_dot * theta_dot) * sine) / kTotalMass;
  const double theta_acc =
      (kGravity * sine - cosine * push) / (kHalfLength * (4.0 / 3.0 - kPoleMass * (cosine * cosine) / kTotalMass));
  const double x_acc = push - kPoleMassLength * theta_acc * cosine / kTotalMass;
  x += kTimeStep * x_dot;
  x_dot += kTimeStep * x_acc;
  theta += kTimeStep * theta_dot;
  theta_dot += kTimeStep * theta_acc;
  Observe(observation);
  const bool fell = x < -kFarthest || x > kFarthest || theta < -kLargestAngle || theta > kLargestAngle;
  return {1.0f, fell};
}

void CartPole::SetState(const double (&state)[4]) {
  std::copy(std::begin(state), std::end(state), state_);
}

void CartPole::Visit(Archive& archive) {
  archive("state", std::span<double>(state_));
}

}  // namespace consac::worlds
