#include "consac/twin/cad_joints.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>

#include "cad_axes.h"
#include "cad_candidates.h"
#include "cad_groups.h"
#include "cad_own_joints.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "files.h"
#include "pieces.h"
#include "sets.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;
using robot::Vector3;

// A joint that will be one.
struct Edge {
  std::int32_t first = 0, second = 0;  // groups; a hint's parent and child
  Vector3 origin, direction;
  const JointHint* hint = nullptr;
  std::int32_t candidate = -1;
};

constexpr std::string_view kStandStill[] = {"base", "ground", "frame", "fundament", "sockel", "pedestal", "foot"};

double Volume(const CadGroup& group) {
  const Vector3 size = group.high - group.low;
  return size.x * size.y * size.z;
}
Vector3 Centre(const CadGroup& group) {
  return 0.5 * (group.low + group.high);
}

Status Wrong(const JointHint& hint, const std::string& what) {
  return {StatusCode::kInvalidArgument, "hints: joint " + Quote(hint.name) + ": " + what};
}

// A name that a robot's link may have.
std::string AsLinkName(std::string_view name) {
  constexpr std::size_t kMost = 200;
  return name.empty() ? "part" : std::string(CutAtCharacter(name, kMost));
}

class Finder {
 public:
  Finder(const CadAssembly& assembly, const JointHints& hints, Groups groups)
      : assembly_(assembly),
        hints_(hints),
        groups_(std::move(groups)),
        rigid_(groups_.groups.size()),
        tree_(groups_.groups.size()) {}

  Result<CadRobot> Run() {
    out_.candidates = JudgePairs(FindAxes(assembly_, groups_.of_node, groups_.places), &groups_);
    CONSAC_RETURN_IF_ERROR(ReadPairs());
    FixTogether();
    CONSAC_RETURN_IF_ERROR(TakeHints());
    TakeCandidates();
    CONSAC_RETURN_IF_ERROR(FindBase());
    MakeTree();
    out_.groups = std::move(groups_.groups);
    out_.path_of_node = std::move(groups_.paths);
    out_.place_of_node = std::move(groups_.places);
    return std::move(out_);
  }

 private:
  CadGroup& GroupOf(std::int32_t group) { return groups_.groups[static_cast<std::size_t>(group)]; }

  // The groups that a hint's word means: a hinted link by its name, else components by a pattern.
  std::vector<std::int32_t> Meant(const std::string& word) const {
    std::vector<std::int32_t> out;
    for (std::size_t i = 0; i < groups_.groups.size(); ++i) {
      const CadGroup& group = groups_.groups[i];
      if (group.hinted ? group.name == word : Matches(word, group.name)) out.push_back(static_cast<std::int32_t>(i));
    }
    return out;
  }

  // Which groups each hinted joint is between; several that one pattern means are fixed to each other.
  Status ReadPairs() {
    for (const JointHint& hint : hints_.joints) CONSAC_RETURN_IF_ERROR(ReadPair(hint));
    said_ = WithOwnJoints(assembly_, groups_, hints_, pairs_, &out_.warnings);
    for (std::size_t i = hints_.joints.size(); i < said_.size(); ++i) CONSAC_RETURN_IF_ERROR(ReadPair(said_[i]));
    return {};
  }

  Status ReadPair(const JointHint& hint) {
    std::vector<std::int32_t> sides[2];
    if (hint.groups.has_value())
      sides[0] = {hint.groups->first}, sides[1] = {hint.groups->second};
    else
      sides[0] = Meant(hint.parent), sides[1] = Meant(hint.child);
    for (int side = 0; side < 2; ++side) {
      const std::string& word = side == 0 ? hint.parent : hint.child;
      if (sides[side].empty())
        return Wrong(hint, "no link or component is " + Quote(word) + "; consac twin candidates lists them");
      for (const std::int32_t each : sides[side]) (void)rigid_.Join(sides[side].front(), each);
    }
    pairs_.emplace_back(sides[0].front(), sides[1].front());
    if (hint.type == JointType::kFixed) (void)rigid_.Join(sides[0].front(), sides[1].front());
    return {};
  }

