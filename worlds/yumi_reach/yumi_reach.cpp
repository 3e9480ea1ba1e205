// Source: goals, rate, threshold and length of FetchReach-v4 (Gymnasium-Robotics); the arm is ABB's YuMi.
#include "worlds/yumi_reach/yumi_reach.h"

namespace consac::worlds {
namespace {

using robot::Vector3;

constexpr int kParts = 2;                            // of a tick: a straight line is followed this finely
constexpr double kToolReach = 0.05;                  // m a step
constexpr double kJointReach = 0.05;                 // rad a step
constexpr double kGoalLow[3] = {0.20, -0.30, 0.10};  // m, in `world`
constexpr double kGoalHigh[3] = {0.50, 0.00, 0.40};

constexpr robot::InverseOptions kFreeOrientation = {.task = robot::Task::kPosition};

}  // namespace

YumiArmState::YumiArmState() : inverse_(YumiRightArm(), YumiTool(), kFreeOrientation), joints_(YumiReadyPose()) {
  inverse_.Forward(joints_);
  Arrive(joints_);
}

// Turns the joints by `moves`, within their limits.
void YumiArmState::Turn(std::span<const double> moves) {
  for (std::size_t j = 0; j < kYumiJoints; ++j) joints_[j] += moves[j];
  ClampToLimits(inverse_.limits(), joints_);
  inverse_.Forward(joints_);
}

// Speeds and the tool after joints have moved from `from` within a tick.
void YumiArmState::Arrive(const std::array<double, kYumiJoints>& from) {
  const Vector3 at = inverse_.tool().position;
  for (std::size_t j = 0; j < kYumiJoints; ++j) speeds_[j] = (joints_[j] - from[j]) / kStep;
  const std::array<double, kGoal> now = {at.x, at.y, at.z};
  for (std::size_t i = 0; i < kGoal; ++i) tool_speed_[i] = (now[i] - tool_[i]) / kStep;
  tool_ = now;
}

void YumiArmState::Reset(Rng& rng) {
  joints_ = YumiReadyPose();
  inverse_.Forward(joints_);
  Arrive(joints_);
  tool_speed_ = {};
  for (std::size_t i = 0; i < kGoal; ++i) goal_[i] = rng.Between(kGoalLow[i], kGoalHigh[i]);
}

void YumiArmState::MoveTool(const float* action) {
  const std::array<double, kYumiJoints> from = joints_;
  const auto way = [&](std::size_t i) { return kToolReach * std::clamp(static_cast<double>(action[i]), -1.0, 1.0); };
  const Vector3 target = Vector3{tool_[0], tool_[1], tool_[2]} + Vector3{way(0), way(1), way(2)};
  std::array<double, kYumiJoints> furthest, moves;
  for (std::size_t j = 0; j < kYumiJoints; ++j) furthest[j] = inverse_.limits().velocity[j] * kStep / kParts;
  Vector3 at{tool_[0], tool_[1], tool_[2]};
  for (int part = 0; part < kParts; ++part) {
    inverse_.Step((1.0 / (kParts - part)) * (target - at), {}, furthest, moves);
    Turn(moves);
    at = inverse_.tool().position;
  }
  Arrive(from);
}

void YumiArmState::MoveJoints(const float* action) {
  const std::array<double, kYumiJoints> from = joints_;
  std::array<double, kYumiJoints> moves;
  for (std::size_t j = 0; j < kYumiJoints; ++j)
    moves[j] = kJointReach * std::clamp(static_cast<double>(action[j]), -1.0, 1.0);
  Turn(moves);
  Arrive(from);
}

void YumiArmState::Observe(float* row) const {
  const auto put = [&](const auto& values) {
    for (const double value : values) *row++ = static_cast<float>(value);
  };
  put(tool_), put(goal_), put(joints_), put(speeds_), put(tool_), put(tool_speed_);
}

void YumiArmState::Visit(Archive& archive) {
  archive("joints", std::span<double>(joints_));
  archive("speeds", std::span<double>(speeds_));
  archive("tool", std::span<double>(tool_));
  archive("tool_speed", std::span<double>(tool_speed_));
  archive("goal", std::span<double>(goal_));
  inverse_.Forward(joints_);  // they may have been read
}

}  // namespace consac::worlds
