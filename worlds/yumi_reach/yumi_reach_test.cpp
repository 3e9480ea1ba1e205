// YuMi's arm against RobotStudio, and what a controller that knows the way comes to.
#include "worlds/yumi_reach/yumi_reach.h"

#include <gtest/gtest.h>

#include <cmath>

#include "consac/env/buffer.h"
#include "worlds/put.h"
#include "worlds/registry.h"

namespace consac::worlds {
namespace {

// RobotStudio's poses of one arm (examples/robots/yumi/reference_fk.json), degrees and mm.
struct StudioPose {
  double joints[7];
  robot::Vector3 flange;
};
constexpr StudioPose kStudio[] = {
    {{0, 0, 0, 0, 0, 0, 0}, {341.5, 0.0, 598.0}},
    {{20, 20, 20, 20, 20, 20, 20}, {292.46, 234.73, 348.75}},
    {{-80, -80, -80, -80, -80, -80, -80}, {-126.6, 499.23, 441.88}},
    {{162, 1, -23, -88, 241, 98, -44}, {45.84, 32.22, 846.74}},
    {{-20, -139, -144, 77, -263, 128, -104}, {-47.12, -136.89, 270.77}},
};

TEST(YumiReach, TheArmIsWhereRobotStudioSays) {
  robot::Kinematics kinematics(YumiRightArm());
  const robot::Transform base = kinematics.links()[1] *
                                robot::Transform{robot::Inverse(YumiRightArm().joints[0].axis_turn), {}} *
                                robot::Transform{{0, 0, 1, 0}, {0, 0, -0.206}};
  for (const StudioPose& pose : kStudio) {
    std::array<double, 7> joints;
    for (std::size_t j = 0; j < 7; ++j) joints[j] = pose.joints[j] * robot::kPiRadians / 180.0;
    kinematics.Forward(joints);
    const robot::Transform flange = kinematics.Pose(YumiTool()) * robot::Transform{{}, {0, 0, -0.136}};
    EXPECT_LT(Norm(Inverse(base) * flange.position - 0.001 * pose.flange), 1e-5);
  }
}

TEST(YumiReach, TheReadyPoseHoldsTheToolStraightDown) {
  robot::Kinematics kinematics(YumiRightArm());
  kinematics.Forward(YumiReadyPose());
  const robot::Transform tool = kinematics.Pose(YumiTool());
  EXPECT_LT(Norm(tool.position - robot::Vector3{0.35, -0.15, 0.25}), 1e-3);
  EXPECT_LT(Rotate(tool.rotation, {0, 0, 1}).z, -0.999);
}

constexpr std::size_t kRow = 26, kDualRow = 52;  // numbers of an observation

struct Score {
  double success = 0.0, mean_return = 0.0;
};

// Episodes with an action of `act(row, action)`; success is the last step's.
template <class Act>
Score Play(YumiReach variant, const Act& act) {
  RobotReach world(YumiReachTask(variant));
  Rng rng(1, 1);
  float row[kDualRow], action[7];
  constexpr int kEpisodes = 300;
  Score score;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    world.Reset(rng, row);
    StepResult result;
    for (std::int64_t step = 0; step < RobotReach::kSteps; ++step) {
      act(row, action, rng);
      result = world.Step(action, rng, row);
      score.mean_return += static_cast<double>(result.reward) / kEpisodes;
      EXPECT_FALSE(result.terminated);
    }
    score.success += (result.reward > -0.5f ? 1.0 : 0.0) / kEpisodes;
  }
  return score;
}

// Straight to the goal, 5 cm a step at most: an axis alone may go as far.
void Straight(const float* row, float* action, Rng&) {
  const float way[3] = {row[3] - row[0], row[4] - row[1], row[5] - row[2]};
  const float length = std::sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
  for (std::size_t i = 0; i < 3; ++i) action[i] = way[i] / std::max(length, 0.05f);
}

void AtRandom(const float*, float* action, Rng& rng) {
  for (std::size_t i = 0; i < 7; ++i) action[i] = static_cast<float>(rng.Between(-1, 1));
}

TEST(YumiReach, TheStraightWayAlwaysArrivesAndChanceDoesNot) {
  const Score straight = Play(YumiReach::kPlain, Straight);
  EXPECT_NEAR(straight.success, 1.0, 1e-9);
  EXPECT_NEAR(straight.mean_return, -1.96, 0.1) << "a prototype that solved once a step came to -2.27";
  EXPECT_GT(Play(YumiReach::kPrecise, Straight).success, 0.98);
  EXPECT_LT(Play(YumiReach::kPlain, AtRandom).success, 0.05);
}

TEST(YumiReach, JointsArriveByDampedLeastSquares) {
  robot::InverseKinematics inverse(YumiRightArm(), YumiTool(), {.task = robot::Task::kPosition});
  const Score score = Play(YumiReach::kJoints, [&](const float* row, float* action, Rng&) {
    std::array<double, 7> joints, moves;
    for (std::size_t j = 0; j < 7; ++j) joints[j] = static_cast<double>(row[6 + j]);
    const robot::Vector3 way{double{row[3]} - double{row[0]}, double{row[4]} - double{row[1]},
                             double{row[5]} - double{row[2]}};
    inverse.Forward(joints);
    inverse.Step(way, {}, {}, moves);
    for (std::size_t j = 0; j < 7; ++j) action[j] = static_cast<float>(std::clamp(moves[j] / 0.05, -1.0, 1.0));
  });
  EXPECT_GT(score.success, 0.99);
}

TEST(YumiReach, SpeedsAndLimitsAreKept) {
  RobotReach arm(YumiReachTask(YumiReach::kPlain));
  Rng rng(3, 1);
  const robot::PositionLimits limits = robot::LimitsOf(YumiRightArm());
  float row[kRow];
  arm.Reset(rng, row);
  for (int step = 0; step < 2000; ++step) {
    const float action[3] = {static_cast<float>(rng.Between(-1, 1)), static_cast<float>(rng.Between(-1, 1)),
                             step % 400 < 200 ? 1.0f : -1.0f};
    (void)arm.Step(action, rng, row);
    for (std::size_t j = 0; j < 7; ++j) {
      EXPECT_LE(std::abs(static_cast<double>(row[13 + j])), limits.velocity[j] * (1 + 1e-6));
      EXPECT_GE(static_cast<double>(row[6 + j]), limits.lower[j] - 1e-6);
      EXPECT_LE(static_cast<double>(row[6 + j]), limits.upper[j] + 1e-6);
    }
  }
}

TEST(YumiReach, PaysByTheDistanceToItsGoal) {
  const RobotReach plain(YumiReachTask(YumiReach::kPlain)), dense(YumiReachTask(YumiReach::kDense));
  float row[kDualRow] = {0, 0, 0, 0, 0.03f, 0.04f};
  EXPECT_EQ(plain.Price(row), 0.0f) << "0.05 m is near";
  EXPECT_NEAR(dense.Price(row), -0.05f, 1e-7f);
  EXPECT_EQ(RobotReach(YumiReachTask(YumiReach::kPrecise)).Price(row), -1.0f);
  row[5] = 0.041f;
  EXPECT_EQ(plain.Price(row), -1.0f);
}

// To the goal, and on to another place: what the info says is where the tool is, though the reward is its distance.
TEST(YumiReach, TellsWhetherItSucceedsWhateverItPays) {
  const auto env = MakeWorld("yumi-reach-dense-v0", 2);
  ASSERT_TRUE(env.ok());
  ASSERT_EQ((*env)->infos().size(), 1u);
  const InfoColumn& told = (*env)->infos()[0];
  EXPECT_EQ(told.name, "is_success");
  ASSERT_EQ(told.values.size(), 2u);
  BatchBuffer buffer((*env)->spec().behaviours[0]);
  (*env)->Reset(1, {&buffer.batch(), 1});
  bool near_once = false, far_once = false;
  for (int step = 0; step < 20; ++step) {
    buffer.Advance();
    const auto* rows = reinterpret_cast<const float*>(buffer.batch().observations);
    auto* actions = reinterpret_cast<float*>(buffer.batch().actions);
    for (std::size_t i = 0; i < 3; ++i) {
      actions[i] = (rows[3 + i] - rows[i]) / 0.05f;
      actions[3 + i] = -1.0f;
    }
    (*env)->Step({&buffer.batch(), 1});
    for (std::size_t copy = 0; copy < 2; ++copy) {
      const bool near = buffer.batch().rewards[copy] >= -0.05f;
      EXPECT_EQ(told.values[copy], near ? 1.0f : 0.0f) << step;
      (near ? near_once : far_once) = true;
    }
  }
  EXPECT_TRUE(near_once && far_once);
}

TEST(YumiReach, BothArmsMustArrive) {
  const RobotReach dual(YumiReachTask(YumiReach::kDual));
  float row[kDualRow] = {};
  EXPECT_EQ(dual.Price(row), 0.0f);
  row[8] = 0.06f;  // the left goal
  EXPECT_EQ(dual.Price(row), -1.0f);
  row[8] = 0.0f, row[6] = 0.06f;  // the right one
  EXPECT_EQ(dual.Price(row), -1.0f);
}

TEST(YumiReach, TheLeftArmIsReadyAsTheRightOnesMirror) {
  const RobotReach dual(YumiReachTask(YumiReach::kDual));
  ASSERT_EQ(dual.tools().size(), 6u);
  EXPECT_NEAR(dual.tools()[0], 0.35, 1e-3);
  EXPECT_NEAR(dual.tools()[1], -0.15, 1e-3);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(dual.tools()[3 + i], (i == 1 ? -1.0 : 1.0) * dual.tools()[i], 3e-3) << "bases differ by 3 mm at most";
  EXPECT_EQ(dual.joints().size(), 14u);
}

// Each arm straight to its goal; the same arm alone goes the same way as long as they do not touch.
TEST(YumiReach, TwoArmsArriveWhereGoalsAreApart) {
  RobotReach dual(YumiReachTask(YumiReach::kDual));
  Rng rng(4, 1);
  float row[kDualRow], action[6];
  int arrived = 0, apart = 0;
  for (int episode = 0; episode < 100; ++episode) {
    dual.Reset(rng, row);
    const bool is_apart = row[10] - row[7] > 0.15f;
    StepResult result;
    for (std::int64_t step = 0; step < RobotReach::kSteps; ++step) {
      for (std::size_t i = 0; i < 6; ++i) action[i] = (row[6 + i] - row[i]) / 0.05f;
      result = dual.Step(action, rng, row);
    }
    apart += is_apart ? 1 : 0;
    arrived += is_apart && result.reward > -0.5f ? 1 : 0;
  }
  EXPECT_GT(apart, 50);
  EXPECT_EQ(arrived, apart);
}

double ArmsApart(const RobotReach& dual) {
  robot::Kinematics kinematics(YumiBothArms());
  kinematics.Forward(dual.joints());
  return robot::SelfCollision(YumiBothArms()).Find(kinematics.links()).distance;
}

TEST(YumiReach, ArmsThatWouldTouchStop) {
  RobotReach dual(YumiReachTask(YumiReach::kDual));
  Rng rng(5, 1);
  float row[kDualRow];
  dual.Reset(rng, row);
  EXPECT_GT(ArmsApart(dual), 0.05);
  const float together[6] = {0, 1, 0, 0, -1, 0}, away[6] = {0, -1, 0, 0, 1, 0};
  for (int step = 0; step < 40; ++step) (void)dual.Step(together, rng, row);
  EXPECT_GE(ArmsApart(dual), 0.0);
  EXPECT_LT(ArmsApart(dual), 0.05) << "they came near each other";
  const double before = row[1];
  (void)dual.Step(together, rng, row);
  EXPECT_NEAR(row[1], before, 0.03) << "and are stopped there";
  for (int step = 0; step < 4; ++step) (void)dual.Step(away, rng, row);
  EXPECT_GT(ArmsApart(dual), 0.05) << "but may leave";
  for (int step = 0; step < 3000; ++step) {
    float action[6];
    for (float& part : action) part = static_cast<float>(rng.Between(-1, 1));
    (void)dual.Step(action, rng, row);
    ASSERT_GE(ArmsApart(dual), 0.0);
  }
}

}  // namespace
}  // namespace consac::worlds
