#pragma once
// Joints looked for in an assembly. A CAD file holds shapes and places, no joints: what turns is found by the axes that
// parts share, and what cannot be known from geometry (limits, the zero pose, which of two axes is meant) is said by a
// file of hints or by a URDF. Everything that was looked at is kept with its score and its reason.
//
// How it is judged. Cylindrical faces of two pieces on one line share an axis. One axis, and a pin of one in a bore of
// the other: they turn about it. Several parallel axes: screws, they are fixed to each other; but where these stand in
// a circle around a shared axis, and a pin turns in a bore inside one of the two pieces on it (the output of a servo),
// that piece turns the other. A lone axis with a screw on it is no joint.
//
// Joints that the file has itself (STEP's kinematics, which few programs write) come before geometry and after hints.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/twin/cad.h"

namespace consac::twin {

inline constexpr double kTakenFrom = 0.6;  ///< a candidate of this score is taken without being asked for

/// What moves together before any joint is looked for: a first-level component, or the parts that a hint puts together.
struct CadGroup {
  std::string name;          ///< of the component, or of the hint's link
  robot::Transform place;    ///< of the component, in the world
  robot::Vector3 low, high;  ///< box in the world, m
  bool hinted = false;       ///< a hint's link
  bool connects = false;     ///< a pin, screw or washer that holds others together, no link of its own
};

/// Two groups that may turn about an axis, or are fixed to each other.
struct JointCandidate {
  bool turns = false;                  ///< else fixed
  std::int32_t first = 0, second = 0;  ///< groups
  robot::Vector3 origin, direction;    ///< of the axis in the world, m; direction of length 1
  double score = 0.0;                  ///< 0 to 1
  std::string reason;                  ///< why that score
  std::string verdict;                 ///< what became of it: "joint_1", "fixed", or why it was not taken
};

/// What somebody says of a link.
struct LinkHint {
  std::string name;
  std::vector<std::string> parts;  ///< patterns of paths, "*" and "?"
  double mass = 0.0;               ///< kg; 0 not said
};
/// What somebody says of a joint.
struct JointHint {
  std::string name;
  robot::JointType type = robot::JointType::kRevolute;
  std::string parent, child;  ///< names of hinted links, or patterns of components
  /// The parent's and the child's group where they are known by number: names need not be unique.
  std::optional<std::pair<std::int32_t, std::int32_t>> groups;
  std::string axis = "auto";         ///< "auto", "candidate:N", "component:PATTERN#X"; "" as origin and direction say
  robot::Vector3 origin, direction;  ///< in the world, m
  robot::JointDrive drive;
  bool limited = false;   ///< whether limits are said
  double drawn_at = 0.0;  ///< its position in the pose of the file, rad or m
  bool of_file = false;   ///< nobody's hint: a joint of the CAD file's own
};
/// A file of hints.
struct JointHints {
  std::string base;       ///< pattern of the component that stands still; "" it is looked for
  bool automatic = true;  ///< whether candidates are taken that no hint names
  std::vector<LinkHint> links;
  std::vector<JointHint> joints;
};
/// The hints of a JSON text. kInvalidArgument names what is wrong.
Result<JointHints> ReadHints(std::string_view text);

/// The robot of an assembly.
struct CadRobot {
  std::vector<CadGroup> groups;
  std::vector<JointCandidate> candidates;  ///< best first
  robot::RobotDescription robot;
  std::vector<std::int32_t> link_of_node;  ///< [nodes] -1 of what no link holds
  /// [nodes] "base/servo/horn" without the root's name where there is one root; of a lone root, its name.
  std::vector<std::string> path_of_node;
  std::vector<robot::Transform> place_of_node;  ///< [nodes] in the world, m
  std::vector<robot::Transform> link_place;     ///< [links] frames in the world
  std::vector<double> masses;                   ///< [links] kg, as hints say; 0 not said
  std::vector<std::string> asked;               ///< a line for each thing that the file cannot say
  std::vector<std::string> warnings;
};

/// Looks for joints. kInvalidArgument where a hint names nothing that is there, or makes no tree.
Result<CadRobot> FindJoints(const CadAssembly& assembly, const JointHints& hints);

}  // namespace consac::twin
