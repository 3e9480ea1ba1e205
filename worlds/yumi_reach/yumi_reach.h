#pragma once
// yumi-reach-v0 and its variants: one arm of ABB's YuMi brings its tool to a point; kinematic, goals as in FetchReach.
// See README.md.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "consac/robot/inverse_kinematics.h"
#include "worlds/batched.h"
#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::worlds {

/// How a variant is controlled.
enum class YumiControl : std::uint8_t {
  kTool,    ///< three numbers: where the tool goes, 5 cm a step at most
  kJoints,  ///< seven numbers: how far each joint turns, 0.05 rad a step at most
};
/// How it pays.
enum class YumiReward : std::uint8_t {
  kSparse,  ///< 0 within the threshold, else -1
  kDense,   ///< minus the distance, m
};

/// The arm and its goal, whatever the variant.
class YumiArmState {
 public:
  static constexpr std::size_t kGoal = 3;          ///< numbers of a goal: x, y, z in `world`, m
  static constexpr std::size_t kObservation = 20;  ///< joints, their speeds, the tool, its speed; rad, m, s
  static constexpr std::size_t kRow = 2 * kGoal + kObservation;
  static constexpr double kStep = 0.04;  ///< s that one takes: 25 Hz

  YumiArmState();
  /// Ready pose; the goal anywhere in a cube of 0.3 m around its tool point.
  void Reset(Rng& rng);
  /// The tool goes along `action` (-1 to 1 each), by damped least squares, within limits and speeds.
  void MoveTool(const float* action);
  /// Each joint turns by `action` (-1 to 1 each).
  void MoveJoints(const float* action);
  /// Writes achieved_goal, desired_goal and observation, kRow numbers.
  void Observe(float* row) const;
  /// Exact state.
  void Visit(Archive& archive);

 private:
  void Turn(std::span<const double> moves);
  void Arrive(const std::array<double, kYumiJoints>& from);

  robot::InverseKinematics inverse_;                          // stands at joints_
  std::array<double, kYumiJoints> joints_, speeds_{};         // rad, rad/s
  std::array<double, kGoal> tool_{}, tool_speed_{}, goal_{};  // m, m/s
};

/// A variant: its id, how it is controlled, how it pays, how near is near (m).
struct YumiReachBase {
  static constexpr const char* kId = "yumi-reach-v0";
  static constexpr YumiControl kControl = YumiControl::kTool;
  static constexpr YumiReward kReward = YumiReward::kSparse;
  static constexpr double kNear = 0.05;
};
struct YumiReachDense : YumiReachBase {
  static constexpr const char* kId = "yumi-reach-dense-v0";
  static constexpr YumiReward kReward = YumiReward::kDense;
};
struct YumiReachJoints : YumiReachBase {
  static constexpr const char* kId = "yumi-reach-joints-v0";
  static constexpr YumiControl kControl = YumiControl::kJoints;
};
struct YumiReachPrecise : YumiReachBase {
  static constexpr const char* kId = "yumi-reach-precise-v0";
  static constexpr double kNear = 0.01;
};

/// One copy.
template <class Variant>
class YumiReach {
 public:
  using Action = float;
  static constexpr std::int64_t kSteps = 50;  ///< of an episode, which never terminates

  /// What it offers: Gymnasium's dictionary of goals.
  static EnvSpec Spec(std::int32_t copies) {
    constexpr double kAnything = std::numeric_limits<double>::infinity();
    const Space goal = *Space::Box(-kAnything, kAnything, {YumiArmState::kGoal});
    const Space seen = *Space::Box(-kAnything, kAnything, {YumiArmState::kObservation});
    const std::int64_t actions = Variant::kControl == YumiControl::kTool ? 3 : static_cast<std::int64_t>(kYumiJoints);
    return SimpleSpec(Variant::kId,
                      Space::Dict({{"achieved_goal", goal}, {"desired_goal", goal}, {"observation", seen}}),
                      Space::Box(-1, 1, {actions}), copies, kSteps, std::numeric_limits<double>::quiet_NaN());
  }
  /// Ready pose, a new goal.
  void Reset(Rng& rng, float* observation) {
    arm_.Reset(rng);
    arm_.Observe(observation);
  }
  /// One step of 0.04 s.
  StepResult Step(const Action* action, Rng&, float* observation) {
    if constexpr (Variant::kControl == YumiControl::kTool)
      arm_.MoveTool(action);
    else
      arm_.MoveJoints(action);
    arm_.Observe(observation);
    return {Price(observation), false};
  }
  /// What a step to `observation` pays.
  static float Price(const float* observation) {
    double squared = 0.0;
    for (std::size_t i = 0; i < YumiArmState::kGoal; ++i) {
      const double off =
          static_cast<double>(observation[i]) - static_cast<double>(observation[YumiArmState::kGoal + i]);
      squared += off * off;
    }
    const double distance = std::sqrt(squared);
    if constexpr (Variant::kReward == YumiReward::kDense) return static_cast<float>(-distance);
    return distance > Variant::kNear ? -1.0f : 0.0f;
  }
  /// Exact state.
  void Visit(Archive& archive) { arm_.Visit(archive); }

 private:
  YumiArmState arm_;
};

}  // namespace consac::worlds
