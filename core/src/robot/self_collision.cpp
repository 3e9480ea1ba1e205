#include "consac/robot/self_collision.h"

#include <algorithm>
#include <cmath>

namespace consac::robot {
namespace {

// The direction in which points spread most: the largest eigenvector of their covariance, by power iteration.
Vector3 LongestDirection(std::span<const Vector3> points, Vector3 mean) {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  for (const Vector3& point : points) {
    const Vector3 d = point - mean;
    xx += d.x * d.x, xy += d.x * d.y, xz += d.x * d.z, yy += d.y * d.y, yz += d.y * d.z, zz += d.z * d.z;
  }
  Vector3 direction = xx >= yy && xx >= zz ? Vector3{1, 0, 0} : yy >= zz ? Vector3{0, 1, 0} : Vector3{0, 0, 1};
  constexpr int kIterations = 64;
  for (int i = 0; i < kIterations; ++i) {
    const Vector3 next{xx * direction.x + xy * direction.y + xz * direction.z,
                       xy * direction.x + yy * direction.y + yz * direction.z,
                       xz * direction.x + yz * direction.y + zz * direction.z};
    const double length = Norm(next);
    if (!(length > 0.0)) break;
    direction = (1.0 / length) * next;
  }
  return direction;
}

// The rigid body a link belongs to: the first link above it that moves against its parent.
std::int32_t BodyOf(const Robot& robot, std::int32_t link) {
  while (link > 0 && robot.joints[static_cast<std::size_t>(link) - 1].type == JointType::kFixed)
    link = robot.joints[static_cast<std::size_t>(link) - 1].parent;
  return link;
}

// The body that carries a body; -1 for the base.
std::int32_t Carrier(const Robot& robot, std::int32_t body) {
  return body == 0 ? -1 : BodyOf(robot, robot.joints[static_cast<std::size_t>(body) - 1].parent);
}

}  // namespace

double DistanceOfSegments(Vector3 a_from, Vector3 a_to, Vector3 b_from, Vector3 b_to) {
  const Vector3 u = a_to - a_from, v = b_to - b_from, w = a_from - b_from;
  const double uu = Dot(u, u), vv = Dot(v, v), uv = Dot(u, v), uw = Dot(u, w), vw = Dot(v, w);
  constexpr double kPoint = 1e-18;  // m^2: shorter is a point
  double s = 0.0, t = 0.0;
  if (uu > kPoint) {
    const double determinant = uu * vv - uv * uv;
    if (vv <= kPoint) {
      s = std::clamp(-uw / uu, 0.0, 1.0);
    } else {
      s = determinant > 1e-12 * uu * vv ? std::clamp((uv * vw - uw * vv) / determinant, 0.0, 1.0) : 0.0;
      t = (uv * s + vw) / vv;
      if (t < 0.0 || t > 1.0) {
        t = std::clamp(t, 0.0, 1.0);
        s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
      }
    }
  } else if (vv > kPoint) {
    t = std::clamp(vw / vv, 0.0, 1.0);
  }
  return Norm(w + s * u - t * v);
}

double DistanceOfCapsules(const Capsule& a, const Transform& a_at, const Capsule& b, const Transform& b_at) {
  return DistanceOfSegments(a_at * a.from, a_at * a.to, b_at * b.from, b_at * b.to) - a.radius - b.radius;
}

Capsule CapsuleAround(std::span<const Vector3> points) {
  Capsule capsule;
  if (points.empty()) return capsule;
  Vector3 mean;
  for (const Vector3& point : points) mean = mean + point;
  mean = (1.0 / static_cast<double>(points.size())) * mean;
  const Vector3 direction = LongestDirection(points, mean);
  // The line through the middle of what is seen along it, not through the mean: meshes are finer where they are round.
  const Vector3 side = Rotate(TurnOfXInto(direction), {0, 1, 0}), other = Cross(direction, side);
  double low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 along = axis == 0 ? direction : axis == 1 ? side : other;
    low[axis] = high[axis] = Dot(points[0], along);
    for (const Vector3& point : points) {
      low[axis] = std::min(low[axis], Dot(point, along));
      high[axis] = std::max(high[axis], Dot(point, along));
    }
  }
  const Vector3 foot = 0.5 * (low[1] + high[1]) * side + 0.5 * (low[2] + high[2]) * other;
  double squared = 0.0;
  for (const Vector3& point : points) {
    const Vector3 away = point - foot;
    squared = std::max(squared, Dot(away, away) - Dot(away, direction) * Dot(away, direction));
  }
  capsule.radius = std::sqrt(squared);
  // The ends go in as far as every point stays inside the balls there.
  double from = 0.5 * (low[0] + high[0]), to = from;
  for (const Vector3& point : points) {
    const Vector3 away = point - foot;
    const double along = Dot(away, direction);
    const double beyond = std::sqrt(std::max(0.0, squared - (Dot(away, away) - along * along)));
    from = std::min(from, along + beyond);
    to = std::max(to, along - beyond);
  }
  capsule.from = foot + from * direction;
  capsule.to = foot + to * direction;
  return capsule;
}

SelfCollision::SelfCollision(const Robot& robot) : robot_(&robot) {
  const auto allowed = [&](std::int32_t a, std::int32_t b) {
    return std::any_of(robot.allowed_collisions.begin(), robot.allowed_collisions.end(), [&](const auto& pair) {
      return (pair.first == a && pair.second == b) || (pair.first == b && pair.second == a);
    });
  };
  for (std::size_t i = 0; i < robot.capsules.size(); ++i) {
    for (std::size_t j = i + 1; j < robot.capsules.size(); ++j) {
      const std::int32_t a = robot.capsules[i].link, b = robot.capsules[j].link;
      const std::int32_t a_body = BodyOf(robot, a), b_body = BodyOf(robot, b);
      if (a_body == b_body || Carrier(robot, a_body) == b_body || Carrier(robot, b_body) == a_body) continue;
      if (!allowed(a, b)) pairs_.emplace_back(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j));
    }
  }
}

SelfCollision::Nearest SelfCollision::Find(std::span<const Transform> links) const {
  Nearest nearest{std::numeric_limits<double>::infinity(), -1, -1};
  for (const auto& [i, j] : pairs_) {
    const Capsule& a = robot_->capsules[static_cast<std::size_t>(i)];
    const Capsule& b = robot_->capsules[static_cast<std::size_t>(j)];
    const double distance =
        DistanceOfCapsules(a, links[static_cast<std::size_t>(a.link)], b, links[static_cast<std::size_t>(b.link)]);
    if (distance < nearest.distance) nearest = {distance, i, j};
  }
  return nearest;
}

}  // namespace consac::robot
