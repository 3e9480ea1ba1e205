// Works out a reaching task from a joint table: tool, ready pose and goals.
#include "worlds/twin_reach/twin_reach.h"

#include <algorithm>
#include <cmath>

#include "consac/base/text.h"

namespace consac::worlds {
namespace {

using robot::JointType;
using robot::Vector3;

constexpr int kSamples = 2000;             // poses that are looked at
constexpr std::size_t kCandidates = 1000;  // of them, the most comfortable ones, that goals are tried from
constexpr double kLargestEdge = 0.30;      // m, FetchReach's cube
constexpr double kShrink = 0.85;           // from one size of cube to the next smaller
constexpr int kSizes = 16;                 // of cubes: down to 0.09 of the largest
constexpr double kNearShare = 1.0 / 6;     // of the edge: FetchReach's 0.05 m of 0.30 m
constexpr int kPatience = 25;              // steps that a goal may take: half an episode
constexpr double kUnlimitedShift = 0.5;    // m to each side, of a joint that slides without end

Status Refused(const std::string& why) {
  return {StatusCode::kInvalidArgument, why};
}

// Whether its own motion is what fingers do: it slides, or follows another joint.
bool IsFinger(const robot::Joint& joint) {
  return joint.type == JointType::kPrismatic || joint.mimics >= 0;
}

const robot::Joint& JointAbove(const robot::Robot& robot, std::int32_t link) {
  return robot.joints[static_cast<std::size_t>(link) - 1];
}

// The last link of the chain with most joints that move by themselves; without fingers.
std::int32_t DefaultTool(const robot::Robot& robot) {
  std::int32_t tool = 0;
  std::size_t longest = 0;
  for (std::int32_t link : robot.EndLinks()) {
    while (link > 0 && IsFinger(JointAbove(robot, link))) link = JointAbove(robot, link).parent;
    const std::size_t joints = CarryingPositions(robot, {link, {}}).size();
    if (joints > longest) tool = link, longest = joints;
  }
  return tool;
}

// The end of the link's capsule that is farther from its joint; the joint where it has none.
Vector3 DefaultToolPoint(const robot::Robot& robot, std::int32_t link) {
  Vector3 point;
  for (const robot::Capsule& capsule : robot.capsules) {
    if (capsule.link != link) continue;
    for (const auto& [end, other] : {std::pair(capsule.from, capsule.to), std::pair(capsule.to, capsule.from)}) {
      const Vector3 along = end - other;
      const double length = Norm(along);
      const Vector3 tip = length > 0.0 ? end + (capsule.radius / length) * along : end;
      if (Norm(tip) > Norm(point)) point = tip;
    }
  }
  return point;
}

// Limits of each position to draw poses from: without end becomes half a turn, or kUnlimitedShift.
robot::PositionLimits DrawnLimits(const robot::Robot& robot) {
  robot::PositionLimits limits = LimitsOf(robot);
  for (std::size_t i = 0; i < limits.lower.size(); ++i) {
    const robot::Joint& joint = robot.joints[static_cast<std::size_t>(robot.position_joints[i])];
    const double far = joint.type == JointType::kPrismatic ? kUnlimitedShift : robot::kPiRadians;
    if (!std::isfinite(limits.lower[i]))
      limits.lower[i] = std::isfinite(limits.upper[i]) ? limits.upper[i] - far : -far;
    if (!std::isfinite(limits.upper[i])) limits.upper[i] = limits.lower[i] + (limits.lower[i] < 0.0 ? 2.0 : 1.0) * far;
    limits.lower[i] = std::max(limits.lower[i], limits.upper[i] - 2.0 * far);
  }
  return limits;
}

// A pose to begin from.
struct Candidate {
  std::vector<double> joints;
  Vector3 tool;
  bool touches = false;  // itself
  double strain = 0.0;   // how near to a limit the nearest joint is: 0 in the middle, 1 there
};

// Looks for where the robot begins and what it can reach from there.
class Search {
 public:
  Search(ReachTask& task, const TwinReachChoice& choice, std::vector<double> rest)
      : task_(task), choice_(choice), rest_(std::move(rest)), kinematics_(task.robot) {}

