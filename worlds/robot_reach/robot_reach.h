#pragma once
// A robot brings its tools to points: the state, actions, observations and rewards of every world of that kind,
// whatever the robot. yumi_reach and twin_reach say which robot, which tools and where goals are. Kinematic: joints
// move within their limits and speeds, nothing has mass; what its capsules touch stops it. With ReachDynamics the same
// motion is what motors are told, and where the joints are is what physics makes of it.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "consac/robot/inverse_kinematics.h"
#include "consac/robot/self_collision.h"
#include "worlds/batched.h"

namespace consac::worlds {

/// How it is controlled.
enum class ReachControl : std::uint8_t {
  kTools,   ///< three numbers for each tool: where it goes, ReachTask::tool_reach a step at most along each axis
  kJoints,  ///< a number for each joint that carries a tool: how far it turns, 0.05 rad a step at most
};
/// How it pays.
enum class ReachReward : std::uint8_t {
  kSparse,  ///< 0 where every tool is within the threshold of its goal, else -1
  kDense,   ///< minus the largest distance, m
};

/// A robot of mass and motors whose joints follow what they are told: the part of a world that is not kinematic. It is
/// one robot; a copy of a world has a clone.
class ReachDynamics {
 public:
  virtual ~ReachDynamics() = default;
  /// Another robot, in the same state.
  virtual std::unique_ptr<ReachDynamics> Clone() const = 0;
  /// Stands still there, [positions]; motors are told to hold it.
  virtual void Place(std::span<const double> joints) = 0;
  /// Motors are told to go to `command` while `seconds` pass; `joints` becomes where they are then. Both [positions].
  virtual void Follow(std::span<const double> command, double seconds, std::span<double> joints) = 0;
  /// Exact state.
  virtual void Visit(Archive& archive) = 0;
  /// Where a link of the joint table is, in the base's frame; none where physics has no body for it.
  virtual std::optional<robot::Transform> LinkPose(std::int32_t link) const = 0;
};

/// A tool, and the box in which its goals are.
struct ReachTool {
  robot::Frame frame;
  std::array<double, 3> low{}, high{};  ///< m, in the base's frame
};

/// Everything that differs between two worlds of this kind.
struct ReachTask {
  std::string id;                ///< of the world
  robot::Robot robot;            ///< pairs of its capsules that may not meet stop a move
  std::vector<ReachTool> tools;  ///< no joint carries two of them
  std::vector<double> ready;     ///< [positions] the pose that it begins in, rad or m
  ReachControl control = ReachControl::kTools;
  ReachReward reward = ReachReward::kSparse;
  double threshold = 0.05;                        ///< m from a goal within which a tool is there
  double tool_reach = 0.05;                       ///< m a step
  std::shared_ptr<const ReachDynamics> dynamics;  ///< null: kinematic. Else its contacts stop moves, no capsules
};

/// Which of the robot's positions carry the frame, from the base on.
std::vector<std::int32_t> CarryingPositions(const robot::Robot& robot, const robot::Frame& frame);

/// One copy. In a row: achieved_goal (the tools), desired_goal, then the observation: joints that carry a tool, their
/// speeds, the tools, their speeds; m, rad, s.
class RobotReach {
 public:
  using Action = float;
  static constexpr std::int64_t kSteps = 50;  ///< of an episode, which never terminates
  static constexpr double kStep = 0.04;       ///< s that one takes: 25 Hz

  /// What it offers: Gymnasium's dictionary of goals.
  static EnvSpec Spec(const ReachTask& task, std::int32_t copies);
  /// N copies that share the task.
  static std::unique_ptr<VectorEnv> Make(std::shared_ptr<const ReachTask> task, std::int32_t copies);
  /// The first copy of an environment that Make made.
  static const RobotReach& FirstOf(const VectorEnv& env);

  /// In the ready pose; its goals are where the tools are.
  explicit RobotReach(std::shared_ptr<const ReachTask> task);
  /// Ready pose, new goals.
  void Reset(Rng& rng, float* observation);
  /// Ready pose, these goals ([tools, 3], m).
  void Begin(std::span<const double> goals);
  /// One step of 0.04 s.
  StepResult Step(const Action* action, Rng&, float* observation);
  /// What a step to `observation` pays.
  float Price(const float* observation) const;
  /// Whether every tool is within the threshold of its goal there, whatever is paid.
  bool Succeeds(const float* observation) const;
  /// Exact state.
  void Visit(Archive& archive);
  /// Writes a row.
  void Observe(float* row) const;
  /// Its task.
  const ReachTask& task() const { return *task_; }
  /// Where all joints are, [positions].
  std::span<const double> joints() const { return joints_; }
  /// Which of them a row has, in its order.
  std::span<const std::int32_t> moving() const { return moving_; }
  /// Where the tools are, [tools, 3], m.
  std::span<const double> tools() const { return tools_; }
  /// Where they should be, [tools, 3], m.
  std::span<const double> goals() const { return goals_; }

 private:
  struct Arm {
    robot::InverseKinematics inverse;  // stands at command_
    std::vector<double> furthest;      // [positions] of a part of a step
  };
  struct Body {
    robot::Kinematics kinematics;
    robot::SelfCollision collision;
  };
  struct Dynamics {  // a copy has a robot of its own
    std::unique_ptr<ReachDynamics> own;

    explicit Dynamics(const ReachDynamics* like) : own(like != nullptr ? like->Clone() : nullptr) {}
    Dynamics(const Dynamics& other) : Dynamics(other.own.get()) {}
    Dynamics(Dynamics&&) = default;
    Dynamics& operator=(Dynamics other) {
      own = std::move(other.own);
      return *this;
    }
  };

  double Furthest(const float* observation) const;
  void MoveTools(const Action* action);
  void MoveJoints(const Action* action);
  void Stand();
  void Turn(double seconds);
  bool Collides();
  void Arrive();

  std::shared_ptr<const ReachTask> task_;
  Dynamics dynamics_;                                            // none: what is told is where the joints are
  std::vector<Arm> arms_;                                        // one for each tool
  std::optional<Body> body_;                                     // where it has capsules that could meet
  robot::PositionLimits limits_;                                 // [positions]
  std::vector<std::int32_t> moving_;                             // positions that carry a tool
  double distance_ = 0.0;                                        // m between the nearest capsules
  std::vector<double> joints_, speeds_, moves_, before_, from_;  // [positions] rad, rad/s
  std::vector<double> command_;                                  // [positions] what motors are told
  std::vector<double> tools_, tool_speeds_, goals_, targets_;    // [tools, 3] m, m/s
};

}  // namespace consac::worlds
