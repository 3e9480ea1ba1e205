#include "consac/robot/robot.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "consac/base/names.h"
#include "consac/base/text.h"

namespace consac::robot {
namespace {

constexpr std::pair<JointType, std::string_view> kJointTypes[] = {
    {JointType::kFixed, "fixed"},
    {JointType::kRevolute, "revolute"},
    {JointType::kContinuous, "continuous"},
    {JointType::kPrismatic, "prismatic"},
};
constexpr double kLongest = 1e6;     // m and rad; beyond it a file has other units or none
constexpr double kRounding = 1e-15;  // of an inertia's largest, kg m^2: programs that write files leave -5e-20 for 0

using Numbers = std::map<std::string_view, std::int32_t>;  // of named things

Status Wrong(std::string what) {
  return {StatusCode::kInvalidArgument, std::move(what)};
}

bool IsSmall(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::abs(value) <= kLongest; });
}

Status CheckDrive(const JointDescription& joint) {
  const JointDrive& drive = joint.drive;
  const std::string which = "joint " + Quote(joint.name) + ": ";
  if (std::isnan(drive.lower) || std::isnan(drive.upper) || drive.lower > drive.upper)
    return Wrong(which + "its lower limit " + NumberText(drive.lower) + " is above its upper limit " +
                 NumberText(drive.upper));
  if (!(drive.velocity >= 0.0) || !(drive.effort >= 0.0))
    return Wrong(which + "velocity and effort are at least 0, here " + NumberText(drive.velocity) + " and " +
                 NumberText(drive.effort));
  if (!std::isfinite(drive.damping) || !std::isfinite(drive.friction) || drive.damping < 0.0 || drive.friction < 0.0)
    return Wrong(which + "damping and friction are numbers of at least 0, here " + NumberText(drive.damping) + " and " +
                 NumberText(drive.friction));
  return {};
}

Status CheckJoint(const JointDescription& joint) {
  CONSAC_RETURN_IF_ERROR(CheckName("joint", joint.name));
  const std::string which = "joint " + Quote(joint.name) + ": ";
  const Vector3& p = joint.origin.position;
  if (!IsSmall({p.x, p.y, p.z}))
    return Wrong(which + "its origin is further than 1,000 km away; are the units metres?");
  if (joint.type == JointType::kFixed) return {};
  const double length = Norm(joint.axis);
  if (!(length > 1e-9) || !std::isfinite(length))
    return Wrong(which + "its axis is (" + NumberText(joint.axis.x) + ", " + NumberText(joint.axis.y) + ", " +
                 NumberText(joint.axis.z) + "), which is no direction; say about or along which axis it moves");
  return CheckDrive(joint);
}

Status CheckInertial(const LinkDescription& link) {
  const Inertial& body = *link.inertial;
  const auto& [xx, xy, xz, yy, yz, zz] = body.inertia;
  const std::string which = "link " + Quote(link.name) + ": ";
  if (!std::isfinite(body.mass) || body.mass < 0.0)
    return Wrong(which + "its mass is " + NumberText(body.mass) + "; it must be at least 0");
  if (!IsSmall({body.centre.x, body.centre.y, body.centre.z}))
    return Wrong(which + "its centre of mass is too far away");
  const double least = -kRounding * std::max({1.0, xx, yy, zz});
  if (!IsSmall({xx, xy, xz, yy, yz, zz}) || xx < least || yy < least || zz < least)
    return Wrong(which + "its inertia is no inertia: ixx " + NumberText(xx) + ", iyy " + NumberText(yy) + ", izz " +
                 NumberText(zz));
  return {};
}

