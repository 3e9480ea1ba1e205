#include "robot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "consac/base/text.h"
#include "consac/robot/table.h"
#include "files.h"

namespace consac::godot {
namespace {

constexpr std::int64_t kMostParts = 1000;  // of one way: more are no finer
constexpr double kLongest = 1e6;           // s and m: beyond that nothing is meant

bool AllWithin(std::span<const double> numbers, double most) {
  return std::all_of(numbers.begin(), numbers.end(), [&](double number) { return std::abs(number) <= most; });
}

Status WrongNumbers(std::string_view what, const Doubles& given, const std::string& expected) {
  std::string text;
  for (const double number : given.span().first(std::min<std::size_t>(given.span().size(), 8)))
    text += (text.empty() ? "" : ", ") + NumberText(number);
  return {StatusCode::kInvalidArgument, std::string(what) + " is [" + text + "], " +
                                            std::to_string(given.span().size()) + " numbers; expected " + expected +
                                            ", all of them finite"};
}

robot::Vector3 PointOf(std::span<const double> numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

Doubles NumbersOf(const robot::Transform& pose) {
  const robot::Vector3& at = pose.position;
  const robot::Quaternion& turn = pose.rotation;
  return Doubles::Of(std::array<double, 7>{at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w});
}

}  // namespace

ClassTable RobotTable() {
  ClassTable table;
  table.name = "ConsacRobot";
  table.brief = "Exact kinematics of a robot, forward and inverse.";
  table.help =
      "Reads the joint table of [code]consac twin import[/code] and moves a tool by damped least squares, in double "
      "precision. It draws nothing: give its [method positions] to [method ConsacTwin.set_pose]. Poses are in the "
      "robot's base, z up, m, rad; [ConsacTwinConvention] turns them into the engine's.";
  table.make = []() -> Instance* { return new Robot; };
  table.methods = {
      Bind<Robot, &Robot::LastError>("last_error", {},
                                     "Why the latest call that can fail did; \"\" where it went well."),
      Bind<Robot, &Robot::Load>("load", {"path"},
                                "Reads a [code]twin.json[/code] from any path of the engine. What is wrong, or \"\"."),
      Bind<Robot, &Robot::JointNames>("joint_names", {},
                                      "The joints that move by themselves, in the order of positions."),
      Bind<Robot, &Robot::SetTool>("set_tool", {"link", "point"},
                                   "What is to be moved: a point [code][x, y, z][/code] in a link's frame. At first "
                                   "the first end effector's origin."),
      Bind<Robot, &Robot::SetPositions>("set_positions", {"positions"},
                                        "Where all joints stand, rad or m; limits are kept."),
      Bind<Robot, &Robot::Positions>("positions", {}, "Where all joints stand."),
      Bind<Robot, &Robot::Tool>("tool", {},
                                "Where the tool is: x, y, z, then its rotation as a quaternion x, y, z, w."),
      Bind<Robot, &Robot::LinkPose>("link_pose", {"link"}, "The same of a link's frame."),
      Bind<Robot, &Robot::MoveTool>(
          "move_tool", {"way", "seconds", "parts"},
          "Moves the joints so that the tool goes by [code][x, y, z][/code] on a straight line, which is followed in "
          "so many parts; as far as limits and speeds allow in that time. How it is turned is free."),
      Bind<Robot, &Robot::Reach>(
          "reach", {"target"},
          "Moves the joints so that the tool comes to a point [code][x, y, z][/code], or to a pose as [method tool] "
          "says it: [code]{reached, iterations, position_error, orientation_error}[/code]. What is out of reach is "
          "come as near to as was found."),
  };
  return table;
}

Status Robot::Loaded() const {
  if (robot_.has_value()) return Status::Ok();
  return {StatusCode::kFailedPrecondition, "no robot is loaded; call load() first"};
}

Status Robot::Load(const std::string& path) {
  const Result<std::vector<std::byte>> bytes = ReadEngineFile(path);
  if (!bytes.ok()) return bytes.status();
  Result<robot::Robot> read = robot::ReadTable({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!read.ok()) return {read.status().code(), path + ": " + read.status().message()};
  point_.reset(), pose_.reset(), links_.reset();  // they stand on the robot before
  robot_.emplace(*std::move(read));
  links_.emplace(*robot_);
  positions_.assign(robot_->position_joints.size(), 0.0);
  const std::vector<std::int32_t> ends = robot_->EndLinks();
  TakeTool({ends.empty() ? 0 : ends.front(), {}});
  robot::ClampToLimits(point_->limits(), positions_);
  Stand();
  return Status::Ok();
}

void Robot::TakeTool(const robot::Frame& tool) {
  point_.emplace(*robot_, tool, robot::InverseOptions{.task = robot::Task::kPosition});
  pose_.emplace(*robot_, tool, robot::InverseOptions{.task = robot::Task::kPose});
  Stand();
}

void Robot::Stand() {
  point_->Forward(positions_);
  pose_->Forward(positions_);
  links_->Forward(positions_);
}

Array Robot::JointNames() {
  Array names;
  if (!robot_.has_value()) return names;
  for (const std::int32_t joint : robot_->position_joints)
    names.Append(Variant::Of(std::string_view(robot_->joints[static_cast<std::size_t>(joint)].name)));
  return names;
}

Result<std::int32_t> Robot::LinkOf(const std::string& link) const {
  CONSAC_RETURN_IF_ERROR(Loaded());
  const std::int32_t found = robot_->FindLink(link);
  if (found >= 0) return found;
  std::vector<std::string_view> names;
  for (const robot::Link& each : robot_->links) names.push_back(each.name);
  return Status{StatusCode::kNotFound, "there is no link " + Quote(link) + Suggestion(link, names)};
}

Status Robot::SetTool(const std::string& link, const Doubles& point) {
  const Result<std::int32_t> found = LinkOf(link);
  if (!found.ok()) return found.status();
  if (point.span().size() != 3 || !AllWithin(point.span(), kLongest)) return WrongNumbers("the point", point, "3");
  TakeTool({*found, {{}, PointOf(point.span())}});
  return Status::Ok();
}

Status Robot::SetPositions(const Doubles& positions) {
  CONSAC_RETURN_IF_ERROR(Loaded());
  if (positions.span().size() != positions_.size() || !AllWithin(positions.span(), kLongest))
    return WrongNumbers("what was given for positions", positions, std::to_string(positions_.size()));
  std::copy(positions.span().begin(), positions.span().end(), positions_.begin());
  robot::ClampToLimits(point_->limits(), positions_);
  Stand();
  return Status::Ok();
}

Doubles Robot::Positions() {
  return Doubles::Of(positions_);
}

Result<Doubles> Robot::Tool() {
  CONSAC_RETURN_IF_ERROR(Loaded());
  return NumbersOf(point_->tool());
}

Result<Doubles> Robot::LinkPose(const std::string& link) {
  const Result<std::int32_t> found = LinkOf(link);
  if (!found.ok()) return found.status();
  return NumbersOf(links_->links()[static_cast<std::size_t>(*found)]);
}

Status Robot::MoveTool(const Doubles& way, double seconds, std::int64_t parts) {
  CONSAC_RETURN_IF_ERROR(Loaded());
  if (way.span().size() != 3 || !AllWithin(way.span(), kLongest)) return WrongNumbers("the way", way, "3");
  if (!(seconds > 0.0 && seconds <= kLongest))
    return {StatusCode::kInvalidArgument, "the way takes " + NumberText(seconds) + " s; expected more than 0"};
  if (parts < 1 || parts > kMostParts)
    return {StatusCode::kInvalidArgument,
            "the way has " + std::to_string(parts) + " parts; expected 1 to " + std::to_string(kMostParts)};
  point_->Advance(PointOf(way.span()), seconds, static_cast<int>(parts), positions_);
  Stand();
  return Status::Ok();
}

Result<Dictionary> Robot::Reach(const Doubles& target) {
  CONSAC_RETURN_IF_ERROR(Loaded());
  const std::span<const double> numbers = target.span();
  if ((numbers.size() != 3 && numbers.size() != 7) || !AllWithin(numbers, kLongest))
    return WrongNumbers("the target", target, "3 of a point or 7 of a pose");
  robot::Transform wanted{{}, PointOf(numbers)};
  if (numbers.size() == 7) {
    const robot::Quaternion turn{numbers[3], numbers[4], numbers[5], numbers[6]};
    wanted.rotation = robot::Normalised(turn);
    if (!(std::abs(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z + turn.w * turn.w - 1.0) < 1e-3))
      return WrongNumbers("the target", target, "a quaternion of length 1 behind the point");
  }
  const robot::InverseResult result = (numbers.size() == 3 ? point_ : pose_)->Solve(wanted, positions_);
  Stand();
  Dictionary said;
  said.Set("reached", Variant::Of(result.reached));
  said.Set("iterations", Variant::Of(std::int64_t{result.iterations}));
  said.Set("position_error", Variant::Of(result.position_error));
  said.Set("orientation_error", Variant::Of(result.orientation_error));
  return said;
}

}  // namespace consac::godot
