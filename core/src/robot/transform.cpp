#include "consac/robot/transform.h"

#include <algorithm>
#include <cmath>

namespace consac::robot {

double Norm(Vector3 a) {
  return std::sqrt(Dot(a, a));
}

Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Vector3 Rotate(const Quaternion& q, Vector3 v) {
  const Vector3 axis{q.x, q.y, q.z};
  const Vector3 twice = 2.0 * Cross(axis, v);
  return v + q.w * twice + Cross(axis, twice);
}

Quaternion Normalised(const Quaternion& q) {
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (!(length > 0.0)) return {};
  const double scale = (q.w < 0.0 ? -1.0 : 1.0) / length;
  return {scale * q.x, scale * q.y, scale * q.z, scale * q.w};
}

Quaternion RotationAboutX(double angle) {
  return {std::sin(0.5 * angle), 0.0, 0.0, std::cos(0.5 * angle)};
}

Quaternion RotationAbout(Vector3 axis, double angle) {
  const double s = std::sin(0.5 * angle);
  return {s * axis.x, s * axis.y, s * axis.z, std::cos(0.5 * angle)};
}

Quaternion FromRollPitchYaw(Vector3 roll_pitch_yaw) {
  return RotationAbout({0, 0, 1}, roll_pitch_yaw.z) * RotationAbout({0, 1, 0}, roll_pitch_yaw.y) *
         RotationAboutX(roll_pitch_yaw.x);
}

Vector3 RollPitchYaw(const Quaternion& q) {
  const std::array<double, 9> m = MatrixOf(q);
  const double yaw = std::atan2(m[3], m[0]);
  const double s = std::sin(yaw), c = std::cos(yaw);
  // The roll that is left once that yaw is taken back: near a right angle of pitch both are noise, their sum is not.
  return {std::atan2(s * m[2] - c * m[5], c * m[4] - s * m[1]), std::atan2(-m[6], std::hypot(m[0], m[3])), yaw};
}

Quaternion FromMatrix(const std::array<double, 9>& m) {
  // The largest of the four parts is found first: dividing by it loses nothing.
  const double w = m[0] + m[4] + m[8], x = m[0] - m[4] - m[8], y = m[4] - m[0] - m[8], z = m[8] - m[0] - m[4];
  if (w >= x && w >= y && w >= z) return Normalised({m[7] - m[5], m[2] - m[6], m[3] - m[1], 1.0 + w});
  if (x >= y && x >= z) return Normalised({1.0 + x, m[1] + m[3], m[2] + m[6], m[7] - m[5]});
  if (y >= z) return Normalised({m[1] + m[3], 1.0 + y, m[5] + m[7], m[2] - m[6]});
  return Normalised({m[2] + m[6], m[5] + m[7], 1.0 + z, m[3] - m[1]});
}

std::array<double, 9> MatrixOf(const Quaternion& q) {
  const Vector3 x = Rotate(q, {1, 0, 0}), y = Rotate(q, {0, 1, 0}), z = Rotate(q, {0, 0, 1});
  return {x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z};
}

Vector3 RotationVector(const Quaternion& q) {
  const double sign = q.w < 0.0 ? -1.0 : 1.0;
  const Vector3 axis{sign * q.x, sign * q.y, sign * q.z};
  const double sine = Norm(axis);
  if (sine < 1e-300) return {};
  return (2.0 * std::atan2(sine, sign * q.w) / sine) * axis;
}

double AngleBetween(const Quaternion& a, const Quaternion& b) {
  return Norm(RotationVector(Inverse(a) * b));
}

Quaternion TurnOfXInto(Vector3 axis) {
  const double across = axis.y * axis.y + axis.z * axis.z;
  if (axis.x < 0.0 && across < 1e-24) return {0.0, 0.0, 1.0, 0.0};  // of -X the smallest has no direction
  // 1 + x, without losing it near -X.
  return Normalised({0.0, -axis.z, axis.y, axis.x < 0.0 ? across / (1.0 - axis.x) : 1.0 + axis.x});
}

}  // namespace consac::robot