Result<Numbers> NumbersOfLinks(const RobotDescription& description) {
  Numbers numbers;
  if (description.links.empty()) return Wrong("robot " + Quote(description.name) + " has no link");
  if (description.links.size() > kMostLinks)
    return Wrong("robot " + Quote(description.name) + " has " + std::to_string(description.links.size()) +
                 " links; at most " + std::to_string(kMostLinks) + " are taken");
  for (const LinkDescription& link : description.links) {
    CONSAC_RETURN_IF_ERROR(CheckName("link", link.name));
    if (link.inertial.has_value()) CONSAC_RETURN_IF_ERROR(CheckInertial(link));
    if (!numbers.emplace(link.name, static_cast<std::int32_t>(numbers.size())).second)
      return Wrong("two links are named " + Quote(link.name) + "; names must differ");
  }
  return numbers;
}

// A description's tree by numbers: for each link the joint above it and the joints below it.
struct Tree {
  std::vector<std::int32_t> above;               // [L] joint, -1 none
  std::vector<std::vector<std::int32_t>> below;  // [L] joints, as the file lists them
  std::vector<std::int32_t> parent, child;       // [J] links
};

Result<Tree> TreeOf(const RobotDescription& description, const Numbers& links) {
  Tree tree;
  tree.above.assign(description.links.size(), -1);
  tree.below.resize(description.links.size());
  Numbers names;
  for (const JointDescription& joint : description.joints) {
    CONSAC_RETURN_IF_ERROR(CheckJoint(joint));
    const auto number = static_cast<std::int32_t>(names.size());
    if (!names.emplace(joint.name, number).second)
      return Wrong("two joints are named " + Quote(joint.name) + "; names must differ");
    for (const std::string* link : {&joint.parent, &joint.child}) {
      if (!links.contains(*link))
        return Wrong("joint " + Quote(joint.name) + " names the link " + Quote(*link) + ", which is not there");
    }
    const std::int32_t parent = links.find(joint.parent)->second, child = links.find(joint.child)->second;
    std::int32_t& above = tree.above[static_cast<std::size_t>(child)];
    if (above >= 0)
      return Wrong("link " + Quote(joint.child) + " hangs on two joints, " +
                   Quote(description.joints[static_cast<std::size_t>(above)].name) + " and " + Quote(joint.name) +
                   ": a closed chain, which is not taken; leave one of them out");
    above = number;
    tree.below[static_cast<std::size_t>(parent)].push_back(number);
    tree.parent.push_back(parent);
    tree.child.push_back(child);
  }
  return tree;
}

// Links that no base leads to hang on each other: names the loop.
Status Loop(const RobotDescription& description, const Tree& tree, std::int32_t link) {
  const auto up = [&](std::int32_t from) {
    return tree.parent[static_cast<std::size_t>(tree.above[static_cast<std::size_t>(from)])];
  };
  for (std::size_t i = 0; i < description.links.size(); ++i) link = up(link);  // onto the loop, wherever it began
  std::string names;
  std::int32_t at = link;
  do {
    names = Quote(description.joints[static_cast<std::size_t>(tree.above[static_cast<std::size_t>(at)])].name) +
            (names.empty() ? "" : ", ") + names;
    at = up(at);
  } while (at != link && names.size() < 400);
  return Wrong("the joints " + names + " are a loop: each link hangs on the next; a robot is a tree from one base");
}

Result<std::int32_t> BaseOf(const RobotDescription& description, const Tree& tree) {
  std::int32_t base = -1;
  for (std::size_t link = 0; link < tree.above.size(); ++link) {
    if (tree.above[link] >= 0) continue;
    if (base >= 0)
      return Wrong("links " + Quote(description.links[static_cast<std::size_t>(base)].name) + " and " +
                   Quote(description.links[link].name) +
                   " both hang on nothing: two roots; put a fixed joint between them");
    base = static_cast<std::int32_t>(link);
  }
  return base >= 0 ? Result<std::int32_t>(base) : Result<std::int32_t>(Loop(description, tree, 0));
}

Link Rebased(const LinkDescription& link, const Quaternion& turn) {
  Link out{link.name, link.inertial};
  if (out.inertial.has_value()) {
    out.inertial->centre = Rotate(Inverse(turn), out.inertial->centre);
    out.inertial->inertia = TurnedInertia(out.inertial->inertia, turn);
    for (const std::size_t moment : {0, 3, 5})
      out.inertial->inertia[moment] = std::max(0.0, out.inertial->inertia[moment]);
  }
  return out;
}