  // Ready pose, box of goals and threshold of the task.
  Status Run() {
    LeaveOutWhatAlwaysTouches();
    collision_.emplace(task_.robot);
    row_.resize(RobotReach::Spec(task_, 1).behaviours[0].observation_layout.row_bytes / sizeof(float));
    std::vector<Candidate> candidates = choice_.ready.empty() ? Drawn() : std::vector<Candidate>{At(rest_)};
    const double reach = Reach();
    std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return std::pair(a.touches, a.strain) < std::pair(b.touches, b.strain);
    });
    if (candidates.size() > kCandidates) candidates.resize(kCandidates);
    const bool found = choice_.goals.has_value()
                           ? FitToBox(candidates)
                           : FitCube(candidates, reach, true) || FitCube(candidates, reach, false);
    if (found) return Status::Ok();
    const std::string& link = task_.robot.links[static_cast<std::size_t>(task_.tools[0].frame.link)].name;
    return Refused("no cube of goals was found that " + Quote(link) + " of " + Quote(task_.robot.name) +
                   " reaches all of; name another \"tool\", a \"ready\" pose or \"goals\" in a file "
                   "(worlds/twin_reach/README.md)");
  }

 private:
  Candidate At(std::vector<double> joints) {
    kinematics_.Forward(joints);
    Candidate candidate;
    candidate.tool = kinematics_.Pose(task_.tools[0].frame).position;
    candidate.touches = collision_->Find(kinematics_.links()).distance < 0.0;
    candidate.joints = std::move(joints);
    return candidate;
  }

  std::vector<std::vector<double>> DrawnJoints(int count) const {
    const robot::PositionLimits limits = DrawnLimits(task_.robot);
    Rng rng(1, StreamId("twin_reach"));
    std::vector<std::vector<double>> drawn;
    for (int i = 0; i < count; ++i) {
      drawn.push_back(rest_);
      for (const std::int32_t position : CarryingPositions(task_.robot, task_.tools[0].frame)) {
        const auto at = static_cast<std::size_t>(position);
        drawn.back()[at] = rng.Between(limits.lower[at], limits.upper[at]);
      }
    }
    return drawn;
  }

  std::vector<Candidate> Drawn() {
    const robot::PositionLimits limits = DrawnLimits(task_.robot);
    std::vector<Candidate> candidates;
    for (std::vector<double>& joints : DrawnJoints(kSamples)) {
      double strain = 0.0;
      for (const std::int32_t position : CarryingPositions(task_.robot, task_.tools[0].frame)) {
        const auto at = static_cast<std::size_t>(position);
        const double half = 0.5 * (limits.upper[at] - limits.lower[at]);
        if (half > 0.0) strain = std::max(strain, std::abs(joints[at] - limits.lower[at] - half) / half);
      }
      candidates.push_back(At(std::move(joints)));
      candidates.back().strain = strain;
    }
    return candidates;
  }

  // m from the first joint on its way to the farthest point of the tool.
  double Reach() {
    double reach = 0.0;
    std::int32_t first = task_.tools[0].frame.link;
    for (std::int32_t link = first; link > 0; link = JointAbove(task_.robot, link).parent) {
      if (JointAbove(task_.robot, link).position_index >= 0) first = link;
    }
    for (const std::vector<double>& joints : DrawnJoints(kSamples / 4)) {
      kinematics_.Forward(joints);
      const Vector3 from = kinematics_.links()[static_cast<std::size_t>(first)].position;
      reach = std::max(reach, Norm(kinematics_.Pose(task_.tools[0].frame).position - from));
    }
    return reach;
  }

