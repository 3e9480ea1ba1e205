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

constexpr double kWidestFastener = 0.05;  // m: M24's washer, and some room

// Words by which makers call what holds things together, as WordsOf gives them. A word of a compound language may end
// another one ("zylinderschraube"); a space before it says that it does not ("thunderbolt").
constexpr std::string_view kFasteners[] = {
    " screw",          " capscrew",    " setscrew", " bolt",     " hexbolt",  " washer",   " rivet",
    " hexnut",         " hex nut",     " locknut",  " lock nut", "schraube",  "mutter",    " scheibe",
    "unterlegscheibe", "federscheibe", " iso 4762", " iso 4014", " iso 4017", " iso 7380", " iso 10642",
    " din 912",        " din 933",     " din 934",  " din 125",  " fhs m",    " phs m"};

// "CapScrew_M3x8" as " cap screw m 3 x 8 ": small letters, parted where letters, digits and capitals begin.
std::string WordsOf(const std::string& name) {
  const std::string small = LowerCase(name);
  std::string out = " ";
  char kind = ' ';
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (static_cast<unsigned char>(c) & 0x80) != 0;
    const char is = c >= '0' && c <= '9' ? '0' : !letter ? ' ' : c >= 'A' && c <= 'Z' ? 'A' : 'a';
    if (out.back() != ' ' && is != kind && !(kind == 'A' && is == 'a')) out += ' ';
    if (is != ' ') out += small[i];
    kind = is;
  }
  return out.back() == ' ' ? out : out + " ";
}

bool FastensByName(const std::string& name) {
  const std::string words = WordsOf(name);
  return std::any_of(std::begin(kFasteners), std::end(kFasteners), [&](std::string_view word) {
    for (std::size_t at = words.find(word); at != std::string::npos; at = words.find(word, at + 1)) {
      std::size_t end = at + word.size();
      if (words[end] == 's' || words[end] == 'n') ++end;  // of several
      if (words[end] == ' ') return true;
    }
    return false;
  });
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

// Extends low and high by a box in a place; begins them where they are none yet.
void Extend(const robot::Transform& place, const Vector3& box_low, const Vector3& box_high, bool begins, Vector3* low,
            Vector3* high) {
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3 at = place * Vector3{corner & 1 ? box_high.x : box_low.x, corner & 2 ? box_high.y : box_low.y,
                                       corner & 4 ? box_high.z : box_low.z};
    const bool first = begins && corner == 0;
    *low = first ? at : Vector3{std::min(low->x, at.x), std::min(low->y, at.y), std::min(low->z, at.z)};
    *high = first ? at : Vector3{std::max(high->x, at.x), std::max(high->y, at.y), std::max(high->z, at.z)};
  }
}

// [nodes] Which are no wider than what holds things together, however long. Of an assembly all that it holds counts:
// what is below "screw" is a screw's, what is below "ball screw axis" is not.
std::vector<bool> NarrowNodes(const CadAssembly& assembly) {
  struct Box {
    Vector3 low, high;
    bool empty = true;
  };
  std::vector<Box> boxes(assembly.nodes.size());  // in their frames
  std::vector<bool> out(assembly.nodes.size());
  for (std::size_t n = assembly.nodes.size(); n-- > 0;) {
    const CadNode& node = assembly.nodes[n];
    if (node.part >= 0) {
      const CadPart& part = assembly.parts[static_cast<std::size_t>(node.part)];
      boxes[n] = {part.low, part.high, false};
    }
    const Vector3 size = boxes[n].high - boxes[n].low;
    const double thin = std::min({size.x, size.y, size.z}), thick = std::max({size.x, size.y, size.z});
    out[n] = size.x + size.y + size.z - thin - thick <= kWidestFastener;
    if (node.parent < 0 || boxes[n].empty) continue;
    Box& above = boxes[static_cast<std::size_t>(node.parent)];
    Extend(node.place, boxes[n].low, boxes[n].high, above.empty, &above.low, &above.high);
    above.empty = false;
  }
  return out;
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

using Met = std::set<std::pair<std::size_t, std::size_t>>;  // patterns of hinted links, by number

Status CheckMet(const JointHints& hints, const Met& met) {
  for (std::size_t i = 0; i < hints.links.size(); ++i) {
    for (std::size_t k = 0; k < hints.links[i].parts.size(); ++k) {
      if (!met.contains({i, k}))
        return {StatusCode::kInvalidArgument, "hints: link " + Quote(hints.links[i].name) + ": no part is " +
                                                  Quote(hints.links[i].parts[k]) +
                                                  "; consac twin candidates lists the components"};
    }
  }
  return {};
}

// How large each group is, and whether it is of rods.
void Measure(const CadAssembly& assembly, Groups* out) {
  std::vector<bool> begun(out->groups.size(), false);
  out->rods.assign(out->groups.size(), true);
  for (std::size_t n = 0; n < assembly.nodes.size(); ++n) {
    if (assembly.nodes[n].part < 0 || out->of_node[n] < 0) continue;
    const auto group = static_cast<std::size_t>(out->of_node[n]);
    const CadPart& part = assembly.parts[static_cast<std::size_t>(assembly.nodes[n].part)];
    CadGroup& box = out->groups[group];
    Extend(out->places[n], part.low, part.high, !begun[group], &box.low, &box.high);
    begun[group] = true;
    out->rods[group] = out->rods[group] && !box.hinted && IsRod(part);
  }
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
  Met met;
  for (std::size_t i = 0; i < hints.links.size(); ++i) {
    out.groups.push_back({hints.links[i].name, {}, {}, {}, true, false});
  }
  const std::vector<bool> narrow = NarrowNodes(assembly);
  std::vector<bool> whole(count, false);  // what holds the components: the robot's own name says nothing of them
  for (std::int32_t n = above; n >= 0; n = assembly.nodes[static_cast<std::size_t>(n)].parent)
    whole[static_cast<std::size_t>(n)] = true;
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
    const CadPart* part = node.part >= 0 ? &assembly.parts[static_cast<std::size_t>(node.part)] : nullptr;
    const bool below = node.parent >= 0 && out.fastens[parent];
    const bool named =
        !whole[n] && narrow[n] && (FastensByName(node.name) || (part != nullptr && FastensByName(part->name)));
    out.fastens.push_back(below || named || (part != nullptr && FastensByShape(*part)));
  }
  CONSAC_RETURN_IF_ERROR(CheckMet(hints, met));
  Measure(assembly, &out);
  return out;
}

}  // namespace consac::twin
