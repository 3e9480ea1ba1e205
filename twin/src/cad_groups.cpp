#include "cad_groups.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "consac/base/text.h"
#include "files.h"

namespace consac::twin {
namespace {

using robot::Vector3;

constexpr double kLargestFastener = 0.012;  // radius, m: M24's shank
constexpr double kHead = 1.3;               // how much wider than its shank a screw's head is

// Words by which makers call what holds things together.
constexpr std::string_view kFasteners[] = {"screw",   "bolt",     "washer",   "rivet",    "schraube",  "mutter",
                                           "scheibe", "hexnut",   "hex nut",  "locknut",  "lock nut",  "iso 4762",
                                           "iso4762", "iso 4014", "iso 4017", "iso 7380", "iso 10642", "din 912",
                                           "din912",  "din 933",  "din 934",  "din 125",  "fhs_m",     "phs_m"};

bool FastensByName(const std::string& name) {
  const std::string small = LowerCase(name);
  return std::any_of(std::begin(kFasteners), std::end(kFasteners),
                     [&](std::string_view word) { return small.find(word) != std::string::npos; });
}

// A shank with a head on one axis, small.
bool FastensByShape(const CadPart& part) {
  double thinnest = 0.0, widest = 0.0;
  for (const CadCylinder& each : part.cylinders) {
    const CadCylinder& first = part.cylinders.front();
    const Vector3 off = each.origin - first.origin;
    const bool on_axis = Norm(Cross(each.direction, first.direction)) < 1e-3 &&
                         Norm(off - Dot(off, first.direction) * first.direction) < 1e-4;
    if (!on_axis || each.radius > kLargestFastener) return false;
    if (each.concave || each.sweep < robot::kPiRadians) continue;
    thinnest = thinnest == 0.0 ? each.radius : std::min(thinnest, each.radius);
    widest = std::max(widest, each.radius);
  }
  return thinnest > 0.0 && widest >= kHead * thinnest;
}

// A part that is all around one axis, small, and no wider than its cylinders (a hexagon's corners count).
bool IsRod(const CadPart& part) {
  constexpr double kWide = 2.6;
  if (part.cylinders.empty()) return false;
  const CadCylinder& first = part.cylinders.front();
  double radius = 0.0;
  bool pin = false;
  for (const CadCylinder& each : part.cylinders) {
    const Vector3 off = each.origin - first.origin;
    if (Norm(Cross(each.direction, first.direction)) > 1e-3 ||
        Norm(off - Dot(off, first.direction) * first.direction) > 1e-4)
      return false;
    radius = std::max(radius, each.radius);
    pin = pin || !each.concave;
  }
  const Vector3 size = part.high - part.low, d = first.direction;
  const double across = std::abs(d.x) > 0.999   ? std::max(size.y, size.z)
                        : std::abs(d.y) > 0.999 ? std::max(size.x, size.z)
                        : std::abs(d.z) > 0.999 ? std::max(size.x, size.y)
                                                : 1e9;
  return pin && radius <= kLargestFastener && across <= kWide * radius;
}

void Extend(const robot::Transform& place, const CadPart& part, bool first, CadGroup* group) {
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 at = place * Vector3{corner & 1 ? part.high.x : part.low.x, corner & 2 ? part.high.y : part.low.y,
                                       corner & 4 ? part.high.z : part.low.z};
    const bool begins = first && corner == 0;
    group->low =
        begins ? at : Vector3{std::min(group->low.x, at.x), std::min(group->low.y, at.y), std::min(group->low.z, at.z)};
    group->high =
        begins ? at
               : Vector3{std::max(group->high.x, at.x), std::max(group->high.y, at.y), std::max(group->high.z, at.z)};
  }
}

// The nodes whose children are the components: all roots, or a lone root, or what a lone root holds alone.
std::int32_t ParentOfComponents(const CadAssembly& assembly) {
  std::vector<std::int32_t> children(assembly.nodes.size() + 1, 0), only(assembly.nodes.size() + 1, -1);
  for (std::size_t n = 0; n < assembly.nodes.size(); ++n) {
    const auto parent = static_cast<std::size_t>(assembly.nodes[n].parent + 1);
    ++children[parent];
    only[parent] = static_cast<std::int32_t>(n);
  }
  std::int32_t above = -1;
  while (children[static_cast<std::size_t>(above + 1)] == 1) {
    const std::int32_t next = only[static_cast<std::size_t>(above + 1)];
    if (assembly.nodes[static_cast<std::size_t>(next)].part >= 0) break;
    above = next;
  }
  return above;
}

}  // namespace

