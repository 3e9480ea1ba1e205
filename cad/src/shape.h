#pragma once
// One shape of OpenCASCADE as a part: triangles with the colours of faces, and its cylindrical faces.

#include <TopoDS_Shape.hxx>
#include <functional>
#include <optional>

#include "consac/twin/cad.h"

namespace consac::cad {

/// How fine triangles are.
struct Fineness {
  double deflection = 0.0;  ///< farthest that they leave the surface, in the model's unit
  double angle = 0.0;       ///< most between neighbours, rad
};

/// The colour of a face, where it has one of its own.
using ColourOfFace = std::function<std::optional<twin::Colour>(const TopoDS_Shape& face)>;

/// Makes the triangles of `shape`, whose lengths times `metres` are metres. Faces that cannot be are left out and
/// counted. Throws what OpenCASCADE throws.
void TakeShape(const TopoDS_Shape& shape, double metres, const Fineness& fineness, const ColourOfFace& colour_of,
               twin::CadPart* part, twin::Triangles* triangles, std::size_t* left_out);

}  // namespace consac::cad
