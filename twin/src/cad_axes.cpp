#include "cad_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <unordered_map>

namespace consac::twin {
namespace {

using robot::Dot;
using robot::Norm;
using robot::Vector3;

constexpr double kSameRadius = 1e-6, kTouches = 1e-5;  // m

// Points that are near each other, by cells of a grid.
class Near {
 public:
  explicit Near(double cell) : cell_(cell) {}

  // The first number whose `is_it` holds among those put near `at`; -1 none.
  template <class IsIt>
  std::int32_t Find(Vector3 at, const IsIt& is_it) const {
    const std::array<std::int64_t, 3> c = CellOf(at);
    std::int32_t found = -1;
    for (std::int64_t x = -1; x <= 1; ++x) {
      for (std::int64_t y = -1; y <= 1; ++y) {
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto cell = cells_.find(KeyOf({c[0] + x, c[1] + y, c[2] + z}));
          if (cell == cells_.end()) continue;
          for (const std::int32_t each : cell->second) {
            if ((found < 0 || each < found) && is_it(each)) found = each;
          }
        }
      }
    }
    return found;
  }
  void Put(Vector3 at, std::int32_t number) { cells_[KeyOf(CellOf(at))].push_back(number); }

 private:
  std::array<std::int64_t, 3> CellOf(Vector3 at) const {
    return {std::llround(std::floor(at.x / cell_)), std::llround(std::floor(at.y / cell_)),
            std::llround(std::floor(at.z / cell_))};
  }
  static std::uint64_t KeyOf(const std::array<std::int64_t, 3>& cell) {
    std::uint64_t key = 0x9E3779B97F4A7C15ull;
    for (const std::int64_t each : cell)
      key = (key ^ static_cast<std::uint64_t>(each)) * 0xD6E8FEB86659FD93ull, key ^= key >> 32;
    return key;  // two cells of one key are looked at together, which harms nothing
  }
  double cell_;
  std::unordered_map<std::uint64_t, std::vector<std::int32_t>> cells_;
};

// A direction with its first component that is not 0 positive.
bool PointsBack(Vector3 d) {
  constexpr double kNought = 1e-6;
  return std::abs(d.x) > kNought ? d.x < 0.0 : std::abs(d.y) > kNought ? d.y < 0.0 : d.z < 0.0;
}

void Join(std::vector<Carrier>* carriers) {
  std::sort(carriers->begin(), carriers->end(), [](const Carrier& a, const Carrier& b) {
    return std::tie(a.group, a.node, a.concave, a.radius, a.from, a.to, a.sweep) <
           std::tie(b.group, b.node, b.concave, b.radius, b.from, b.to, b.sweep);
  });
  std::vector<Carrier> joined;
  for (const Carrier& each : *carriers) {
    Carrier* last = joined.empty() ? nullptr : &joined.back();
    const bool same = last != nullptr && last->node == each.node && last->concave == each.concave &&
                      each.radius - last->radius < kSameRadius && each.from <= last->to + kTouches;
    if (!same) {
      joined.push_back(each);
      continue;
    }
    // Half a bore twice is a bore; two bores one behind the other are as round as the rounder one.
    const bool beside = std::min(last->to, each.to) - each.from > kTouches;
    last->sweep = beside ? last->sweep + each.sweep : std::max(last->sweep, each.sweep);
    last->to = std::max(last->to, each.to);
  }
  *carriers = std::move(joined);
}

}  // namespace

std::vector<AxisLine> FindAxes(const CadAssembly& assembly, const std::vector<std::int32_t>& groups,
                               const std::vector<robot::Transform>& places) {
  std::vector<Vector3> directions;
  Near near_direction(2.0 * kSameDirection);
  std::vector<AxisLine> lines;
  std::vector<Vector3> anchors;       // [lines] where they were met first: others are near these
  std::vector<double> weights;        // of the carrier that a line is measured by
  std::vector<std::int32_t> classes;  // [lines] which of the directions
  Near near_point(2.0 * kSameLine);
  for (std::size_t n = 0; n < assembly.nodes.size(); ++n) {
    const CadNode& node = assembly.nodes[n];
    if (node.part < 0 || groups[n] < 0) continue;
    for (const CadCylinder& cylinder : assembly.parts[static_cast<std::size_t>(node.part)].cylinders) {
      Vector3 d = Rotate(places[n].rotation, cylinder.direction);
      const Vector3 at = places[n] * cylinder.origin;
      double from = cylinder.from, to = cylinder.to;
      if (PointsBack(d)) d = -1.0 * d, from = -cylinder.to, to = -cylinder.from;
      d = d + Vector3{};  // no -0
      const double along = Dot(at, d);
      const Vector3 point = at - along * d;
      std::int32_t direction = near_direction.Find(
          d, [&](std::int32_t each) { return Norm(directions[static_cast<std::size_t>(each)] - d) < kSameDirection; });
      if (direction < 0) {
        direction = static_cast<std::int32_t>(directions.size());
        directions.push_back(d);
        near_direction.Put(d, direction);
      }
      std::int32_t line = near_point.Find(point, [&](std::int32_t each) {
        const auto i = static_cast<std::size_t>(each);
        return classes[i] == direction && Norm(anchors[i] - point) < kSameLine;
      });
      const double weight = cylinder.radius * cylinder.sweep * (to - from);
      if (line < 0) {
        line = static_cast<std::int32_t>(lines.size());
        lines.push_back({point, d, {}});
        anchors.push_back(point);
        weights.push_back(weight);
        classes.push_back(direction);
        near_point.Put(point, line);
      }
      const auto i = static_cast<std::size_t>(line);
      if (weight > weights[i]) weights[i] = weight, lines[i].point = point, lines[i].direction = d;
      lines[i].carriers.push_back({groups[n], static_cast<std::int32_t>(n), cylinder.radius, along + from, along + to,
                                   cylinder.sweep, cylinder.concave});
    }
  }
  for (AxisLine& line : lines) Join(&line.carriers);
  return lines;
}

}  // namespace consac::twin
