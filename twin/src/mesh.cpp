#include "consac/twin/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <unordered_map>

#include "consac/base/file.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "files.h"
#include "triangles.h"

namespace consac::twin {
namespace {

using robot::Cross;
using robot::Dot;
using robot::Norm;
using robot::Vector3;

constexpr double kSharpCosine = 0.86602540378443865;  // of 30 degrees
constexpr std::size_t kMostAround = 256;              // triangles at a point before its edges are all taken for smooth

Vector3 Corner(const Triangles& triangles, std::size_t corner) {
  const float* at = &triangles.corners[3 * corner];
  return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
}

// Its length is twice the triangle's area.
Vector3 AreaNormal(const Triangles& triangles, std::size_t triangle) {
  const Vector3 a = Corner(triangles, 3 * triangle), b = Corner(triangles, 3 * triangle + 1),
                c = Corner(triangles, 3 * triangle + 2);
  return Cross(b - a, c - a);
}

// Three floats as bits; 0 and -0 are the same point.
struct PointBits {
  std::uint32_t bits[3];
  explicit PointBits(const float* at) {
    for (int i = 0; i < 3; ++i) {
      const float value = at[i] == 0.0f ? 0.0f : at[i];
      std::memcpy(&bits[i], &value, sizeof value);
    }
  }
  friend bool operator==(const PointBits&, const PointBits&) = default;
};
struct PointHash {
  std::size_t operator()(const PointBits& point) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15ull;
    for (const std::uint32_t bits : point.bits) hash = (hash ^ bits) * 0xD6E8FEB86659FD93ull, hash ^= hash >> 32;
    return static_cast<std::size_t>(hash);
  }
};

// Which point each corner is: [3 T], numbers in order of first appearance.
std::vector<std::uint32_t> PointsOf(const Triangles& triangles, std::uint32_t* count) {
  std::unordered_map<PointBits, std::uint32_t, PointHash> numbers;
  numbers.reserve(triangles.count());
  std::vector<std::uint32_t> points(3 * triangles.count());
  for (std::size_t corner = 0; corner < points.size(); ++corner) {
    const auto next = static_cast<std::uint32_t>(numbers.size());
    points[corner] = numbers.emplace(PointBits(&triangles.corners[3 * corner]), next).first->second;
  }
  *count = static_cast<std::uint32_t>(numbers.size());
  return points;
}

}  // namespace

void AddTriangle(const float (&corners)[9], std::vector<float>* out) {
  const bool flat = std::memcmp(corners, corners + 3, 12) == 0 || std::memcmp(corners, corners + 6, 12) == 0 ||
                    std::memcmp(corners + 3, corners + 6, 12) == 0;
  if (flat) return;
  const double u[3] = {double{corners[3]} - double{corners[0]}, double{corners[4]} - double{corners[1]},
                       double{corners[5]} - double{corners[2]}};
  const double v[3] = {double{corners[6]} - double{corners[0]}, double{corners[7]} - double{corners[1]},
                       double{corners[8]} - double{corners[2]}};
  const double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  if (normal[0] == 0.0 && normal[1] == 0.0 && normal[2] == 0.0) return;
  out->insert(out->end(), corners, corners + 9);
}

namespace {

// A buffer of the glTF at `path`: in its text, or a file beside it, which no name leads away from.
Result<std::vector<std::byte>> BufferBeside(const std::string& path, const std::string& uri) {
  if (uri.starts_with("data:")) return GltfBase64(uri);
  CONSAC_RETURN_IF_ERROR(CheckFolderName("a buffer's file", uri));
  const std::filesystem::path file = ToPath(path).parent_path() / ToPath(uri);
  std::error_code error;
  if (std::filesystem::is_symlink(file, error))
    return Status{StatusCode::kInvalidArgument, "its buffer " + Quote(uri, 300) + " is a link; make a .glb of it"};
  return ReadRegularFile(FromPath(file), kMostMeshBytes);
}

}  // namespace

Result<Triangles> ReadMesh(const std::string& path) {
  const std::string ending = EndingOf(path);
  const bool gltf = ending == ".glb" || ending == ".gltf";
  if (ending != ".stl" && ending != ".obj" && ending != ".dae" && !gltf)
    return Status{StatusCode::kInvalidArgument,
                  "mesh " + Quote(path, 300) + ": its ending is " + Quote(ending) +
                      "; .stl, .obj, .dae, .glb and .gltf are read, convert it to one of them"};
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path, kMostMeshBytes);
  if (!bytes.ok()) return bytes.status();
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const auto beside = [&](const std::string& uri) { return BufferBeside(path, uri); };
  Result<Triangles> triangles = ending == ".stl"   ? ReadStl(*bytes)
                                : ending == ".obj" ? ReadObj(text)
                                : gltf             ? ReadGltf(*bytes, beside)
                                                   : ReadDae(text);
  if (!triangles.ok())
    return Status{triangles.status().code(), "mesh " + Quote(path, 300) + ": " + triangles.status().message()};
  if (triangles->count() == 0)
    return Status{StatusCode::kDataLoss, "mesh " + Quote(path, 300) + ": it holds no triangle that has an area"};
  return triangles;
}

void Scale(Vector3 scale, Triangles* triangles) {
  const float factors[3] = {static_cast<float>(scale.x), static_cast<float>(scale.y), static_cast<float>(scale.z)};
  for (std::size_t i = 0; i < triangles->corners.size(); ++i) triangles->corners[i] *= factors[i % 3];
  if (scale.x * scale.y * scale.z >= 0.0) return;
  for (std::size_t t = 0; t < triangles->count(); ++t)
    std::swap_ranges(&triangles->corners[9 * t + 3], &triangles->corners[9 * t + 6], &triangles->corners[9 * t + 6]);
}

