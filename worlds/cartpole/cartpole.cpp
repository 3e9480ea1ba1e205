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

/// Carts side by side, so that compilers use vectors for all but sine and cosine. Each has the bits it has alone.
template <std::size_t kCount>
struct Carts {
  double x[kCount], x_dot[kCount], theta[kCount], theta_dot[kCount], force[kCount], sine[kCount], cosine[kCount];

  void Take(std::size_t i, const double (&state)[4], std::int32_t action) {
    x[i] = state[0], x_dot[i] = state[1], theta[i] = state[2], theta_dot[i] = state[3];
    force[i] = action == 1 ? kForce : -kForce;
    sine[i] = std::sin(state[2]), cosine[i] = std::cos(state[2]);
  }

  void Move() {
    for (std::size_t i = 0; i < kCount; ++i) {
      const double push = (force[i] + kPoleMassLength * (theta_dot[i] * theta_dot[i]) * sine[i]) / kTotalMass;
      const double theta_acc = (kGravity * sine[i] - cosine[i] * push) /
                               (kHalfLength * (4.0 / 3.0 - kPoleMass * (cosine[i] * cosine[i]) / kTotalMass));
      const double x_acc = push - kPoleMassLength * theta_acc * cosine[i] / kTotalMass;
      x[i] += kTimeStep * x_dot[i];
      x_dot[i] += kTimeStep * x_acc;
      theta[i] += kTimeStep * theta_dot[i];
      theta_dot[i] += kTimeStep * theta_acc;
    }
  }

  StepResult Give(std::size_t i, double (&state)[4], float* observation) const {
    state[0] = x[i], state[1] = x_dot[i], state[2] = theta[i], state[3] = theta_dot[i];
    for (int k = 0; k < 4; ++k) observation[k] = static_cast<float>(state[k]);
    return {1.0f, std::abs(x[i]) > kFarthest || std::abs(theta[i]) > kLargestAngle};
  }
};

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
  Carts<1> cart;
  cart.Take(0, state_, *action);
  cart.Move();
  return cart.Give(0, state_, observation);
}

void CartPole::StepTogether(const Together<CartPole>& carts) {
  Carts<kTogether> moving;
  for (std::size_t i = 0; i < kTogether; ++i) moving.Take(i, carts.worlds[i]->state_, carts.actions[i]);
  moving.Move();
  for (std::size_t i = 0; i < kTogether; ++i)
    (*carts.results)[i] = moving.Give(i, carts.worlds[i]->state_, carts.observations + 4 * i);
}

void CartPole::SetState(const double (&state)[4]) {
  std::copy(std::begin(state), std::end(state), state_);
}

void CartPole::Visit(Archive& archive) {
  archive("state", std::span<double>(state_));
}

}  // namespace consac::worlds
