#pragma once
// The joint table: a robot's links and joints as a tree, with every joint turned so that it moves about its own X axis.
// Kinematics, importers, worlds and the engines' components stand on it. Not its geometry: that is in the meshes.
//
// Re-basing (source: ABB YuMi brought into Unreal by hand in the CONSAC thesis, 3.1; here exactly). A file says for
// joint j: frame T_j in the parent link, unit axis a_j in that frame. Let A_j turn the X axis into a_j, and A_p be the
// parent joint's. Then the joint's rest frame in the re-based parent is A_p^-1 T_j A_j, its motion is a rotation about
// X by +q (or a shift along X), and what the child link holds is written in A_j^-1. T_j Rot(a_j, q) A_j = T_j A_j
// Rot(x, q).

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/status.h"
#include "consac/robot/transform.h"

namespace consac::robot {

/// How a joint moves.
enum class JointType : std::uint8_t {
  kFixed,       ///< not at all
  kRevolute,    ///< turns between limits, rad
  kContinuous,  ///< turns without limits, rad
  kPrismatic,   ///< slides between limits, m
};
/// "revolute".
std::string_view NameOf(JointType type);
/// The type of that name; false where there is none.
bool ParseJointType(std::string_view name, JointType* type);

inline constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// Follows another joint: q = multiplier * q_of_joint + offset.
struct Mimic {
  std::string joint;        ///< whose position it takes
  double multiplier = 1.0;  ///< of that position
  double offset = 0.0;      ///< rad or m
};

/// What moves a joint and holds it back.
struct JointDrive {
  double lower = -kNoLimit, upper = kNoLimit;  ///< rad or m
  double velocity = kNoLimit;                  ///< most, rad/s or m/s
  double effort = kNoLimit;                    ///< most, N m or N
  double damping = 0.0;                        ///< N m s/rad or N s/m
  double friction = 0.0;                       ///< N m or N
};

/// Mass of a link, in the link's frame.
struct Inertial {
  double mass = 0.0;  ///< kg
  Vector3 centre;     ///< of mass, m
  /// About the centre, along the link's axes: xx, xy, xz, yy, yz, zz, kg m^2.
  std::array<double, 6> inertia{};
};

/// An inertia about the same point along axes that `turn` makes of the present ones.
std::array<double, 6> TurnedInertia(const std::array<double, 6>& inertia, const Quaternion& turn);

/// A joint as a file says it, before re-basing.
struct JointDescription {
  std::string name;
  JointType type = JointType::kFixed;
  std::string parent, child;  ///< links
  Transform origin;           ///< child link's frame in the parent link's, at position 0
  Vector3 axis{1, 0, 0};      ///< in the child's frame; of any length but 0
  JointDrive drive;
  std::optional<Mimic> mimic;
  std::string source;  ///< where its axis is from: "urdf", "mjcf"
};

/// A link as a file says it.
struct LinkDescription {
  std::string name;
  std::optional<Inertial> inertial;  ///< none where the file has none: nothing is made up
};

/// A robot as a file says it.
struct RobotDescription {
  std::string name;
  std::vector<LinkDescription> links;
  std::vector<JointDescription> joints;
};

/// A joint of the table. Its child link is the link after its own number: joint j moves link j + 1.
struct Joint {
  std::string name;
  JointType type = JointType::kFixed;
  std::int32_t parent = 0;           ///< link, at most j
  Transform rest;                    ///< its frame in the parent link's, at position 0; moves about its X axis
  Quaternion axis_turn;              ///< A_j, to restore the file's frame: file's frame = rest * inverse(axis_turn)
  Vector3 file_axis{1, 0, 0};        ///< what the file's axis was, of length 1
  JointDrive drive;                  ///< limits and the like
  std::int32_t position_index = -1;  ///< which of the positions moves it; -1 fixed
  double multiplier = 1.0;           ///< of that position; 1 but for a mimic joint
  double offset = 0.0;               ///< added to it; 0 but for a mimic joint
  std::int32_t mimics = -1;          ///< the joint it follows; -1 none
  std::string source;                ///< where its axis is from
};

/// A link of the table, in its re-based frame: its joint's, moved.
struct Link {
  std::string name;
  std::optional<Inertial> inertial;
};

/// A ball swept along a line: what a link takes up, roughly and from outside.
struct Capsule {
  std::int32_t link = 0;
  Vector3 from, to;     ///< ends of the line, in the link's frame, m
  double radius = 0.0;  ///< m
};

/// A robot: links and joints in order from the base, a parent always before its children. Made by MakeRobot.
struct Robot {
  std::string name;
  std::vector<Link> links;    ///< [L], the base first
  std::vector<Joint> joints;  ///< [L - 1]
  std::vector<std::int32_t>
      position_joints;            ///< [positions] which joint each position is of: those that move by themselves
  std::vector<Capsule> capsules;  ///< none unless somebody adds them
  std::vector<std::pair<std::int32_t, std::int32_t>> allowed_collisions;  ///< links that may touch: never looked at

  /// How many numbers are a pose: degrees of freedom.
  std::int32_t positions() const { return static_cast<std::int32_t>(position_joints.size()); }
  /// Which joint has that name; -1 none.
  std::int32_t FindJoint(std::string_view joint) const;
  /// Which link has that name; -1 none.
  std::int32_t FindLink(std::string_view link) const;
  /// The joint that moves by itself and that `joint` of this robot, which is not fixed, follows; of one that follows
  /// none, itself.
  const Joint& LeaderOf(const Joint& joint) const;
  /// Links that carry no others: where tools are.
  std::vector<std::int32_t> EndLinks() const;
};

inline constexpr std::size_t kMostLinks = 2000;  ///< of one robot

/// Checks that it is a tree with one base, that names are names and differ, that axes have a length, that limits and
/// masses make sense; orders it (depth first, children as the file lists them) and re-bases it. kInvalidArgument names
/// the joint or link, and what to do.
Result<Robot> MakeRobot(const RobotDescription& description);

}  // namespace consac::robot
