// Rotations against their definitions; conventions against the formulas of the programs they are for.
#include "consac/robot/transform.h"

#include <gtest/gtest.h>

#include <cmath>

#include "consac/base/rng.h"
#include "consac/robot/conventions.h"
#include "core/test/robot/small_robot.h"

namespace consac::robot {
namespace {

Quaternion SomeRotation(Rng& rng) {
  return FromRollPitchYaw({rng.Between(-3, 3), rng.Between(-1.5, 1.5), rng.Between(-3, 3)});
}

TEST(RobotTransform, RollComesFirstAndYawLast) {
  const Vector3 turned = Rotate(FromRollPitchYaw({kPiRadians / 2, 0, kPiRadians / 2}), {0, 1, 0});
  EXPECT_NEAR(turned.z, 1.0, 1e-15) << "roll takes y to z, yaw leaves z";
  const Vector3 both = Rotate(FromRollPitchYaw({0, kPiRadians / 2, kPiRadians / 2}), {1, 0, 0});
  EXPECT_NEAR(both.z, -1.0, 1e-15) << "pitch takes x to -z";
}

TEST(RobotTransform, AnglesComeBackAlsoWhereRollAndYawAreOne) {
  Rng rng(1, 1);
  for (int i = 0; i < 1000; ++i) {
    const double right_angle = i % 2 == 0 ? kPiRadians / 2 : -kPiRadians / 2;
    const double off = std::pow(10.0, rng.Between(-16, 0));
    const Quaternion q = FromRollPitchYaw({rng.Between(-3, 3), right_angle + off, rng.Between(-3, 3)});
    EXPECT_LT(AngleBetween(q, FromRollPitchYaw(RollPitchYaw(q))), 4e-15) << off;
  }
}

TEST(RobotTransform, MatricesAndVectorsComeBack) {
  Rng rng(2, 1);
  for (int i = 0; i < 500; ++i) {
    const Quaternion q = SomeRotation(rng);
    EXPECT_LT(AngleBetween(q, FromMatrix(MatrixOf(q))), 4e-15);
    const Vector3 vector = RotationVector(q);
    EXPECT_LT(AngleBetween(q, RotationAbout((1.0 / Norm(vector)) * vector, Norm(vector))), 4e-15);
    const Transform t{q, {1, 2, 3}};
    EXPECT_LT(Difference(t * Inverse(t), {}), 4e-14);
  }
}

TEST(RobotTransform, XIsTurnedIntoEveryDirection) {
  Rng rng(3, 1);
  for (int i = 0; i < 1000; ++i) {
    Vector3 axis = Rotate(SomeRotation(rng), {1, 0, 0});
    if (i == 0) axis = {-1, 0, 0};
    if (i > 900) axis = {-std::sqrt(1.0 - std::pow(10.0, -0.2 * (i - 900))), std::pow(10.0, -0.1 * (i - 900)), 0};
    const Quaternion turn = TurnOfXInto(axis);
    EXPECT_NEAR(turn.x * turn.x + turn.y * turn.y + turn.z * turn.z + turn.w * turn.w, 1.0, 1e-14);
    EXPECT_LT(Norm(Rotate(turn, {1, 0, 0}) - axis), 1e-12) << i;
  }
  const Quaternion of_z = TurnOfXInto({0, 0, 1});
  EXPECT_NEAR(of_z.y, -0.70710678118654757, 1e-15);
  EXPECT_NEAR(of_z.w, 0.70710678118654757, 1e-15);
}

// The engine's own formula, half angles; written from its documentation.
Quaternion UnrealRotator(double pitch_deg, double yaw_deg, double roll_deg) {
  const double half = kPiRadians / 360.0;
  const double sp = std::sin(pitch_deg * half), cp = std::cos(pitch_deg * half);
  const double sy = std::sin(yaw_deg * half), cy = std::cos(yaw_deg * half);
  const double sr = std::sin(roll_deg * half), cr = std::cos(roll_deg * half);
  return {cr * sp * sy - sr * cp * cy, -cr * sp * cy - sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

TEST(RobotConventions, AJointsAngleIsUnrealsRollByTheSameSign) {
  for (const double q : {-2.5, -0.3, 0.0, 0.7, 3.0}) {
    const Quaternion roll = UnrealRotator(0, 0, AngleIn(Convention::kUnreal, q));
    EXPECT_LT(AngleBetween(roll, RotationIn(Convention::kUnreal, RotationAboutX(q))), 1e-15) << q;
  }
}

// Every convention composes as the robot's own: turning and then writing is writing and then turning.
TEST(RobotConventions, EachIsTheSameSceneSeenOtherwise) {
  Rng rng(4, 1);
  for (const Convention convention : {Convention::kRobot, Convention::kGltf, Convention::kUnreal}) {
    for (int i = 0; i < 100; ++i) {
      const Transform a{SomeRotation(rng), {rng.Between(-1, 1), rng.Between(-1, 1), rng.Between(-1, 1)}};
      const Transform b{SomeRotation(rng), {rng.Between(-1, 1), rng.Between(-1, 1), rng.Between(-1, 1)}};
      EXPECT_LT(Difference(TransformIn(convention, a * b), TransformIn(convention, a) * TransformIn(convention, b)),
                1e-13);
      EXPECT_LT(Difference(TransformFrom(convention, TransformIn(convention, a)), a), 1e-15);
      EXPECT_LT(Norm(PositionIn(convention, a * b.position) -
                     TransformIn(convention, a) * PositionIn(convention, b.position)),
                1e-13);
    }
  }
}

// Unreal's importer of glTF makes (100 x, 100 z, 100 y) of a position and (-x, -z, -y, w) of a rotation: what we write
// for glTF arrives there as what we write for Unreal.
TEST(RobotConventions, WhatGltfHoldsArrivesInUnrealAsUnrealHasIt) {
  Rng rng(5, 1);
  for (int i = 0; i < 100; ++i) {
    const Transform a{SomeRotation(rng), {rng.Between(-1, 1), rng.Between(-1, 1), rng.Between(-1, 1)}};
    const Transform gltf = TransformIn(Convention::kGltf, a);
    const Transform imported{{-gltf.rotation.x, -gltf.rotation.z, -gltf.rotation.y, gltf.rotation.w},
                             {100 * gltf.position.x, 100 * gltf.position.z, 100 * gltf.position.y}};
    EXPECT_LT(Difference(imported, TransformIn(Convention::kUnreal, a)), 4e-14);
  }
}

}  // namespace
}  // namespace consac::robot