Mesh Weld(const Triangles& triangles) {
  const std::size_t count = triangles.count();
  std::uint32_t point_count = 0;
  const std::vector<std::uint32_t> points = PointsOf(triangles, &point_count);
  std::vector<Vector3> area(count);
  for (std::size_t t = 0; t < count; ++t) area[t] = AreaNormal(triangles, t);
  // Corners at each point, one after another.
  std::vector<std::uint32_t> begin(point_count + 1, 0), around(points.size());
  for (const std::uint32_t point : points) ++begin[point + 1];
  for (std::size_t p = 0; p < point_count; ++p) begin[p + 1] += begin[p];
  std::vector<std::uint32_t> filled = begin;
  for (std::size_t corner = 0; corner < points.size(); ++corner)
    around[filled[points[corner]]++] = static_cast<std::uint32_t>(corner);

  Mesh mesh;
  mesh.indices.resize(points.size());
  std::vector<std::pair<std::array<float, 3>, std::uint32_t>> here;  // normals at one point, and their vertices
  for (std::size_t p = 0; p < point_count; ++p) {
    here.clear();
    const std::size_t many = begin[p + 1] - begin[p];
    for (std::size_t i = begin[p]; i < begin[p + 1]; ++i) {
      const Vector3 own = area[around[i] / 3];
      const double length = Norm(own);
      Vector3 sum;
      for (std::size_t k = begin[p]; k < begin[p + 1] && (many <= kMostAround || here.empty()); ++k) {
        const Vector3 other = area[around[k] / 3];
        if (many > kMostAround || Dot(own, other) >= kSharpCosine * length * Norm(other)) sum = sum + other;
      }
      if (!(Norm(sum) > 0.0)) sum = length > 0.0 ? own : Vector3{0, 0, 1};
      const Vector3 unit = (1.0 / Norm(sum)) * sum;
      const std::array<float, 3> normal = {static_cast<float>(unit.x), static_cast<float>(unit.y),
                                           static_cast<float>(unit.z)};
      const auto same =
          many > kMostAround && !here.empty()
              ? here.begin()
              : std::find_if(here.begin(), here.end(), [&](const auto& each) { return each.first == normal; });
      if (same != here.end()) {
        mesh.indices[around[i]] = same->second;
        continue;
      }
      const auto vertex = static_cast<std::uint32_t>(mesh.positions.size() / 3);
      const float* at = &triangles.corners[3 * static_cast<std::size_t>(around[i])];
      mesh.positions.insert(mesh.positions.end(), at, at + 3);
      mesh.normals.insert(mesh.normals.end(), normal.begin(), normal.end());
      mesh.indices[around[i]] = vertex;
      here.emplace_back(normal, vertex);
    }
  }
  return mesh;
}

// Source: the divergence theorem over signed tetrahedra; Blow and Binstock 2004 for the second moments.
std::optional<robot::Inertial> SolidOf(const Triangles& triangles) {
  std::uint32_t point_count = 0;
  const std::vector<std::uint32_t> points = PointsOf(triangles, &point_count);
  std::unordered_map<std::uint64_t, std::int32_t> edges;
  for (std::size_t corner = 0; corner < points.size(); ++corner) {
    const std::uint64_t a = points[corner], b = points[corner - corner % 3 + (corner + 1) % 3];
    if (a < b) ++edges[(a << 32) | b];
    if (b < a) --edges[(b << 32) | a];
  }
  for (const auto& [edge, balance] : edges) {
    if (balance != 0) return std::nullopt;
  }
  double volume = 0.0;
  Vector3 first;                                          // of x, y, z over the volume
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // of products
  const auto second = [](double a0, double b0, double c0, double a1, double b1, double c1) {
    return (a0 * a1 + b0 * b1 + c0 * c1 + (a0 + b0 + c0) * (a1 + b1 + c1)) / 20.0;
  };
  for (std::size_t t = 0; t < triangles.count(); ++t) {
    const Vector3 a = Corner(triangles, 3 * t), b = Corner(triangles, 3 * t + 1), c = Corner(triangles, 3 * t + 2);
    const double v = Dot(a, Cross(b, c)) / 6.0;
    volume += v;
    first = first + (0.25 * v) * (a + b + c);
    xx += v * second(a.x, b.x, c.x, a.x, b.x, c.x), xy += v * second(a.x, b.x, c.x, a.y, b.y, c.y);
    xz += v * second(a.x, b.x, c.x, a.z, b.z, c.z), yy += v * second(a.y, b.y, c.y, a.y, b.y, c.y);
    yz += v * second(a.y, b.y, c.y, a.z, b.z, c.z), zz += v * second(a.z, b.z, c.z, a.z, b.z, c.z);
  }
  if (!(volume > 0.0)) return std::nullopt;
  const Vector3 m = (1.0 / volume) * first;
  xx -= volume * m.x * m.x, xy -= volume * m.x * m.y, xz -= volume * m.x * m.z;
  yy -= volume * m.y * m.y, yz -= volume * m.y * m.z, zz -= volume * m.z * m.z;
  return robot::Inertial{volume, m, {yy + zz, -xy, -xz, xx + zz, -yz, xx + yy}};
}

}  // namespace consac::twin