  // Links that do not move against each other here, and those whose capsules overlap in every second pose: capsules are
  // wider than links, and neighbours of neighbours stand in each other's.
  void LeaveOutWhatAlwaysTouches() {
    robot::Robot& robot = task_.robot;
    const robot::SelfCollision collision(robot);
    if (collision.pairs().empty()) return;
    const std::vector<std::int32_t> moving = CarryingPositions(robot, task_.tools[0].frame);
    std::vector<std::int32_t> carried(robot.links.size(), 0);  // the link above that moves here
    for (std::size_t link = 1; link < carried.size(); ++link) {
      const robot::Joint& joint = robot.joints[link - 1];
      const bool moves = std::find(moving.begin(), moving.end(), joint.position_index) != moving.end();
      carried[link] = moves ? static_cast<std::int32_t>(link) : carried[static_cast<std::size_t>(joint.parent)];
    }
    const std::vector<std::vector<double>> poses = DrawnJoints(kSamples / 4);
    std::vector<std::size_t> touching(collision.pairs().size(), 0);
    for (const std::vector<double>& joints : poses) {
      kinematics_.Forward(joints);
      for (std::size_t i = 0; i < touching.size(); ++i) {
        const robot::Capsule& a = CapsuleOf(collision.pairs()[i].first);
        const robot::Capsule& b = CapsuleOf(collision.pairs()[i].second);
        const auto at = [&](const robot::Capsule& of) {
          return kinematics_.links()[static_cast<std::size_t>(of.link)];
        };
        touching[i] += DistanceOfCapsules(a, at(a), b, at(b)) < 0.0 ? 1 : 0;
      }
    }
    std::vector<std::pair<std::int32_t, std::int32_t>> out;
    for (std::size_t i = 0; i < touching.size(); ++i) {
      const std::int32_t a = CapsuleOf(collision.pairs()[i].first).link,
                         b = CapsuleOf(collision.pairs()[i].second).link;
      const bool together = carried[static_cast<std::size_t>(a)] == carried[static_cast<std::size_t>(b)];
      if (together || 2 * touching[i] >= poses.size()) out.emplace_back(a, b);
    }
    robot.allowed_collisions.insert(robot.allowed_collisions.end(), out.begin(), out.end());
  }

  const robot::Capsule& CapsuleOf(std::int32_t number) const {
    return task_.robot.capsules[static_cast<std::size_t>(number)];
  }

  void SetBox(const TwinReachChoice::Box& box) {
    double edge = 0.0;
    for (std::size_t i = 0; i < 3; ++i) edge = std::max(edge, box.high[i] - box.low[i]);
    task_.tools[0].low = box.low, task_.tools[0].high = box.high;
    task_.tool_reach = kNearShare * edge;
    task_.threshold = choice_.threshold.value_or(task_.tool_reach);
  }

  // How many of the box's 27 corners, middles and sides the tool comes to, going straight there from the ready pose.
  int Arrivals(RobotReach& world, int wanted) {
    const ReachTool& tool = task_.tools[0];
    int arrivals = 0;
    for (int corner = 0; corner < 27; ++corner) {
      double goal[3];
      for (int i = 0, rest = corner; i < 3; ++i, rest /= 3) {
        const auto axis = static_cast<std::size_t>(i);
        goal[i] = tool.low[axis] + 0.5 * (rest % 3) * (tool.high[axis] - tool.low[axis]);
      }
      arrivals += Arrives(world, goal) ? 1 : 0;
      if (arrivals + 26 - corner < wanted) break;
    }
    return arrivals;
  }