bool Matches(std::string_view pattern, std::string_view text) {
  std::size_t p = 0, t = 0, star = std::string_view::npos, from = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++, from = t;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
      ++p, ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1, t = ++from;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

Result<Groups> GroupParts(const CadAssembly& assembly, const JointHints& hints) {
  Groups out;
  const std::size_t count = assembly.nodes.size();
  const std::int32_t above = ParentOfComponents(assembly);
  std::set<std::pair<std::size_t, std::size_t>> met;  // patterns of hints
  for (std::size_t i = 0; i < hints.links.size(); ++i) {
    out.groups.push_back({hints.links[i].name, {}, {}, {}, true, false});
  }
  std::size_t roots = 0;
  for (const CadNode& node : assembly.nodes) roots += node.parent < 0 ? 1 : 0;
  for (std::size_t n = 0; n < count; ++n) {
    const CadNode& node = assembly.nodes[n];
    const auto parent = static_cast<std::size_t>(node.parent);
    out.places.push_back(node.parent < 0 ? node.place : out.places[parent] * node.place);
    out.places.back().rotation = Normalised(out.places.back().rotation);
    const bool under_root = node.parent < 0 || (roots == 1 && assembly.nodes[parent].parent < 0);
    out.paths.push_back(under_root ? node.name : out.paths[parent] + "/" + node.name);
    std::int32_t group = node.parent < 0 ? -1 : out.of_node[parent];
    for (std::size_t i = 0; i < hints.links.size(); ++i) {
      for (std::size_t k = 0; k < hints.links[i].parts.size(); ++k) {
        if (!Matches(hints.links[i].parts[k], out.paths[n])) continue;
        group = static_cast<std::int32_t>(i);
        met.emplace(i, k);
      }
    }
    if (group < 0 && (node.parent == above || node.part >= 0)) {
      group = static_cast<std::int32_t>(out.groups.size());
      out.groups.push_back({out.paths[n], out.places[n], {}, {}, false, false});
    }
    out.of_node.push_back(group);
    const bool below = node.parent >= 0 && out.fastens[parent];
    out.fastens.push_back(below || FastensByName(node.name) ||
                          (node.part >= 0 && (FastensByName(assembly.parts[static_cast<std::size_t>(node.part)].name) ||
                                              FastensByShape(assembly.parts[static_cast<std::size_t>(node.part)]))));
  }
  for (std::size_t i = 0; i < hints.links.size(); ++i) {
    for (std::size_t k = 0; k < hints.links[i].parts.size(); ++k) {
      if (!met.contains({i, k}))
        return Status{StatusCode::kInvalidArgument, "hints: link " + Quote(hints.links[i].name) + ": no part is " +
                                                        Quote(hints.links[i].parts[k]) +
                                                        "; consac twin candidates lists the components"};
    }
  }
  std::vector<bool> begun(out.groups.size(), false);
  out.rods.assign(out.groups.size(), true);
  for (std::size_t n = 0; n < count; ++n) {
    if (assembly.nodes[n].part < 0 || out.of_node[n] < 0) continue;
    const auto group = static_cast<std::size_t>(out.of_node[n]);
    Extend(out.places[n], assembly.parts[static_cast<std::size_t>(assembly.nodes[n].part)], !begun[group],
           &out.groups[group]);
    begun[group] = true;
    out.rods[group] = out.rods[group] && !out.groups[group].hinted &&
                      IsRod(assembly.parts[static_cast<std::size_t>(assembly.nodes[n].part)]);
  }
  return out;
}

}  // namespace consac::twin
