#include "cad_kinematics.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "consac/base/text.h"
#include "consac/robot/kinematics.h"

namespace consac::twin {
namespace {

using robot::JointType;
using robot::Transform;
using robot::Vector3;

constexpr double kFitsAngle = 0.5 * robot::kPiRadians / 180.0, kFitsDistance = 1e-3;  // rad, m
constexpr std::size_t kMostAxes = 40;  // of a robot, and of candidates, by which it is laid over

struct Line {
  Vector3 point, direction;
};

// The frame that two lines make which are not parallel: x along the first, z across both, at the first's point that is
// nearest to the second.
std::optional<Transform> FrameOf(const Line& a, const Line& b) {
  const Vector3 across = Cross(a.direction, b.direction);
  const double sine = Norm(across);
  if (sine < 0.1) return std::nullopt;
  const Vector3 z = (1.0 / sine) * across, y = Cross(z, a.direction), off = b.point - a.point;
  const double along = Dot(Cross(off, b.direction), across) / (sine * sine);
  const Vector3& x = a.direction;
  return Transform{robot::Normalised(robot::FromMatrix({x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z})),
                   a.point + along * a.direction};
}

// Which candidate a line is on, -1 none.
std::int32_t On(const Line& line, const std::vector<Line>& candidates) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Vector3 off = line.point - candidates[i].point;
    const Vector3& d = candidates[i].direction;
    if (Norm(Cross(line.direction, d)) < kFitsAngle && Norm(off - Dot(off, d) * d) < kFitsDistance)
      return static_cast<std::int32_t>(i);
  }
  return -1;
}

Line Moved(const Transform& by, const Line& line) {
  return {by * line.point, Rotate(by.rotation, line.direction)};
}

// The best way to lay axes over candidates: most of them fit, and what is upright stays so.
std::optional<Transform> BestFit(const std::vector<Line>& axes, const std::vector<Line>& candidates) {
  std::optional<Transform> best;
  std::size_t most = 1;
  double least_turn = 0.0;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    for (std::size_t j = 0; j < axes.size(); ++j) {
      const std::optional<Transform> own = i == j ? std::nullopt : FrameOf(axes[i], axes[j]);
      if (!own.has_value()) continue;
      for (std::size_t k = 0; k < 4 * candidates.size() * candidates.size(); ++k) {
        Line a = candidates[k / 4 % candidates.size()], b = candidates[k / 4 / candidates.size()];
        if (k % 2 == 1) a.direction = -1.0 * a.direction;
        if (k / 2 % 2 == 1) b.direction = -1.0 * b.direction;
        const std::optional<Transform> there = FrameOf(a, b);
        if (!there.has_value()) continue;
        const Transform by = *there * Inverse(*own);
        if (On(Moved(by, axes[j]), {b}) < 0) continue;
        std::size_t fit = 0;
        for (const Line& axis : axes) fit += On(Moved(by, axis), candidates) >= 0 ? 1 : 0;
        const double turn = AngleBetween(by.rotation, {});
        if (fit < most || (fit == most && best.has_value() && turn > least_turn - 1e-6) || fit < 2) continue;
        best = by, most = fit, least_turn = turn;
      }
    }
  }
  return best;
}

}  // namespace

Status LayOver(const robot::Robot& known, const CadRobot& found, JointHints* hints, std::vector<std::string>* said) {
  robot::Kinematics kinematics(known);
  kinematics.Forward(std::vector<double>(known.position_joints.size(), 0.0));
  std::vector<Line> axes, candidates;
  std::vector<std::size_t> joints, numbers;
  for (std::size_t j = 0; j < known.joints.size() && axes.size() < kMostAxes; ++j) {
    if (known.joints[j].type == JointType::kFixed) continue;
    const Transform& at = kinematics.links()[j + 1];
    axes.push_back({at.position, Rotate(at.rotation, {1, 0, 0})});
    joints.push_back(j);
  }
  for (std::size_t i = 0; i < found.candidates.size() && candidates.size() < kMostAxes; ++i) {
    if (!found.candidates[i].turns) continue;
    candidates.push_back({found.candidates[i].origin, found.candidates[i].direction});
    numbers.push_back(i);
  }
  const std::optional<Transform> by = BestFit(axes, candidates);
  if (!by.has_value())
    return {StatusCode::kInvalidArgument,
            "its joints do not fit the axes that the CAD file has: no two of them that are "
            "not parallel are 1 mm and half a degree near; say joints in --hints"};
  std::vector<bool> used(candidates.size(), false);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const robot::Joint& joint = known.joints[joints[i]];
    const Line there = Moved(*by, axes[i]);
    const std::int32_t on = On(there, candidates);
    const auto taken = [&](const JointHint& hint) { return hint.name == joint.name; };
    if (std::any_of(hints->joints.begin(), hints->joints.end(), taken)) continue;
    if (on < 0 || used[static_cast<std::size_t>(on)]) {
      const Vector3 &p = there.point, &d = there.direction;
      const auto rounded = [](double value, double unit) {
        const double per_unit = 1.0 / unit;
        return NumberText(std::round(value * per_unit) / per_unit + 0.0);
      };
      said->push_back("joint " + Quote(joint.name) + " of --kinematics is at (" + rounded(p.x, 1e-6) + ", " +
                      rounded(p.y, 1e-6) + ", " + rounded(p.z, 1e-6) + ") m along (" + rounded(d.x, 1e-4) + ", " +
                      rounded(d.y, 1e-4) + ", " + rounded(d.z, 1e-4) +
                      "), where no two components share an axis; say its parent, child and axis in --hints");
      continue;
    }
    used[static_cast<std::size_t>(on)] = true;
    const JointCandidate& candidate = found.candidates[numbers[static_cast<std::size_t>(on)]];
    JointHint hint;
    hint.name = joint.name;
    hint.type = joint.type;
    hint.groups = {candidate.first, candidate.second};
    hint.axis.clear();
    hint.origin = candidate.origin;  // of the CAD file, which is what is seen
    hint.direction = Dot(candidate.direction, there.direction) < 0.0 ? -1.0 * candidate.direction : candidate.direction;
    hint.drive = joint.drive;
    hint.limited = std::isfinite(joint.drive.lower) && std::isfinite(joint.drive.upper);
    hints->joints.push_back(std::move(hint));
  }
  return {};
}

}  // namespace consac::twin