  bool Arrives(RobotReach& world, std::span<const double, 3> goal) {
    world.Begin(goal);
    Rng rng;
    for (int step = 0; step < kPatience; ++step) {
      float action[3];
      double off = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const double way = goal[i] - world.tools()[i];
        off = std::max(off, std::abs(way));
        action[i] = static_cast<float>(std::clamp(way / task_.tool_reach, -1.0, 1.0));
      }
      if (off < 0.25 * task_.threshold) return true;
      (void)world.Step(action, rng, row_.data());
    }
    return false;
  }

  bool FitCube(const std::vector<Candidate>& candidates, double reach, bool above) {
    const double largest = std::min(kLargestEdge, reach);
    int best = kSizes;
    RobotReach world = World();
    for (const Candidate& candidate : candidates) {
      task_.ready = candidate.joints;
      for (int size = best - 1; size >= 0; --size) {
        const double half = 0.5 * largest * std::pow(kShrink, size);
        if (above && candidate.tool.z < half) break;
        SetBox(CubeAround(candidate.tool, half));
        if (Arrivals(world, 27) < 27) break;
        best = size;
        found_ = {candidate.joints, CubeAround(candidate.tool, half)};
      }
      if (best == 0) break;
    }
    if (best == kSizes) return false;
    task_.ready = found_.joints;
    SetBox(found_.box);
    return true;
  }

  bool FitToBox(const std::vector<Candidate>& candidates) {
    SetBox(*choice_.goals);
    int best = 0;
    RobotReach world = World();
    for (const Candidate& candidate : candidates) {
      task_.ready = candidate.joints;
      const int arrivals = Arrivals(world, best + 1);
      if (arrivals > best) best = arrivals, found_.joints = candidate.joints;
      if (best == 27) break;
    }
    if (best == 0) return false;
    task_.ready = found_.joints;
    return true;
  }

  static TwinReachChoice::Box CubeAround(Vector3 centre, double half) {
    return {{centre.x - half, centre.y - half, centre.z - half}, {centre.x + half, centre.y + half, centre.z + half}};
  }
  // A copy that looks at the task as it is changed here.
  RobotReach World() {
    return RobotReach(std::shared_ptr<const ReachTask>(&task_, [](const ReachTask*) {}));
  }

  struct Found {
    std::vector<double> joints;
    TwinReachChoice::Box box;
  };
  ReachTask& task_;
  const TwinReachChoice& choice_;
  std::vector<double> rest_;  // [positions] of joints that the tool does not hang on
  robot::Kinematics kinematics_;
  Found found_;
  std::optional<robot::SelfCollision> collision_;
  std::vector<float> row_;  // one observation
};

Result<std::vector<double>> RestOf(const robot::Robot& robot, const TwinReachChoice& choice) {
  std::vector<double> rest(static_cast<std::size_t>(robot.positions()), 0.0);
  const robot::PositionLimits limits = LimitsOf(robot);
  for (const auto& [name, position] : choice.ready) {
    const std::int32_t number = robot.FindJoint(name);
    if (number < 0) {
      std::vector<std::string_view> known;
      for (const robot::Joint& joint : robot.joints) known.emplace_back(joint.name);
      return Refused("ready: " + Quote(robot.name) + " has no joint " + Quote(name) + Suggestion(name, known));
    }
    const robot::Joint& joint = robot.joints[static_cast<std::size_t>(number)];
    if (joint.position_index < 0 || joint.mimics >= 0)
      return Refused("ready: the joint " + Quote(name) + " does not move by itself; leave it out");
    const auto at = static_cast<std::size_t>(joint.position_index);
    if (!(position >= limits.lower[at] && position <= limits.upper[at]))
      return Refused("ready: " + Quote(name) + " = " + NumberText(position) + " is beyond its limits " +
                     NumberText(limits.lower[at]) + " to " + NumberText(limits.upper[at]));
    rest[at] = position;
  }
  ClampToLimits(limits, rest);
  return rest;
}

}  // namespace

Result<std::shared_ptr<const ReachTask>> TwinReachTask(robot::Robot robot, const TwinReachChoice& choice,
                                                       std::string id) {
  auto task = std::make_shared<ReachTask>();
  std::int32_t link = robot.FindLink(choice.tool);
  if (link < 0 && !choice.tool.empty()) {
    std::vector<std::string_view> known;
    for (const robot::Link& row : robot.links) known.emplace_back(row.name);
    return Refused("tool: " + Quote(robot.name) + " has no link " + Quote(choice.tool) +
                   Suggestion(choice.tool, known));
  }
  if (choice.tool.empty()) link = DefaultTool(robot);
  const robot::Frame tool{link, {{}, choice.tool_point.value_or(DefaultToolPoint(robot, link))}};
  if (CarryingPositions(robot, tool).empty())
    return Refused("no joint of " + Quote(robot.name) + " moves the link " +
                   Quote(robot.links[static_cast<std::size_t>(link)].name) + "; a tool that moves is needed");
  Result<std::vector<double>> rest = RestOf(robot, choice);
  if (!rest.ok()) return rest.status();
  task->id = std::move(id);
  task->robot = std::move(robot);
  task->tools.push_back({tool, {}, {}});
  task->ready = *rest;
  CONSAC_RETURN_IF_ERROR(Search(*task, choice, std::move(*rest)).Run());
  return std::shared_ptr<const ReachTask>(std::move(task));
}

}  // namespace consac::worlds
