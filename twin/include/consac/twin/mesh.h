#pragma once
// Meshes: STL (binary and text), Wavefront OBJ, Collada and glTF in, binary STL out. Only triangles and colours of
// parts are kept; normals are made here, so that every format looks the same. For files that are not to be trusted.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/twin/model.h"

namespace consac::twin {

inline constexpr std::size_t kMostTriangles = 20'000'000;            ///< of one file
inline constexpr std::size_t kMostMeshBytes = std::size_t{1} << 30;  ///< of one file

/// Triangles that follow each other and have one colour.
struct MeshPart {
  std::size_t first = 0, count = 0;  ///< triangles
  std::optional<Colour> colour;      ///< what the mesh says; none where it says nothing
};

/// A mesh as files have it: corners of triangles, nothing shared.
struct Triangles {
  std::vector<float> corners;   ///< [T, 3 corners, 3], counter-clockwise seen from outside
  std::vector<MeshPart> parts;  ///< together all triangles, in order

  std::size_t count() const { return corners.size() / 9; }  ///< T
};

/// Reads by the ending of the name: .stl, .obj, .dae, .glb, .gltf. kInvalidArgument for another, kDataLoss for a
/// damaged or empty file, kResourceExhausted for one that is too large; each names the file.
Result<Triangles> ReadMesh(const std::string& path);
/// An STL. Triangles without an area are left out.
Result<Triangles> ReadStl(std::span<const std::byte> bytes);
/// A Wavefront OBJ: one part without a colour; colours are in files that are not read.
Result<Triangles> ReadObj(std::string_view text);
/// A Collada file in its own unit, axes as they are (as ROS does it); each material's diffuse colour is its part's.
Result<Triangles> ReadDae(std::string_view text);
/// The bytes of a buffer that a glTF names: its "uri", as it stands there.
using GltfBuffer = std::function<Result<std::vector<std::byte>>(const std::string& uri)>;
/// A glTF 2.0, binary or text: its scene's triangles, turned from y up to z up; each material's colour factor is its
/// part's. `buffer` is asked for what is not in the file.
Result<Triangles> ReadGltf(std::span<const std::byte> bytes, const GltfBuffer& buffer);
/// The bytes of a buffer "data:...;base64,...".
Result<std::vector<std::byte>> GltfBase64(std::string_view uri);
/// As binary STL.
std::vector<std::byte> WriteStl(const Triangles& triangles);
/// Stretches by `scale`; a mirror (one or three negative factors) turns the corners round again.
void Scale(robot::Vector3 scale, Triangles* triangles);

/// A mesh as graphics cards have it.
struct Mesh {
  std::vector<float> positions;        ///< [V, 3]
  std::vector<float> normals;          ///< [V, 3], of length 1
  std::vector<std::uint32_t> indices;  ///< [T, 3]
};
/// Joins equal corners; edges of more than 30 degrees stay sharp. Deterministic. Cost: some hundred bytes and 0.5 us
/// per triangle.
Mesh Weld(const Triangles& triangles);
/// The triangles of a box, cylinder, sphere or capsule of this size (Shape::size), around the origin.
Triangles TrianglesOf(ShapeKind kind, robot::Vector3 size);

/// What a closed mesh of density 1 has: volume, centre of volume, and inertia about it; none where the mesh is open (an
/// edge without its counterpart) or inside out.
std::optional<robot::Inertial> SolidOf(const Triangles& triangles);

}  // namespace consac::twin
