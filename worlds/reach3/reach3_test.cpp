// The arm: where its hand is, what its joints can do, what a step costs.
#include "worlds/reach3/reach3.h"

#include <gtest/gtest.h>

#include <cmath>

#include "worlds/put.h"

namespace consac::worlds {
namespace {

constexpr double kRightAngle = 1.5707963267948966;  // rad

struct ArmWalk {
  Reach3 arm;
  Rng rng{1, 1};
  float seen[12] = {};
  void Put(std::vector<double> joints, std::vector<double> target) {
    worlds::Put(arm, "joints", joints);
    worlds::Put(arm, "target", target);
  }
  StepResult Move(float base, float shoulder, float elbow) {
    const float action[3] = {base, shoulder, elbow};
    return arm.Step(action, rng, seen);
  }
};

TEST(Reach3, AStepCostsTheDistanceToTheTargetAndALittleOfTheSpeed) {
  ArmWalk walk;
  walk.Put({0.0, 0.0, kRightAngle}, {0.5, 0.0, 0.5});  // upper arm ahead, forearm straight down
  StepResult result = walk.Move(0.0f, 0.0f, 0.0f);
  EXPECT_NEAR(walk.seen[6], 0.5f, 1e-6f);
  EXPECT_NEAR(walk.seen[8], -0.5f, 1e-6f);
  EXPECT_NEAR(walk.seen[11], 1.0f, 1e-6f) << "target less hand";
  EXPECT_NEAR(result.reward, -1.0f, 1e-6f);
  EXPECT_FALSE(result.terminated);
  result = walk.Move(1.0f, 0.0f, 0.0f);  // 2 rad/s for 0.05 s
  const double x = 0.5 * std::cos(0.1), y = 0.5 * std::sin(0.1);
  EXPECT_NEAR(walk.seen[7], y, 1e-6);
  EXPECT_NEAR(result.reward, -std::sqrt((0.5 - x) * (0.5 - x) + y * y + 1.0) - 0.01, 1e-6);
}

TEST(Reach3, JointsStopAtTheirLimits) {
  ArmWalk walk;
  walk.Put({2.0, 1.6, 0.1}, {0.0, 0.0, 0.0});
  walk.Move(9.0f, 1.0f, -1.0f);
  EXPECT_NEAR(std::atan2(walk.seen[0], walk.seen[3]), 2.0, 1e-6);
  EXPECT_NEAR(std::atan2(walk.seen[1], walk.seen[4]), 1.6, 1e-6);
  EXPECT_NEAR(std::atan2(walk.seen[2], walk.seen[5]), 0.1, 1e-6);
}

TEST(Reach3, TheTargetIsWithinReach) {
  ArmWalk walk;
  for (int i = 0; i < 200; ++i) {
    walk.arm.Reset(walk.rng, walk.seen);
    double squared = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double place = static_cast<double>(walk.seen[6 + axis]) + static_cast<double>(walk.seen[9 + axis]);
      squared += place * place;
    }
    ASSERT_LE(squared, 1.0 + 1e-5);
  }
}

}  // namespace
}  // namespace consac::worlds
