#pragma once
// Rotations and rigid transforms in three dimensions, in float64. Used by everything about robots: the joint table,
// kinematics, importers. Right-handed, metres, radians; other conventions are conventions.h.

#include <array>

namespace consac::robot {

inline constexpr double kPiRadians = 3.14159265358979323846;  ///< half a turn, rad

/// A point or a direction.
struct Vector3 {
  double x = 0.0, y = 0.0, z = 0.0;

  friend bool operator==(const Vector3&, const Vector3&) = default;
};

inline Vector3 operator+(Vector3 a, Vector3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector3 operator-(Vector3 a, Vector3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector3 operator*(double s, Vector3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline double Dot(Vector3 a, Vector3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vector3 Cross(Vector3 a, Vector3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Its length.
double Norm(Vector3 a);

/// A rotation: a quaternion of length 1.
struct Quaternion {
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;

  friend bool operator==(const Quaternion&, const Quaternion&) = default;
};

/// First b, then a.
Quaternion operator*(const Quaternion& a, const Quaternion& b);
/// The rotation back.
inline Quaternion Inverse(const Quaternion& q) {
  return {-q.x, -q.y, -q.z, q.w};
}
/// `v`, turned.
Vector3 Rotate(const Quaternion& q, Vector3 v);
/// The same rotation with length 1 and w >= 0; identity where the length is 0.
Quaternion Normalised(const Quaternion& q);

/// By `angle` (rad) about the local X axis: what every joint of the joint table does.
Quaternion RotationAboutX(double angle);
/// By `angle` (rad) about `axis`, of length 1.
Quaternion RotationAbout(Vector3 axis, double angle);
/// Rz(yaw) Ry(pitch) Rx(roll): about fixed axes, roll first. Source: wiki.ros.org/urdf/XML/joint.
Quaternion FromRollPitchYaw(Vector3 roll_pitch_yaw);
/// The angles that FromRollPitchYaw makes the same rotation of, exact at a pitch of a right angle too.
Vector3 RollPitchYaw(const Quaternion& q);
/// The rotation whose matrix this is, row by row; the matrix must be a rotation.
Quaternion FromMatrix(const std::array<double, 9>& matrix);
/// Its matrix, row by row.
std::array<double, 9> MatrixOf(const Quaternion& q);
/// Axis times angle, with an angle of at most half a turn (the logarithm).
Vector3 RotationVector(const Quaternion& q);
/// The angle between two rotations, 0 to pi.
double AngleBetween(const Quaternion& a, const Quaternion& b);
/// The smallest rotation that turns the X axis into `axis`, of length 1; for -X half a turn about Z.
Quaternion TurnOfXInto(Vector3 axis);

/// A frame in another: first the rotation, then the shift.
struct Transform {
  Quaternion rotation;
  Vector3 position;  ///< m

  friend bool operator==(const Transform&, const Transform&) = default;
};

/// The frame b of a, seen from where a is seen.
inline Transform operator*(const Transform& a, const Transform& b) {
  return {a.rotation * b.rotation, a.position + Rotate(a.rotation, b.position)};
}
/// A point of the frame, seen from outside.
inline Vector3 operator*(const Transform& a, Vector3 point) {
  return a.position + Rotate(a.rotation, point);
}
/// The way back.
inline Transform Inverse(const Transform& a) {
  const Quaternion back = Inverse(a.rotation);
  return {back, Rotate(back, -1.0 * a.position)};
}

}  // namespace consac::robot