Joint Rebased(const JointDescription& joint, std::int32_t parent, const Quaternion& parent_turn) {
  Joint out;
  out.name = joint.name;
  out.type = joint.type;
  out.parent = parent;
  out.drive = joint.drive;
  out.source = joint.source;
  if (joint.type == JointType::kContinuous) out.drive.lower = -kNoLimit, out.drive.upper = kNoLimit;
  if (joint.type != JointType::kFixed) {
    out.file_axis = (1.0 / Norm(joint.axis)) * joint.axis;
    out.axis_turn = TurnOfXInto(out.file_axis);
  }
  const Quaternion back = Inverse(parent_turn);
  out.rest = {Normalised(back * joint.origin.rotation * out.axis_turn), Rotate(back, joint.origin.position)};
  return out;
}

// Which position moves a joint: its own, or through mimics that of another.
Status Follow(const RobotDescription& description, const std::vector<std::int32_t>& order, Robot* robot) {
  Numbers numbers;
  for (std::size_t j = 0; j < robot->joints.size(); ++j)
    numbers.emplace(robot->joints[j].name, static_cast<std::int32_t>(j));
  for (std::size_t j = 0; j < robot->joints.size(); ++j) {
    Joint& joint = robot->joints[j];
    const std::optional<Mimic>& mimic = description.joints[static_cast<std::size_t>(order[j])].mimic;
    if (joint.type == JointType::kFixed) continue;
    if (!mimic.has_value()) {
      joint.position_index = robot->positions();
      robot->position_joints.push_back(static_cast<std::int32_t>(j));
      continue;
    }
    const auto found = numbers.find(mimic->joint);
    if (found == numbers.end() || robot->joints[static_cast<std::size_t>(found->second)].type == JointType::kFixed)
      return Wrong("joint " + Quote(joint.name) + " mimics " + Quote(mimic->joint) +
                   (found == numbers.end() ? ", which is not there" : ", which is fixed"));
    if (!IsSmall({mimic->multiplier, mimic->offset}))
      return Wrong("joint " + Quote(joint.name) + ": its mimic's multiplier and offset are no usable numbers");
    joint.mimics = found->second;
    joint.multiplier = mimic->multiplier;
    joint.offset = mimic->offset;
  }
  // A mimic of a mimic follows the joint at the end of the chain.
  for (Joint& joint : robot->joints) {
    std::int32_t leader = joint.mimics;
    for (std::size_t steps = 0; leader >= 0 && joint.position_index < 0; ++steps) {
      const Joint& next = robot->joints[static_cast<std::size_t>(leader)];
      if (&next == &joint || steps > robot->joints.size())
        return Wrong("joint " + Quote(joint.name) + " mimics itself, directly or through others");
      joint.offset += joint.multiplier * next.offset;
      joint.multiplier *= next.multiplier;
      joint.position_index = next.position_index;
      leader = next.mimics;
    }
    if (!IsSmall({joint.multiplier, joint.offset}))
      return Wrong("joint " + Quote(joint.name) + " follows through others by a multiplier of " +
                   NumberText(joint.multiplier) + " and an offset of " + NumberText(joint.offset) +
                   ", which are no usable numbers");
  }
  return {};
}

}  // namespace

