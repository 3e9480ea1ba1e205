// Boxes, cylinders, balls and capsules as triangles.
#include <algorithm>
#include <cmath>
#include <utility>

#include "consac/twin/mesh.h"
#include "triangles.h"

namespace consac::twin {
namespace {

using robot::Vector3;

constexpr std::size_t kAround = 32;  // corners of a circle
constexpr std::size_t kQuarter = 8;  // rings from the equator to a pole

void AddPoints(Vector3 a, Vector3 b, Vector3 c, Triangles* out) {
  float corners[9];
  std::size_t i = 0;
  for (const Vector3& point : {a, b, c}) {
    for (const double coordinate : {point.x, point.y, point.z}) corners[i++] = static_cast<float>(coordinate);
  }
  AddTriangle(corners, &out->corners);
}

void AddQuad(Vector3 a, Vector3 b, Vector3 c, Vector3 d, Triangles* out) {
  AddPoints(a, b, c, out);
  AddPoints(a, c, d, out);
}

// What a line of (radius, z), from below, sweeps around z.
Triangles Swept(const std::vector<std::pair<double, double>>& line) {
  Triangles out;
  const auto at = [&](std::size_t ring, std::size_t step) {
    const double angle = 2.0 * robot::kPiRadians * static_cast<double>(step % kAround) / kAround;
    return Vector3{line[ring].first * std::cos(angle), line[ring].first * std::sin(angle), line[ring].second};
  };
  for (std::size_t ring = 0; ring + 1 < line.size(); ++ring) {
    for (std::size_t step = 0; step < kAround; ++step)
      AddQuad(at(ring, step), at(ring, step + 1), at(ring + 1, step + 1), at(ring + 1, step), &out);
  }
  return out;
}

Triangles Box(Vector3 size) {
  Triangles out;
  const Vector3 h = 0.5 * size;
  const auto corner = [&](int i) {
    return Vector3{(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z};
  };
  constexpr int kSides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& side : kSides) AddQuad(corner(side[0]), corner(side[1]), corner(side[2]), corner(side[3]), &out);
  return out;
}

}  // namespace

Triangles TrianglesOf(ShapeKind kind, Vector3 size) {
  Triangles out;
  const double half = kind == ShapeKind::kSphere ? 0.0 : 0.5 * size.z;
  std::vector<std::pair<double, double>> line;
  if (kind == ShapeKind::kBox) {
    out = Box(size);
  } else if (kind == ShapeKind::kCylinder) {
    out = Swept({{0, -half}, {size.x, -half}, {size.x, half}, {0, half}});
  } else {
    for (int side = -1; side <= 1; side += 2) {
      for (std::size_t i = 0; i <= kQuarter; ++i) {
        const std::size_t ring = side < 0 ? kQuarter - i : i;
        const double angle = 0.5 * robot::kPiRadians * static_cast<double>(ring) / kQuarter;
        const double radius = ring == kQuarter ? 0.0 : size.x * std::cos(angle);
        line.emplace_back(radius, side * (half + size.x * std::sin(angle)));
      }
    }
    out = Swept(line);
  }
  out.parts = {{0, out.count(), std::nullopt}};
  return out;
}

}  // namespace consac::twin
