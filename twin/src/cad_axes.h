#pragma once
// Axes that cylinders of an assembly share. Private to twin.

#include <vector>

#include "consac/twin/cad.h"

namespace consac::twin {

/// Cylindrical faces of one node on one axis, of one radius and side, joined.
struct Carrier {
  std::int32_t group = 0, node = 0;
  double radius = 0.0;
  double from = 0.0, to = 0.0;  ///< along the axis from its point, m
  double sweep = 0.0;           ///< rad, of all of them
  bool concave = false;
};

/// A line and what lies on it.
struct AxisLine {
  robot::Vector3 point;           ///< the nearest to the world's origin
  robot::Vector3 direction;       ///< its first component that is not 0 is positive
  std::vector<Carrier> carriers;  ///< by group, node, side, radius, place
};

inline constexpr double kSameDirection = 0.1 * robot::kPiRadians / 180.0;  ///< rad
inline constexpr double kSameLine = 0.05e-3;                               ///< m

/// All axes, in an order of the file's. `groups` says which group a node is of, -1 none. Cost: linear in the cylinders.
std::vector<AxisLine> FindAxes(const CadAssembly& assembly, const std::vector<std::int32_t>& groups,
                               const std::vector<robot::Transform>& places);

}  // namespace consac::twin
