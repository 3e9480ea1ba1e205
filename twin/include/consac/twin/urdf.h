#pragma once
// URDF in and out. In: our own reader on pugixml, for files that are not to be trusted. Source of the format:
// wiki.ros.org/urdf/XML. Not read: transmissions, Gazebo's blocks, sensors; xacro must be expanded first.

#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/robot/robot.h"
#include "consac/twin/model.h"

namespace consac::twin {

inline constexpr std::size_t kMostXmlBytes = std::size_t{32} << 20;  ///< of a robot's description

/// The robot that `text` describes. kDataLoss where it is no XML, kInvalidArgument where it is no URDF; both with the
/// line. That the joints are a tree is looked at by MakeRobot.
Result<Model> ReadUrdf(std::string_view text);
/// Adds the pairs of an SRDF's `disable_collisions`; its other content is not read. Errors as ReadUrdf.
Status ReadSrdf(std::string_view text, Model* model);

/// A shape as a writer needs it: of a link by number, in its re-based frame.
struct PlacedShape {
  Shape shape;
  std::int32_t link = 0;
  robot::Transform origin;
  std::string file;      ///< of a mesh, relative to the written file: "meshes/base.stl"
  std::size_t mesh = 0;  ///< of a mesh: its number among the files of an import
};

/// The robot in its re-based frames as URDF: every joint's axis is "1 0 0". The same text for the same robot.
std::string WriteUrdf(const robot::Robot& robot, const std::vector<PlacedShape>& visuals,
                      const std::vector<PlacedShape>& collisions);

}  // namespace consac::twin
