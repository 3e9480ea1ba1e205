#pragma once
// A robot as a file describes it: its joints (core's RobotDescription) and what it looks like. Readers make it,
// import.h makes files of it. Frames, lengths and angles are the file's: metres, radians, z up; nothing is re-based
// yet.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "consac/robot/robot.h"

namespace consac::twin {

/// Red, green, blue and opacity from 0 to 1, as a display shows them (sRGB).
using Colour = std::array<double, 4>;
inline constexpr Colour kDefaultColour = {0.8, 0.8, 0.8, 1.0};  ///< where a file names none

/// What kind of shape.
enum class ShapeKind : std::uint8_t { kMesh, kBox, kCylinder, kSphere, kCapsule };

/// One piece of a link's looks, or of what it collides by.
struct Shape {
  std::string link;
  std::string name;         ///< the file's; "" none
  robot::Transform origin;  ///< in the link's frame
  ShapeKind kind = ShapeKind::kBox;
  std::string mesh;  ///< file, as the description names it: "package://arm/meshes/base.stl"
  /// Mesh: scale of x, y, z. Box: lengths of its sides, m. Cylinder and capsule: radius, radius, length of the straight
  /// part, along z, m. Sphere: radius, m, three times.
  robot::Vector3 size{1, 1, 1};
  bool has_colour = false;  ///< whether the description says one; a mesh may have its own
  Colour colour = kDefaultColour;
  std::string material;  ///< its name; "" none
};

inline constexpr std::size_t kMostShapes = 10'000;  ///< of one robot's looks, and of what it collides by

/// A robot and its looks.
struct Model {
  std::string format;  ///< of its file: "urdf", "mjcf"
  robot::RobotDescription robot;
  std::vector<Shape> visuals, collisions;
  std::vector<std::pair<std::string, std::string>> allowed_collisions;  ///< links that may touch
  std::vector<std::string> warnings;  ///< a line each: what was left out or looks wrong
};

}  // namespace consac::twin
