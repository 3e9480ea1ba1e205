#include "cad_own_joints.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "consac/base/names.h"
#include "consac/base/text.h"

namespace consac::twin {
namespace {

constexpr std::size_t kMostName = 200;  // bytes; a number may follow
constexpr double kFarthestOwn = 1e5;    // m from the file's origin, and m or rad from a joint's 0

JointHint AsHint(const CadJoint& joint, const Groups& groups) {
  JointHint hint;
  hint.name = joint.name.empty() ? "joint" : std::string(CutAtCharacter(joint.name, kMostName));
  hint.type = joint.type;
  hint.groups = std::pair(groups.of_node[static_cast<std::size_t>(joint.first)],
                          groups.of_node[static_cast<std::size_t>(joint.second)]);
  const robot::Transform& place = groups.places[static_cast<std::size_t>(joint.first)];
  hint.axis.clear();
  hint.origin = place * joint.origin;
  hint.direction = Rotate(place.rotation, joint.direction);
  hint.drive.lower = joint.lower, hint.drive.upper = joint.upper;
  hint.limited = std::isfinite(joint.lower) || std::isfinite(joint.upper);
  hint.drawn_at = joint.drawn_at;
  hint.of_file = true;
  return hint;
}

}  // namespace

std::vector<JointHint> WithOwnJoints(const CadAssembly& assembly, const Groups& groups, const JointHints& hints,
                                     const std::vector<std::pair<std::int32_t, std::int32_t>>& hinted,
                                     std::vector<std::string>* warnings) {
  std::vector<JointHint> said = hints.joints;
  std::set<std::string> names;
  for (const JointHint& hint : said) names.insert(hint.name);
  std::set<std::pair<std::int32_t, std::int32_t>> known;
  for (const auto& [a, b] : hinted) known.insert(std::minmax(a, b));
  for (const CadJoint& joint : assembly.joints) {
    JointHint hint = AsHint(joint, groups);
    const auto [first, second] = *hint.groups;
    const auto leave_out = [&](const std::string& why) {
      warnings->push_back("its own joint " + Quote(hint.name) + " " + why + " and is left out");
    };
    if (first < 0 || second < 0) {
      leave_out("is between assemblies that stand above components");
    } else if (first == second) {
      leave_out("is within the component " + Quote(groups.groups[static_cast<std::size_t>(first)].name) +
                ", which moves as one; part it by \"links\" in --hints");
    } else if (!(Norm(hint.origin) <= kFarthestOwn && std::abs(hint.drawn_at) <= kFarthestOwn)) {
      leave_out("is more than 100 km away");
    } else if (!known.insert(std::minmax(first, second)).second) {
      continue;  // a hint's word is the last; of several of the file's between the same two the first counts
    } else {
      const std::string name = hint.name;
      for (int n = 2; !names.insert(hint.name).second; ++n) hint.name = name + "_" + std::to_string(n);
      said.push_back(std::move(hint));
    }
  }
  return said;
}

}  // namespace consac::twin
