#include "consac/robot/conventions.h"

namespace consac::robot {
namespace {

constexpr double kCentimetres = 100.0;  // in a metre

}  // namespace

Vector3 PositionIn(Convention convention, Vector3 p) {
  switch (convention) {
    case Convention::kRobot:
      return p;
    case Convention::kGltf:
      return {p.x, p.z, -p.y};
    case Convention::kUnreal:
      return {kCentimetres * p.x, -kCentimetres * p.y, kCentimetres * p.z};
  }
  return p;
}

Quaternion RotationIn(Convention convention, const Quaternion& q) {
  switch (convention) {
    case Convention::kRobot:
      return q;
    case Convention::kGltf:
      return {q.x, q.z, -q.y, q.w};
    case Convention::kUnreal:
      return {-q.x, q.y, -q.z, q.w};  // a mirror turns the sense of every rotation
  }
  return q;
}

Transform TransformIn(Convention convention, const Transform& transform) {
  return {RotationIn(convention, transform.rotation), PositionIn(convention, transform.position)};
}

Transform TransformFrom(Convention convention, const Transform& written) {
  const Vector3& p = written.position;
  const Quaternion& q = written.rotation;
  switch (convention) {
    case Convention::kRobot:
      return written;
    case Convention::kGltf:
      return {{q.x, -q.z, q.y, q.w}, {p.x, -p.z, p.y}};
    case Convention::kUnreal:
      return {{-q.x, q.y, -q.z, q.w}, {p.x / kCentimetres, -p.y / kCentimetres, p.z / kCentimetres}};
  }
  return written;
}

double AngleIn(Convention convention, double angle) {
  return convention == Convention::kUnreal ? angle * (180.0 / kPiRadians) : angle;
}

double ShiftIn(Convention convention, double shift) {
  return convention == Convention::kUnreal ? shift * kCentimetres : shift;
}

double JointIn(Convention convention, JointType type, double position) {
  return type == JointType::kPrismatic ? ShiftIn(convention, position) : AngleIn(convention, position);
}

double JointFrom(Convention convention, JointType type, double written) {
  return written / JointIn(convention, type, 1.0);
}

}  // namespace consac::robot
