// Source: goals, rate, threshold and length of FetchReach-v4 (Gymnasium-Robotics); the arm is ABB's YuMi.
#include "worlds/yumi_reach/yumi_reach.h"

namespace consac::worlds {
namespace {

// The right tool's ready point +/- 0.15 m, in `world`; the left one's is its mirror.
constexpr std::array<double, 3> kGoalLow = {0.20, -0.30, 0.10}, kGoalHigh = {0.50, 0.00, 0.40};

}  // namespace

std::shared_ptr<const ReachTask> YumiReachTask(YumiReach variant) {
  auto task = std::make_shared<ReachTask>();
  const bool dual = variant == YumiReach::kDual;
  task->id = "yumi-reach-v0";
  task->robot = dual ? YumiBothArms() : YumiRightArm();
  task->tools.push_back({YumiTool(), kGoalLow, kGoalHigh});
  task->ready.assign(YumiReadyPose().begin(), YumiReadyPose().end());
  switch (variant) {
    case YumiReach::kPlain:
      break;
    case YumiReach::kDense:
      task->id = "yumi-reach-dense-v0", task->reward = ReachReward::kDense;
      break;
    case YumiReach::kJoints:
      task->id = "yumi-reach-joints-v0", task->control = ReachControl::kJoints;
      break;
    case YumiReach::kPrecise:
      task->id = "yumi-reach-precise-v0", task->threshold = 0.01;
      break;
    case YumiReach::kDual:
      task->id = "yumi-reach-dual-v0";
      task->tools.push_back(
          {YumiLeftTool(), {kGoalLow[0], -kGoalHigh[1], kGoalLow[2]}, {kGoalHigh[0], -kGoalLow[1], kGoalHigh[2]}});
      for (const double joint : YumiLeftReadyPose()) task->ready.push_back(joint);
      break;
  }
  return task;
}

}  // namespace consac::worlds
