// Source: rate, length and the shape of goals of FetchReach-v4 (Gymnasium-Robotics).
#include "worlds/robot_reach/robot_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consac::worlds {
namespace {

using robot::Vector3;

constexpr int kParts = 2;             // of a step: a straight line is followed this finely
constexpr double kJointReach = 0.05;  // rad a step
constexpr double kLeash = 0.2;        // rad or m that what motors are told is ahead of where joints are, at most
constexpr std::size_t kAxes = 3;
constexpr robot::InverseOptions kFreeOrientation = {.task = robot::Task::kPosition};

Vector3 PointOf(std::span<const double> rows, std::size_t tool) {
  return {rows[kAxes * tool], rows[kAxes * tool + 1], rows[kAxes * tool + 2]};
}

void PutPoint(Vector3 point, std::size_t tool, std::span<double> rows) {
  rows[kAxes * tool] = point.x, rows[kAxes * tool + 1] = point.y, rows[kAxes * tool + 2] = point.z;
}

std::vector<std::int32_t> MovingOf(const ReachTask& task) {
  std::vector<std::int32_t> moving;
  for (const ReachTool& tool : task.tools) {
    for (const std::int32_t position : CarryingPositions(task.robot, tool.frame)) moving.push_back(position);
  }
  return moving;
}

}  // namespace

std::vector<std::int32_t> CarryingPositions(const robot::Robot& robot, const robot::Frame& frame) {
  std::vector<std::int32_t> positions;
  for (std::int32_t link = frame.link; link > 0; link = robot.joints[static_cast<std::size_t>(link) - 1].parent) {
    const std::int32_t position = robot.joints[static_cast<std::size_t>(link) - 1].position_index;
    if (position >= 0 && std::find(positions.begin(), positions.end(), position) == positions.end())
      positions.insert(positions.begin(), position);
  }
  return positions;
}

EnvSpec RobotReach::Spec(const ReachTask& task, std::int32_t copies) {
  constexpr double kAnything = std::numeric_limits<double>::infinity();
  const auto goals = static_cast<std::int64_t>(kAxes * task.tools.size());
  const auto moving = static_cast<std::int64_t>(MovingOf(task).size());
  const Space goal = *Space::Box(-kAnything, kAnything, {goals});
  const Space seen = *Space::Box(-kAnything, kAnything, {2 * moving + 2 * goals});
  return SimpleSpec(task.id.c_str(),
                    Space::Dict({{"achieved_goal", goal}, {"desired_goal", goal}, {"observation", seen}}),
                    Space::Box(-1, 1, {task.control == ReachControl::kTools ? goals : moving}), copies, kSteps,
                    std::numeric_limits<double>::quiet_NaN());
}

std::unique_ptr<VectorEnv> RobotReach::Make(std::shared_ptr<const ReachTask> task, std::int32_t copies) {
  EnvSpec spec = Spec(*task, copies);
  return std::make_unique<Batched<RobotReach>>(std::move(spec), RobotReach(std::move(task)), copies);
}

const RobotReach& RobotReach::FirstOf(const VectorEnv& env) {
  return static_cast<const Batched<RobotReach>&>(env).world(0);
}

RobotReach::RobotReach(std::shared_ptr<const ReachTask> task)
    : task_(std::move(task)),
      dynamics_(task_->dynamics.get()),
      limits_(LimitsOf(task_->robot)),
      moving_(MovingOf(*task_)) {
  const std::size_t positions = task_->ready.size(), goals = kAxes * task_->tools.size();
  for (std::vector<double>* row : {&joints_, &speeds_, &moves_, &before_, &from_, &command_}) row->resize(positions);
  for (std::vector<double>* row : {&tools_, &tool_speeds_, &goals_, &targets_}) row->resize(goals);
  for (const ReachTool& tool : task_->tools) {
    Arm arm{robot::InverseKinematics(task_->robot, tool.frame, kFreeOrientation), limits_.velocity};
    for (double& furthest : arm.furthest) furthest *= kStep / kParts;
    arms_.push_back(std::move(arm));
  }
  Body body{robot::Kinematics(task_->robot), robot::SelfCollision(task_->robot)};
  if (!body.collision.pairs().empty() && dynamics_.own == nullptr) body_ = std::move(body);
  joints_ = command_ = task_->ready;
  if (dynamics_.own != nullptr) dynamics_.own->Place(joints_);
  Stand();
  goals_ = tools_;
}

// Computes what follows from the joints.
void RobotReach::Stand() {
  for (std::size_t i = 0; i < arms_.size(); ++i) {
    arms_[i].inverse.Forward(joints_);
    PutPoint(arms_[i].inverse.tool().position, i, tools_);
    if (dynamics_.own != nullptr) arms_[i].inverse.Forward(command_);
  }
  distance_ = std::numeric_limits<double>::infinity();
  if (!body_.has_value()) return;
  body_->kinematics.Forward(joints_);
  distance_ = body_->collision.Find(body_->kinematics.links()).distance;
}

// Whether capsules overlap, and more than they did: a pose that already touches can be left.
bool RobotReach::Collides() {
  if (!body_.has_value()) return false;
  body_->kinematics.Forward(command_);
  const double distance = body_->collision.Find(body_->kinematics.links()).distance;
  if (distance < 0.0 && distance < distance_) return true;
  distance_ = distance;
  return false;
}