  bool HintedToMove(std::int32_t a, std::int32_t b) const {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (said_[i].type != JointType::kFixed && std::minmax(pairs_[i].first, pairs_[i].second) == std::minmax(a, b))
        return true;
    }
    return false;
  }

  void FixTogether() {
    for (JointCandidate& each : out_.candidates) {
      if (each.turns || each.score < kTakenFrom) continue;
      const bool overruled = HintedToMove(each.first, each.second);
      each.verdict = overruled ? "a hint, or the file's own joint, says otherwise" : "fixed";
      if (!overruled) (void)rigid_.Join(each.first, each.second);
    }
  }

  Status AxisOf(std::size_t number, Edge* edge) {
    const JointHint& hint = said_[number];
    constexpr std::string_view kCandidate = "candidate:", kComponent = "component:";
    const std::string_view axis = hint.axis;
    if (axis.empty()) {
      edge->origin = hint.origin, edge->direction = hint.direction;
      return {};
    }
    if (axis.starts_with(kCandidate)) {
      std::int64_t which = 0;
      const bool good = ParseNumber(axis.substr(kCandidate.size()), &which) && which >= 1 &&
                        which <= static_cast<std::int64_t>(out_.candidates.size());
      if (!good)
        return Wrong(hint, "there is no " + Quote(axis) + "; there are " + std::to_string(out_.candidates.size()));
      edge->candidate = static_cast<std::int32_t>(which - 1);
    } else if (axis.starts_with(kComponent)) {
      return AxisOfComponent(hint, axis.substr(kComponent.size()), edge);
    } else {
      for (std::size_t i = 0; i < out_.candidates.size() && edge->candidate < 0; ++i) {
        const JointCandidate& each = out_.candidates[i];
        const auto ends = std::minmax({rigid_.Of(each.first), rigid_.Of(each.second)});
        if (each.turns && ends == std::minmax({rigid_.Of(edge->first), rigid_.Of(edge->second)}))
          edge->candidate = static_cast<std::int32_t>(i);
      }
      if (edge->candidate < 0)
        return Wrong(
            hint, "its two sides share no axis; say one: \"axis\": \"component:PATH#Z\", or an origin and a direction");
    }
    edge->origin = out_.candidates[static_cast<std::size_t>(edge->candidate)].origin;
    edge->direction = out_.candidates[static_cast<std::size_t>(edge->candidate)].direction;
    return {};
  }

  Status AxisOfComponent(const JointHint& hint, std::string_view text, Edge* edge) const {
    const std::size_t hash = text.rfind('#');
    const std::string_view pattern = text.substr(0, hash),
                           letter = hash == std::string_view::npos ? "" : text.substr(hash + 1);
    const std::size_t which = letter.size() == 1 ? std::string_view("XYZxyz").find(letter[0]) : std::string_view::npos;
    if (which == std::string_view::npos)
      return Wrong(hint, Quote(text) + " names no axis of a component; PATH#X, #Y or #Z is expected");
    for (std::size_t n = 0; n < groups_.paths.size(); ++n) {
      if (!Matches(pattern, groups_.paths[n])) continue;
      const Vector3 unit[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      edge->origin = groups_.places[n].position;
      edge->direction = Rotate(groups_.places[n].rotation, unit[which % 3]);
      return {};
    }
    return Wrong(hint, "no part or component is " + Quote(pattern));
  }

  Status TakeHints() {
    for (std::size_t i = 0; i < said_.size(); ++i) {
      const JointHint& hint = said_[i];
      if (hint.type == JointType::kFixed) continue;
      Edge edge{pairs_[i].first, pairs_[i].second, {}, {}, &hint, -1};
      const std::string sides = Quote(GroupOf(edge.first).name) + " and " + Quote(GroupOf(edge.second).name);
      if (hint.of_file && (rigid_.Of(edge.first) == rigid_.Of(edge.second) ||
                           !tree_.Join(rigid_.Of(edge.first), rigid_.Of(edge.second)))) {
        out_.warnings.push_back("its own joint " + Quote(hint.name) + " is not taken: " + sides +
                                " are connected already");
        continue;
      }
      if (rigid_.Of(edge.first) == rigid_.Of(edge.second))
        return Wrong(hint, sides + " are fixed to each other through others; part them by \"links\"");
      CONSAC_RETURN_IF_ERROR(AxisOf(i, &edge));
      if (!hint.of_file && !tree_.Join(rigid_.Of(edge.first), rigid_.Of(edge.second)))
        return Wrong(hint, sides + " are connected by other joints already: a loop; leave one of them out");
      if (edge.candidate >= 0) out_.candidates[static_cast<std::size_t>(edge.candidate)].verdict = hint.name;
      edges_.push_back(edge);
    }
    return {};
  }

  void TakeCandidates() {
    for (std::size_t i = 0; i < out_.candidates.size(); ++i) {
      JointCandidate& each = out_.candidates[i];
      if (!each.turns || !each.verdict.empty()) continue;
      if (each.score < kTakenFrom) {
        each.verdict = "not taken: too little speaks for it";
      } else if (!hints_.automatic) {
        each.verdict = "not taken: hints say \"automatic\": false";
      } else if (rigid_.Of(each.first) == rigid_.Of(each.second)) {
        each.verdict = "not taken: fixed to each other through others";
      } else if (!tree_.Join(rigid_.Of(each.first), rigid_.Of(each.second))) {
        const Edge* known = TakenOn(each);
        each.verdict = known == nullptr         ? "not taken: it closes a loop"
                       : known->hint != nullptr ? known->hint->name
                                                : "the same as one above";
        if (known == nullptr)
          out_.warnings.push_back("candidate " + std::to_string(i + 1) +
                                  " would close a loop of joints and was not taken");
      } else {
        edges_.push_back({each.first, each.second, each.origin, each.direction, nullptr, static_cast<std::int32_t>(i)});
      }
    }
  }

  // The joint that was taken and has this axis.
  const Edge* TakenOn(const JointCandidate& candidate) const {
    const auto at = std::find_if(edges_.begin(), edges_.end(), [&](const Edge& edge) {
      const Vector3 off = candidate.origin - edge.origin;
      return Norm(Cross(candidate.direction, edge.direction)) < kSameDirection &&
             Norm(off - Dot(off, edge.direction) * edge.direction) < 2.0 * kSameLine;
    });
    return at == edges_.end() ? nullptr : &*at;
  }

  Status FindBase() {
    if (!hints_.base.empty()) {
      const std::vector<std::int32_t> meant = Meant(hints_.base);
      if (meant.empty())
        return {StatusCode::kInvalidArgument,
                "hints: base: no link or component is " + Quote(hints_.base) + "; consac twin candidates lists them"};
      base_ = rigid_.Of(meant.front());
      return {};
    }
    std::int32_t named = -1, largest = 0;
    for (std::size_t i = 0; i < groups_.groups.size(); ++i) {
      const std::string small = LowerCase(groups_.groups[i].name);
      const bool says = std::any_of(std::begin(kStandStill), std::end(kStandStill),
                                    [&](std::string_view word) { return small.find(word) != std::string::npos; });
      if (named < 0 && says) named = static_cast<std::int32_t>(i);
      if (Volume(groups_.groups[i]) > Volume(GroupOf(largest))) largest = static_cast<std::int32_t>(i);
    }
    base_ = rigid_.Of(named >= 0 ? named : largest);
    out_.asked.push_back(
        "base: " + Quote(GroupOf(named >= 0 ? named : largest).name) + " is taken for what stands still, " +
        (named >= 0 ? "by its name" : "since it is the largest") + "; if another does, say \"base\" in --hints");
    return {};
  }

  // The largest group of those that move together, a hinted one first: what their link is called by.
  std::map<std::int32_t, std::int32_t> SpeakersOf() {
    std::map<std::int32_t, std::int32_t> speakers;
    for (std::size_t i = 0; i < groups_.groups.size(); ++i) {
      const auto [known, is_new] =
          speakers.emplace(rigid_.Of(static_cast<std::int32_t>(i)), static_cast<std::int32_t>(i));
      const CadGroup &old = GroupOf(known->second), &each = groups_.groups[i];
      if (!is_new && (each.hinted != old.hinted ? each.hinted : Volume(each) > Volume(old)))
        known->second = static_cast<std::int32_t>(i);
    }
    return speakers;
  }

  std::string Unique(const std::string& name, std::set<std::string>* used) const {
    std::string out = name;
    for (int n = 2; !used->insert(out).second; ++n) out = name + "_" + std::to_string(n);
    return out;
  }

  void AddLink(std::int32_t cluster, const Transform& place) {
    link_of_[cluster] = static_cast<std::int32_t>(out_.robot.links.size());
    out_.robot.links.push_back({Unique(AsLinkName(GroupOf(speakers_[cluster]).name), &link_names_), std::nullopt});
    out_.link_place.push_back(place);
    double mass = 0.0;
    for (std::size_t i = 0; i < hints_.links.size(); ++i) {
      if (rigid_.Of(static_cast<std::int32_t>(i)) == cluster) mass += hints_.links[i].mass;
    }
    out_.masses.push_back(mass);
  }

  void MakeTree() {
    speakers_ = SpeakersOf();
    out_.robot.name = AsLinkName(assembly_.nodes.front().name);
    for (const JointHint& hint : said_) joint_names_.insert(hint.name);
    AddLink(base_, {});
    Grow(base_);
    // What hangs on nothing: with joints of its own it is fixed to the base, without it is part of it.
    std::vector<std::string> loose;
    std::set<std::int32_t> with_joints;
    for (const Edge& edge : edges_)
      with_joints.insert(rigid_.Of(edge.first)), with_joints.insert(rigid_.Of(edge.second));
    for (const auto& [cluster, speaker] : speakers_) {
      if (link_of_.contains(cluster)) continue;
      loose.push_back(Quote(GroupOf(speaker).name));
      if (!with_joints.contains(cluster)) {
        link_of_[cluster] = 0;
        continue;
      }
      robot::JointDescription joint;
      joint.name = Unique("fixed", &joint_names_);
      joint.parent = out_.robot.links.front().name;
      AddLink(cluster, {});
      joint.child = out_.robot.links.back().name;
      joint.source = "nothing says what it hangs on";
      out_.robot.joints.push_back(joint);
      Grow(cluster);
    }
    SayLoose(loose);
    for (std::size_t n = 0; n < assembly_.nodes.size(); ++n)
      out_.link_of_node.push_back(groups_.of_node[n] < 0 ? -1 : link_of_[rigid_.Of(groups_.of_node[n])]);
  }

  void SayLoose(const std::vector<std::string>& loose) {
    if (loose.empty()) return;
    out_.asked.push_back("nothing in the file says what these hang on, so they stand still with the base: " +
                         FirstFew(loose) + "; say \"joints\" (of type \"fixed\" too) in --hints");
  }

  // Adds what hangs on a cluster that is a link.
  void Grow(std::int32_t from) {
    std::deque<std::int32_t> next = {from};
    while (!next.empty()) {
      const std::int32_t at = next.front();
      next.pop_front();
      for (const Edge& edge : edges_) {
        const std::int32_t first = rigid_.Of(edge.first), second = rigid_.Of(edge.second);
        const std::int32_t other = first == at ? second : first;
        if ((first != at && second != at) || link_of_.contains(other)) continue;
        AddJoint(edge, at, other);
        next.push_back(other);
      }
    }
  }

  // From the parent to the child, else along the larger component; a hint's axis is left as it is said.
  Vector3 Signed(const Edge& edge, std::int32_t parent, std::int32_t child) {
    if (edge.hint != nullptr && edge.hint->of_file)  // what moves by +q is its second side
      return parent == rigid_.Of(edge.first) ? edge.direction : -1.0 * edge.direction;
    if (edge.hint != nullptr && edge.hint->axis != "auto" && edge.candidate < 0) return edge.direction;
    const Vector3 way = Centre(GroupOf(speakers_[child])) - Centre(GroupOf(speakers_[parent]));
    const double along = Dot(way, edge.direction);
    const Vector3& d = edge.direction;
    const double largest = std::abs(d.x) >= std::abs(d.y) && std::abs(d.x) >= std::abs(d.z) ? d.x
                           : std::abs(d.y) >= std::abs(d.z)                                 ? d.y
                                                                                            : d.z;
    const bool clear = std::abs(along) > 0.5 * Norm(way);
    return (clear ? along : largest) < 0.0 ? -1.0 * d : d;
  }

  void AddJoint(const Edge& edge, std::int32_t parent, std::int32_t child) {
    const auto parent_link = static_cast<std::size_t>(link_of_[parent]);
    robot::JointDescription joint;
    joint.name = edge.hint != nullptr ? edge.hint->name : Unique("joint_" + std::to_string(++numbered_), &joint_names_);
    joint.type = edge.hint != nullptr ? edge.hint->type : JointType::kContinuous;
    joint.axis = Signed(edge, parent, child);
    joint.parent = out_.robot.links[parent_link].name;
    AddLink(child, {{}, edge.origin});
    joint.child = out_.robot.links.back().name;
    Transform back;  // from the pose of the file to position 0
    bool limited = false;
    if (edge.hint != nullptr) {
      limited = edge.hint->limited;
      joint.drive = edge.hint->drive;
      if (joint.type == JointType::kRevolute && !limited) joint.type = JointType::kContinuous;
      if (joint.type == JointType::kPrismatic) back.position = -edge.hint->drawn_at * joint.axis;
      if (joint.type != JointType::kPrismatic) back.rotation = robot::RotationAbout(joint.axis, -edge.hint->drawn_at);
    }
    joint.origin = Inverse(out_.link_place[parent_link]) * out_.link_place.back() * back;
    joint.source = edge.hint != nullptr && edge.candidate < 0 ? edge.hint->of_file ? "step" : "hint" : "geometry";
    const bool unlimited_by_choice = edge.hint != nullptr && edge.hint->type == JointType::kContinuous;
    if (!limited && !unlimited_by_choice)
      out_.asked.push_back("joint " + Quote(joint.name) +
                           ": its limits and its zero are not in the file: it moves without end, and 0 is the pose as "
                           "drawn; say \"limit\" and \"drawn_at\" in --hints");
    if (edge.candidate >= 0) out_.candidates[static_cast<std::size_t>(edge.candidate)].verdict = joint.name;
    out_.robot.joints.push_back(std::move(joint));
  }

  const CadAssembly& assembly_;
  const JointHints& hints_;
  Groups groups_;
  Sets rigid_, tree_;            // groups that are fixed together; those that joints connect, by who stands for them
  std::vector<JointHint> said_;  // joints by hints, then the file's own
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs_;  // [said_]
  std::vector<Edge> edges_;
  std::map<std::int32_t, std::int32_t> speakers_, link_of_;
  std::set<std::string> link_names_, joint_names_;
  std::int32_t base_ = 0;
  int numbered_ = 0;
  CadRobot out_;
};

}  // namespace

Result<CadRobot> FindJoints(const CadAssembly& assembly, const JointHints& hints) {
  Result<Groups> groups = GroupParts(assembly, hints);
  if (!groups.ok()) return groups.status();
  if (groups->groups.empty()) return Status{StatusCode::kDataLoss, "it holds no part"};
  return Finder(assembly, hints, std::move(*groups)).Run();
}

}  // namespace consac::twin
