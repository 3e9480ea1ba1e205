#pragma once
// Assemblies made by hand, for tests that need no CAD kernel.

#include <string>

#include "consac/twin/cad.h"
#include "consac/twin/mesh.h"

namespace consac::twin {

/// Parts of cylinders, each with a box of triangles of its size; lengths in mm.
class HandMade {
 public:
  HandMade() {
    assembly.format = "step", assembly.unit = "millimetre";
    assembly.nodes.push_back({"robot", -1, -1, {}, std::nullopt});
  }
  /// A cylindrical face along z at (x, y) from `from` to `to`.
  static CadCylinder Along(double x, double y, double radius, double from, double to, bool bore) {
    return {{x / 1000, y / 1000, 0}, {0, 0, 1}, radius / 1000, from / 1000, to / 1000, 2 * robot::kPiRadians, bore};
  }
  /// A component with these faces, in the world's frame; its number among the components.
  std::int32_t Add(const std::string& name, std::vector<CadCylinder> cylinders, double size_mm = 100.0,
                   robot::Transform place = {}) {
    const double half = size_mm / 2000.0;
    CadPart part{name, {-half, -half, -half}, {half, half, half}, std::move(cylinders)};
    assembly.parts.push_back(part);
    assembly.nodes.push_back({name, 0, static_cast<std::int32_t>(assembly.parts.size()) - 1, place, std::nullopt});
    return static_cast<std::int32_t>(assembly.parts.size()) - 1;
  }
  /// The same below a component of several parts; adds the component where it is not there.
  void AddTo(const std::string& component, const std::string& name, std::vector<CadCylinder> cylinders,
             robot::Transform place = {}) {
    std::int32_t parent = -1;
    for (std::size_t n = 0; n < assembly.nodes.size(); ++n) {
      if (assembly.nodes[n].name == component && assembly.nodes[n].part < 0) parent = static_cast<std::int32_t>(n);
    }
    if (parent < 0) {
      parent = static_cast<std::int32_t>(assembly.nodes.size());
      assembly.nodes.push_back({component, 0, -1, place, std::nullopt});
    }
    (void)Add(name, std::move(cylinders));
    assembly.nodes.back().parent = parent;
    assembly.nodes.back().place = Inverse(place);
  }
  /// As a stream.
  std::vector<std::byte> Stream() const {
    std::vector<std::byte> out;
    CadWriter writer(
        [&](std::span<const std::byte> bytes) {
          out.insert(out.end(), bytes.begin(), bytes.end());
          return true;
        },
        assembly.format, assembly.unit);
    for (const CadPart& part : assembly.parts) writer.AddPart(part, TrianglesOf(ShapeKind::kBox, part.high - part.low));
    for (const CadNode& node : assembly.nodes) writer.AddNode(node);
    for (const CadJoint& joint : assembly.joints) writer.AddJoint(joint);
    for (const std::string& line : assembly.warnings) writer.AddWarning(line);
    (void)writer.End();
    return out;
  }

  CadAssembly assembly;
};

}  // namespace consac::twin