// Turns what motors are told by moves_, within the joints' limits, and the joints with it while `seconds` pass. Without
// motors not at all where the robot would touch itself; with them what is told does not run away from what is stopped.
void RobotReach::Turn(double seconds) {
  before_ = command_;
  for (std::size_t j = 0; j < command_.size(); ++j) command_[j] += moves_[j];
  ClampToLimits(limits_, command_);
  if (dynamics_.own == nullptr) {
    if (Collides()) command_ = before_;
    joints_ = command_;
    return;
  }
  for (std::size_t j = 0; j < command_.size(); ++j)
    command_[j] = std::clamp(command_[j], joints_[j] - kLeash, joints_[j] + kLeash);
  dynamics_.own->Follow(command_, seconds, joints_);
}

// Speeds and the tools after joints have moved from from_ within a step.
void RobotReach::Arrive() {
  for (std::size_t j = 0; j < joints_.size(); ++j) speeds_[j] = (joints_[j] - from_[j]) / kStep;
  for (std::size_t i = 0; i < arms_.size(); ++i) {
    robot::InverseKinematics& inverse = arms_[i].inverse;
    if (dynamics_.own != nullptr) inverse.Forward(joints_);
    const Vector3 at = inverse.tool().position, way = at - PointOf(tools_, i);
    PutPoint({way.x / kStep, way.y / kStep, way.z / kStep}, i, tool_speeds_);
    PutPoint(at, i, tools_);
    if (dynamics_.own != nullptr) inverse.Forward(command_);
  }
}

void RobotReach::MoveTools(const Action* action) {
  const auto way = [&](std::size_t i) {
    return task_->tool_reach * std::clamp(static_cast<double>(action[i]), -1.0, 1.0);
  };
  for (std::size_t i = 0; i < arms_.size(); ++i) PutPoint(arms_[i].inverse.tool().position, i, targets_);
  for (std::size_t i = 0; i < targets_.size(); ++i) targets_[i] += way(i);
  for (int part = 0; part < kParts; ++part) {
    for (std::size_t i = 0; i < arms_.size(); ++i) {
      Arm& arm = arms_[i];
      const Vector3 left = PointOf(targets_, i) - arm.inverse.tool().position;
      arm.inverse.Step((1.0 / (kParts - part)) * left, {}, arm.furthest, moves_);
      Turn(i + 1 == arms_.size() ? kStep / kParts : 0.0);
      arm.inverse.Forward(command_);
    }
  }
}

void RobotReach::MoveJoints(const Action* action) {
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    moves_[static_cast<std::size_t>(moving_[i])] = kJointReach * std::clamp(static_cast<double>(action[i]), -1.0, 1.0);
  }
  Turn(kStep);
  for (Arm& arm : arms_) arm.inverse.Forward(command_);
}

void RobotReach::Begin(std::span<const double> goals) {
  joints_ = command_ = task_->ready;
  if (dynamics_.own != nullptr) dynamics_.own->Place(joints_);
  Stand();
  std::fill(speeds_.begin(), speeds_.end(), 0.0);
  std::fill(tool_speeds_.begin(), tool_speeds_.end(), 0.0);
  std::copy(goals.begin(), goals.end(), goals_.begin());
}

void RobotReach::Reset(Rng& rng, float* observation) {
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const ReachTool& tool = task_->tools[i / kAxes];
    targets_[i] = rng.Between(tool.low[i % kAxes], tool.high[i % kAxes]);
  }
  Begin(targets_);
  Observe(observation);
}

StepResult RobotReach::Step(const Action* action, Rng&, float* observation) {
  from_ = joints_;
  if (task_->control == ReachControl::kTools)
    MoveTools(action);
  else
    MoveJoints(action);
  Arrive();
  Observe(observation);
  return {Price(observation), false};
}

// How far the tool that is farthest from its goal is from it, m.
double RobotReach::Furthest(const float* observation) const {
  double furthest = 0.0;
  for (std::size_t tool = 0; tool < task_->tools.size(); ++tool) {
    double squared = 0.0;
    for (std::size_t i = kAxes * tool; i < kAxes * (tool + 1); ++i) {
      const double off = static_cast<double>(observation[i]) - static_cast<double>(observation[goals_.size() + i]);
      squared += off * off;
    }
    furthest = std::max(furthest, std::sqrt(squared));
  }
  return furthest;
}

float RobotReach::Price(const float* observation) const {
  const double furthest = Furthest(observation);
  if (task_->reward == ReachReward::kDense) return static_cast<float>(-furthest);
  return furthest > task_->threshold ? -1.0f : 0.0f;
}

bool RobotReach::Succeeds(const float* observation) const {
  return Furthest(observation) <= task_->threshold;
}

void RobotReach::Observe(float* row) const {
  const auto put = [&](const std::vector<double>& values) {
    for (const double value : values) *row++ = static_cast<float>(value);
  };
  const auto put_moving = [&](const std::vector<double>& values) {
    for (const std::int32_t position : moving_) *row++ = static_cast<float>(values[static_cast<std::size_t>(position)]);
  };
  put(tools_), put(goals_), put_moving(joints_), put_moving(speeds_), put(tools_), put(tool_speeds_);
}

void RobotReach::Visit(Archive& archive) {
  archive("joints", std::span<double>(joints_));
  archive("speeds", std::span<double>(speeds_));
  archive("tool", std::span<double>(tools_));
  archive("tool_speed", std::span<double>(tool_speeds_));
  archive("goal", std::span<double>(goals_));
  if (dynamics_.own != nullptr) {
    archive("command", std::span<double>(command_));
    dynamics_.own->Visit(archive);
  } else if (archive.loading()) {
    command_ = joints_;
  }
  if (archive.loading()) Stand();
}

}  // namespace consac::worlds
