#pragma once
// Whether a robot touches itself: distances between the capsules of its links. Rough and from outside: what capsules do
// not touch does not touch. Deterministic, no allocation after creation.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "consac/robot/robot.h"

namespace consac::robot {

/// The least distance between two lines' points, m. Source: Ericson, Real-Time Collision Detection, 5.1.9.
double DistanceOfSegments(Vector3 a_from, Vector3 a_to, Vector3 b_from, Vector3 b_to);
/// The distance between two capsules whose links stand at `a_at` and `b_at`; negative where they overlap, m.
double DistanceOfCapsules(const Capsule& a, const Transform& a_at, const Capsule& b, const Transform& b_at);
/// The capsule around `points` along their longest direction: no point is outside. Its link is 0; of no point it is a
/// ball of radius 0.
Capsule CapsuleAround(std::span<const Vector3> points);

/// The pairs of one robot's capsules that can meet.
class SelfCollision {
 public:
  /// Two capsules and how far they are apart.
  struct Nearest {
    double distance = 0.0;                 ///< m, negative where they overlap; infinite where no pair is looked at
    std::int32_t first = -1, second = -1;  ///< numbers of the robot's capsules; -1 none
  };

  /// `robot` must outlive this. Not looked at: capsules of links that do not move against each other, of links with one
  /// moving joint between them, and of robot.allowed_collisions.
  explicit SelfCollision(const Robot& robot);
  /// The two capsules that are nearest, with the links at `links` ([L], Kinematics::links).
  Nearest Find(std::span<const Transform> links) const;
  /// The pairs it looks at, numbers of capsules.
  std::span<const std::pair<std::int32_t, std::int32_t>> pairs() const { return pairs_; }

 private:
  const Robot* robot_;
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs_;
};

}  // namespace consac::robot
