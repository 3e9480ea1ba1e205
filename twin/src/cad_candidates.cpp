#include "cad_candidates.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <tuple>

namespace consac::twin {
namespace {

using robot::Vector3;

constexpr double kGap = 5e-3;        // m: farther apart along an axis, two pieces have nothing to do with each other
constexpr double kPlay = 0.3e-3;     // m: between a pin's radius and its bore's
constexpr double kTight = 0.02e-3;   // m: by which a pin may be drawn wider than its bore
constexpr double kOverlap = 0.2e-3;  // m: along the axis
constexpr double kCircle = 0.1e-3;   // m: by which screws may leave their circle
constexpr double kOnAxis = 0.05e-3;  // m: of a component's origin
constexpr std::size_t kMostNeighbours = 8;  // of a group on one axis
constexpr std::size_t kMostCarriers = 200;  // of a group on one axis that are looked at
constexpr std::size_t kMostFamily = 64;     // parallel axes of a pair among which a circle is looked for

// A group's carriers on one line: they stand together.
struct OnLine {
  std::int32_t group = 0;
  std::span<const Carrier> carriers;
  double low = 0.0, high = 0.0;
};

bool Overlap(const Carrier& a, const Carrier& b) {
  return std::min(a.to, b.to) - std::max(a.from, b.from) > kOverlap;
}

// A pin in a bore.
bool Mate(const Carrier& a, const Carrier& b) {
  if (a.concave == b.concave || a.sweep < 0.9 * robot::kPiRadians || b.sweep < 0.9 * robot::kPiRadians) return false;
  const double play = a.concave ? a.radius - b.radius : b.radius - a.radius;
  return play > -kTight && play < kPlay && Overlap(a, b);
}

std::vector<OnLine> GroupsOn(const AxisLine& line) {
  std::vector<OnLine> out;
  for (std::size_t begin = 0, end = 0; begin < line.carriers.size(); begin = end) {
    OnLine each{line.carriers[begin].group, {}, line.carriers[begin].from, line.carriers[begin].to};
    for (end = begin; end < line.carriers.size() && line.carriers[end].group == each.group; ++end) {
      each.low = std::min(each.low, line.carriers[end].from);
      each.high = std::max(each.high, line.carriers[end].to);
    }
    each.carriers = std::span(line.carriers).subspan(begin, std::min(end - begin, kMostCarriers));
    out.push_back(each);
  }
  std::sort(out.begin(), out.end(),
            [](const OnLine& a, const OnLine& b) { return std::tie(a.low, a.group) < std::tie(b.low, b.group); });
  return out;
}

// An axis that two groups share, and what is on it.
struct Shared {
  std::size_t line = 0;
  bool mated = false;    // a pin of one in a bore of the other, or a pin through bores of both
  bool screwed = false;  // a screw goes through both
  bool bearing = false;  // a pin turns in a bore within one of the two
  bool origin = false;   // a component's origin is on it, and one of its axes along it
  double at = 0.0;       // along the line: the middle of what they share of it
  double radius = 0.0;   // of the widest that takes part
};

// Groups by pairs, and what they share.
class Judge {
 public:
  Judge(const std::vector<AxisLine>& lines, Groups* groups) : lines_(lines), groups_(*groups) {}

  std::vector<JointCandidate> Run() {
    std::vector<std::vector<OnLine>> on;
    for (const AxisLine& line : lines_) on.push_back(GroupsOn(line));
    FindConnectors(on);
    for (std::size_t i = 0; i < lines_.size(); ++i) LookAt(i, on[i]);
    std::vector<JointCandidate> out;
    for (const auto& [pair, shared] : pairs_) Decide(pair.first, pair.second, shared, &out);
    std::stable_sort(out.begin(), out.end(),
                     [](const JointCandidate& a, const JointCandidate& b) { return a.score > b.score; });
    return out;
  }

 private:
  // Rods on a single axis that stand in two others, or screws that stand in one.
  void FindConnectors(const std::vector<std::vector<OnLine>>& on) {
    std::vector<int> lines_of(groups_.groups.size(), 0);
    for (const std::vector<OnLine>& list : on) {
      for (const OnLine& each : list) ++lines_of[static_cast<std::size_t>(each.group)];
    }
    for (const std::vector<OnLine>& list : on) {
      for (const OnLine& each : list) {
        const auto group = static_cast<std::size_t>(each.group);
        if (lines_of[group] != 1 || !groups_.rods[group]) continue;
        int touched = 0;
        for (const OnLine& other : list)
          touched += &other != &each && other.low < each.high + kGap && each.low < other.high + kGap ? 1 : 0;
        groups_.groups[group].connects = touched >= 2 || (touched >= 1 && Fastens(each));
      }
    }
  }

