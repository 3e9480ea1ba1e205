#pragma once
// What the writers of glTF and USD share: colours as materials. Private to twin.

#include <array>
#include <string>
#include <vector>

#include "consac/twin/mesh.h"

namespace consac::twin {

inline constexpr double kRoughness = 0.6;  ///< where nobody knows: painted metal and plastics

/// A colour of displays made linear, without its opacity. Source: IEC 61966-2-1.
std::array<double, 3> LinearOf(const Colour& colour);

/// The materials of a scene; equal colours are one.
class Palette {
 public:
  /// A material.
  struct Material {
    std::string name;
    Colour colour;
  };
  /// The number of the material of a mesh's part that a shape shows: the shape's colour, else the part's own.
  std::size_t Of(const Shape& shape, const MeshPart& part);
  /// So far.
  const std::vector<Material>& materials() const { return materials_; }

 private:
  std::vector<Material> materials_;
};

}  // namespace consac::twin