std::array<double, 6> TurnedInertia(const std::array<double, 6>& inertia, const Quaternion& turn) {
  const auto& [xx, xy, xz, yy, yz, zz] = inertia;
  const Vector3 rows[3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
  const Vector3 axes[3] = {Rotate(turn, {1, 0, 0}), Rotate(turn, {0, 1, 0}), Rotate(turn, {0, 0, 1})};
  const auto element = [&](int i, int j) {
    const Vector3 product{Dot(rows[0], axes[j]), Dot(rows[1], axes[j]), Dot(rows[2], axes[j])};
    return Dot(axes[i], product);
  };
  return {element(0, 0), element(0, 1), element(0, 2), element(1, 1), element(1, 2), element(2, 2)};
}

std::string_view NameOf(JointType type) {
  for (const auto& [known, name] : kJointTypes) {
    if (known == type) return name;
  }
  return "";
}

bool ParseJointType(std::string_view name, JointType* type) {
  for (const auto& [known, text] : kJointTypes) {
    if (text != name) continue;
    *type = known;
    return true;
  }
  return false;
}

std::int32_t Robot::FindJoint(std::string_view joint) const {
  const auto found = std::find_if(joints.begin(), joints.end(), [&](const Joint& each) { return each.name == joint; });
  return found == joints.end() ? -1 : static_cast<std::int32_t>(found - joints.begin());
}

std::int32_t Robot::FindLink(std::string_view link) const {
  const auto found = std::find_if(links.begin(), links.end(), [&](const Link& each) { return each.name == link; });
  return found == links.end() ? -1 : static_cast<std::int32_t>(found - links.begin());
}

const Joint& Robot::LeaderOf(const Joint& joint) const {
  return joints[static_cast<std::size_t>(position_joints[static_cast<std::size_t>(joint.position_index)])];
}

std::vector<std::int32_t> Robot::EndLinks() const {
  std::vector<bool> carries(links.size(), false);
  for (const Joint& joint : joints) carries[static_cast<std::size_t>(joint.parent)] = true;
  std::vector<std::int32_t> ends;
  for (std::size_t link = 0; link < links.size(); ++link) {
    if (!carries[link]) ends.push_back(static_cast<std::int32_t>(link));
  }
  return ends;
}

Result<Robot> MakeRobot(const RobotDescription& description) {
  CONSAC_RETURN_IF_ERROR(CheckName("robot", description.name));
  const Result<Numbers> numbers = NumbersOfLinks(description);
  if (!numbers.ok()) return numbers.status();
  const Result<Tree> tree = TreeOf(description, *numbers);
  if (!tree.ok()) return tree.status();
  const Result<std::int32_t> base = BaseOf(description, *tree);
  if (!base.ok()) return base.status();

  Robot robot;
  robot.name = description.name;
  std::vector<std::int32_t> number_of(description.links.size(), -1);  // of a link in the table
  std::vector<std::int32_t> order;                                    // joints of the file, as the table has them
  number_of[static_cast<std::size_t>(*base)] = 0;
  robot.links.push_back(Rebased(description.links[static_cast<std::size_t>(*base)], {}));
  const auto push_below = [&](std::vector<std::int32_t>& stack, std::int32_t link) {
    const std::vector<std::int32_t>& below = tree->below[static_cast<std::size_t>(link)];
    stack.insert(stack.end(), below.rbegin(), below.rend());
  };
  std::vector<std::int32_t> stack;
  for (push_below(stack, *base); !stack.empty();) {
    const auto j = static_cast<std::size_t>(stack.back());
    stack.pop_back();
    const auto child = static_cast<std::size_t>(tree->child[j]);
    const std::int32_t parent = number_of[static_cast<std::size_t>(tree->parent[j])];
    const Quaternion parent_turn =
        parent == 0 ? Quaternion{} : robot.joints[static_cast<std::size_t>(parent) - 1].axis_turn;
    robot.joints.push_back(Rebased(description.joints[j], parent, parent_turn));
    robot.links.push_back(Rebased(description.links[child], robot.joints.back().axis_turn));
    number_of[child] = static_cast<std::int32_t>(robot.links.size()) - 1;
    order.push_back(static_cast<std::int32_t>(j));
    push_below(stack, static_cast<std::int32_t>(child));
  }
  for (std::size_t link = 0; link < number_of.size(); ++link) {
    if (number_of[link] < 0) return Loop(description, *tree, static_cast<std::int32_t>(link));
  }
  CONSAC_RETURN_IF_ERROR(Follow(description, order, &robot));
  return robot;
}

}  // namespace consac::robot
