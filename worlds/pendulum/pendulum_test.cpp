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

TEST(Pendulum, ItsParametersPullAndWeigh) {
  Swing swing;
  const double weightless[3] = {0.0, 2.0, 1.0};
  swing.pendulum.SetParameters(weightless);
  swing.Turn(0.5 * kHanging, 0.0, 0.0f);
  EXPECT_EQ(swing.seen[2], 0.0f);
  swing.Turn(0.0, 0.0, 2.0f);  // 3 rad/s^2 for 0.05 s
  EXPECT_NEAR(swing.seen[2], 0.15f, 1e-6f);
  const double longer[3] = {10.0, 1.0, 2.0};
  swing.pendulum.SetParameters(longer);
  swing.Turn(0.5 * kHanging, 0.0, 0.0f);  // 7.5 rad/s^2
  EXPECT_NEAR(swing.seen[2], 0.375f, 1e-6f);
}

// A world of defaults that were set is bit for bit one that nobody has touched.
TEST(Pendulum, ItsDefaultsAreWhatItIsWithout) {
  const double defaults[3] = {10.0, 1.0, 1.0};
  Swing touched, untouched;
  touched.pendulum.SetParameters(defaults);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(touched.Turn(0.1 * i, 0.2 * i - 4.0, 0.05f * static_cast<float>(i)).reward,
              untouched.Turn(0.1 * i, 0.2 * i - 4.0, 0.05f * static_cast<float>(i)).reward);
    EXPECT_EQ(touched.seen[2], untouched.seen[2]);
  }
}

}  // namespace
}  // namespace consac::worlds
