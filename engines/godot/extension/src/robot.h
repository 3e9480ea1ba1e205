#pragma once
// ConsacRobot: a robot's exact kinematics for scripts, from the joint table twin.json: where its links are, and how its
// joints must move to bring a tool somewhere (core's robot module, in double precision). It has no nodes and stands
// where its base is; the scene is ConsacTwin's, in GDScript. Poses are along the robot's axes, z up, m; a script turns
// them by ConsacTwinConvention, so that units and handedness change in one place.

#include <optional>
#include <string>
#include <vector>

#include "binding/class.h"
#include "consac/robot/inverse_kinematics.h"

namespace consac::godot {

/// The class's name and methods.
ClassTable RobotTable();

/// An object of it. One thread.
class Robot : public Instance {
 public:
  /// Reads a table from any path of the engine. All positions are as near to 0 as limits allow; the tool is at the
  /// first end effector's origin.
  Status Load(const std::string& path);
  /// The joints that move by themselves, in the order of positions.
  Array JointNames();
  /// What moves: a point ([3], m) in a link's frame.
  Status SetTool(const std::string& link, const Doubles& point);
  /// [positions], rad or m; limits are kept.
  Status SetPositions(const Doubles& positions);
  Doubles Positions();
  /// The tool's point and rotation: x, y, z, then a quaternion x, y, z, w.
  Result<Doubles> Tool();
  /// Likewise, of a link's frame.
  Result<Doubles> LinkPose(const std::string& link);
  /// Moves all joints so that the tool goes by `way` ([3], m) on a straight line, in `parts` steps, as far as limits
  /// and speeds allow within `seconds`.
  Status MoveTool(const Doubles& way, double seconds, std::int64_t parts);
  /// Moves all joints so that the tool comes to a point ([3]) or a pose ([7], as Tool says it): {reached, iterations,
  /// position_error, orientation_error}; where it cannot be reached, as near as was found.
  Result<Dictionary> Reach(const Doubles& target);

 private:
  Status Loaded() const;
  Result<std::int32_t> LinkOf(const std::string& link) const;
  void TakeTool(const robot::Frame& tool);
  void Stand();

  std::optional<robot::Robot> robot_;
  std::optional<robot::InverseKinematics> point_, pose_;  // for a tool whose orientation is free, and held
  std::optional<robot::Kinematics> links_;
  std::vector<double> positions_;  // where all three stand
};

}  // namespace consac::godot
