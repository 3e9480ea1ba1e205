// The pendulum by hand; that it is Gymnasium's step by step is shown in tests/python/test_gymnasium.py.
#include "worlds/pendulum/pendulum.h"

#include <gtest/gtest.h>

namespace consac::worlds {
namespace {

constexpr double kHanging = 3.141592653589793;  // rad from upright

struct Swing {
  Pendulum pendulum;
  Rng rng{1, 1};
  float seen[3] = {};
  StepResult Turn(double angle, double speed, float torque) {
    pendulum.SetState({angle, speed});
    return pendulum.Step(&torque, rng, seen);
  }
};

// angle^2 + 0.1 speed^2 + 0.001 torque^2, of the state before the step.
TEST(Pendulum, AStepCostsAngleSpeedAndTorque) {
  Swing swing;
  EXPECT_EQ(swing.Turn(0.0, 0.0, 0.0f).reward, 0.0f);
  EXPECT_NEAR(swing.Turn(kHanging, 0.0, 0.0f).reward, -9.8696044f, 1e-5f);
  EXPECT_NEAR(swing.Turn(kHanging + 0.5, 0.0, 0.0f).reward, -(kHanging - 0.5) * (kHanging - 0.5), 1e-5)
      << "the shorter way around";
  EXPECT_NEAR(swing.Turn(0.0, 2.0, 0.0f).reward, -0.4f, 1e-6f);
  EXPECT_NEAR(swing.Turn(0.0, 0.0, 2.0f).reward, -0.004f, 1e-7f);
  EXPECT_FALSE(swing.Turn(kHanging, 8.0, 2.0f).terminated);
}

TEST(Pendulum, TorqueAndSpeedHaveLimits) {
  Swing swing;
  swing.Turn(0.0, 0.0, 2.0f);  // 6 rad/s^2 for 0.05 s
  EXPECT_NEAR(swing.seen[2], 0.3f, 1e-6f);
  swing.Turn(0.0, 0.0, 50.0f);
  EXPECT_NEAR(swing.seen[2], 0.3f, 1e-6f);
  swing.Turn(0.5 * kHanging, 8.0, 2.0f);
  EXPECT_EQ(swing.seen[2], 8.0f);
}

}  // namespace
}  // namespace consac::worlds
