#pragma once
// What the readers of meshes share. Private to twin.

#include <vector>

namespace consac::twin {

/// Appends a triangle, unless it has no area.
void AddTriangle(const float (&corners)[9], std::vector<float>* out);

}  // namespace consac::twin