  bool Fastens(const OnLine& group) const {
    return std::all_of(group.carriers.begin(), group.carriers.end(),
                       [&](const Carrier& each) { return groups_.fastens[static_cast<std::size_t>(each.node)]; });
  }
  bool Fastens(const Carrier& carrier) const { return groups_.fastens[static_cast<std::size_t>(carrier.node)]; }

  void LookAt(std::size_t line, const std::vector<OnLine>& on) {
    std::vector<const OnLine*> pieces, connectors;
    for (const OnLine& each : on)
      (groups_.groups[static_cast<std::size_t>(each.group)].connects ? connectors : pieces).push_back(&each);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      for (std::size_t k = i + 1; k < std::min(pieces.size(), i + 1 + kMostNeighbours); ++k) {
        if (pieces[k]->low > pieces[i]->high + kGap) continue;
        const bool turned = pieces[k]->group < pieces[i]->group;
        const OnLine& a = *pieces[turned ? k : i];
        const OnLine& b = *pieces[turned ? i : k];
        pairs_[{a.group, b.group}].push_back(Share(line, a, b, connectors));
      }
    }
    // What connects stands still with what it stands in.
    for (const OnLine* connector : connectors) {
      const OnLine* best = nullptr;
      for (const OnLine* piece : pieces) {
        if (piece->low > connector->high + kGap || connector->low > piece->high + kGap) continue;
        if (best == nullptr || piece->group < best->group) best = piece;
      }
      if (best == nullptr) continue;
      const auto [first, second] = std::minmax({best->group, connector->group});
      Shared held{line};
      held.at = 0.5 * (connector->low + connector->high);
      pairs_[{first, second}].push_back(held);
    }
  }

  Shared Share(std::size_t line, const OnLine& a, const OnLine& b, const std::vector<const OnLine*>& connectors) const {
    Shared out{line};
    double low = std::max(a.low, b.low), high = std::min(a.high, b.high);
    for (const Carrier& one : a.carriers) {
      for (const Carrier& other : b.carriers) {
        if (Fastens(one) || Fastens(other) || !Mate(one, other)) continue;
        if (!out.mated) low = std::max(one.from, other.from), high = std::min(one.to, other.to);
        out.mated = true;
        out.radius = std::max(out.radius, one.radius);
      }
    }
    for (const OnLine* connector : connectors) {
      const auto holds = [&](const OnLine& piece) {
        return std::any_of(piece.carriers.begin(), piece.carriers.end(), [&](const Carrier& bore) {
          return std::any_of(connector->carriers.begin(), connector->carriers.end(),
                             [&](const Carrier& pin) { return bore.concave && Mate(bore, pin); });
        });
      };
      if (Fastens(*connector) && connector->low < std::min(a.high, b.high) + kGap &&
          connector->high > std::max(a.low, b.low) - kGap)
        out.screwed = true;
      if (!Fastens(*connector) && holds(a) && holds(b)) out.mated = true;
    }
    for (const OnLine* piece : {&a, &b}) {
      const OnLine& other = piece == &a ? b : a;
      for (const Carrier& one : piece->carriers) {
        if (Fastens(one) && one.from < other.high + kOverlap && one.to > other.low - kOverlap) out.screwed = true;
        for (const Carrier& two : piece->carriers)
          out.bearing = out.bearing || (one.node != two.node && !Fastens(one) && !Fastens(two) && Mate(one, two));
      }
      out.origin = out.origin || OriginOn(line, piece->group);
    }
    out.at = 0.5 * (low + high);
    return out;
  }

  bool OriginOn(std::size_t line, std::int32_t group) const {
    const CadGroup& each = groups_.groups[static_cast<std::size_t>(group)];
    if (each.hinted) return false;
    const AxisLine& axis = lines_[line];
    const Vector3 off = each.place.position - axis.point;
    if (Norm(off - Dot(off, axis.direction) * axis.direction) > kOnAxis) return false;
    for (const Vector3 unit : {Vector3{1, 0, 0}, Vector3{0, 1, 0}, Vector3{0, 0, 1}}) {
      if (Norm(Cross(Rotate(each.place.rotation, unit), axis.direction)) < kSameDirection) return true;
    }
    return false;
  }

  // How many of the others stand in a circle around one of them, evenly; 0 where they do not.
  std::size_t CircleAround(const std::vector<const Shared*>& family, const Shared& centre) const {
    if (family.size() > kMostFamily) return 0;
    std::map<std::int64_t, std::vector<Vector3>> by_radius;
    for (const Shared* each : family) {
      if (each == &centre) continue;
      const Vector3 off = lines_[each->line].point - lines_[centre.line].point;
      by_radius[std::llround(Norm(off) / kCircle)].push_back(off);
    }
    std::size_t most = 0;
    for (const auto& [radius, offsets] : by_radius) {
      Vector3 sum;
      for (const Vector3& each : offsets) sum = sum + each;
      if (offsets.size() >= 3 && Norm(sum) < kCircle * static_cast<double>(offsets.size()))
        most = std::max(most, offsets.size());
    }
    return most;
  }

  // A pair's axes by direction.
  std::vector<std::vector<const Shared*>> FamiliesOf(const std::vector<Shared>& shared) const {
    std::vector<std::vector<const Shared*>> families;
    for (const Shared& each : shared) {
      const auto same = std::find_if(families.begin(), families.end(), [&](const auto& family) {
        return Norm(Cross(lines_[family.front()->line].direction, lines_[each.line].direction)) < kSameDirection;
      });
      if (same != families.end())
        same->push_back(&each);
      else
        families.push_back({&each});
    }
    return families;
  }

  JointCandidate Make(std::int32_t first, std::int32_t second, const Shared& at, double score, bool turns,
                      std::string reason) const {
    const AxisLine& line = lines_[at.line];
    return {turns, first, second, line.point + at.at * line.direction, line.direction, score, std::move(reason), ""};
  }

  void Decide(std::int32_t first, std::int32_t second, const std::vector<Shared>& shared,
              std::vector<JointCandidate>* out) const {
    const auto connects = [&](std::int32_t group) { return groups_.groups[static_cast<std::size_t>(group)].connects; };
    if (connects(first) || connects(second)) {
      out->push_back(Make(
          first, second, shared.front(), 1.0, false,
          (connects(first) ? "the first" : "the second") + std::string(" is a pin, screw or washer in the other")));
      return;
    }
    const auto families = FamiliesOf(shared);
    std::vector<JointCandidate> found;
    std::size_t ties = 0;  // directions in which the two are held
    for (const std::vector<const Shared*>& family : families) {
      found.push_back(DecideFamily(first, second, family));
      ties += found.back().score >= kTakenFrom ? 1 : 0;
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const JointCandidate& a, const JointCandidate& b) { return a.score > b.score; });
    JointCandidate& best = found.front();
    if (best.turns && ties > 1 && found[1].score >= kTakenFrom) {
      best.turns = false;
      best.reason = "axes of " + std::to_string(ties) + " directions are shared: nothing turns about all of them";
    }
    out->push_back(best);
  }

  JointCandidate DecideFamily(std::int32_t first, std::int32_t second, const std::vector<const Shared*>& family) const {
    for (const Shared* each : family) {
      const std::size_t screws = CircleAround(family, *each);
      if (screws == 0) continue;
      const std::string circle = std::to_string(screws) + " screw axes in a circle around this one";
      if (!each->bearing) return Make(first, second, *each, 0.9, false, circle + ", and nothing turns on it: a flange");
      return Make(first, second, *each, each->origin ? 0.95 : 0.85, true,
                  circle + ", and a pin in a bore on it within one of the two" +
                      (each->origin ? ", whose origin is on it" : ""));
    }
    const Shared& lone = *family.front();
    if (family.size() > 1)
      return Make(first, second, lone, 0.8, false,
                  std::to_string(family.size()) + " parallel axes, none the centre of the others: screws");
    if (lone.mated && !lone.screwed)
      return Make(first, second, lone, lone.origin ? 0.85 : 0.75, true,
                  std::string("one axis, a pin in a bore") + (lone.origin ? ", an origin on it" : ""));
    if (lone.screwed) return Make(first, second, lone, 0.2, true, "one axis, and a screw on it");
    return Make(first, second, lone, lone.origin ? 0.45 : 0.3, true,
                std::string("one axis, but no pin in a bore") + (lone.origin ? "; an origin is on it" : ""));
  }

  const std::vector<AxisLine>& lines_;
  Groups& groups_;
  std::map<std::pair<std::int32_t, std::int32_t>, std::vector<Shared>> pairs_;
};

}  // namespace

std::vector<JointCandidate> JudgePairs(const std::vector<AxisLine>& lines, Groups* groups) {
  return Judge(lines, groups).Run();
}

}  // namespace consac::twin
