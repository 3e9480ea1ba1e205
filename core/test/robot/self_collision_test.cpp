// Distances against a fine search, capsules around points, and which pairs are looked at.
#include "consac/robot/self_collision.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "consac/robot/kinematics.h"
#include "core/test/robot/small_robot.h"

namespace consac::robot {
namespace {

Vector3 SomePoint(Rng& rng) {
  return {rng.Between(-1, 1), rng.Between(-1, 1), rng.Between(-1, 1)};
}

TEST(SelfCollision, SegmentsAreAsFarApartAsTheirNearestPoints) {
  Rng rng(1, 1);
  for (int i = 0; i < 60; ++i) {
    const Vector3 a = SomePoint(rng), b = i % 10 == 0 ? a : SomePoint(rng), c = SomePoint(rng);
    const Vector3 d = i % 7 == 0 ? c : i % 5 == 0 ? c + 0.5 * (b - a) : SomePoint(rng);  // points, parallels
    double least = 1e9;
    constexpr int kCuts = 200;
    for (int s = 0; s <= kCuts; ++s) {
      for (int t = 0; t <= kCuts; ++t)
        least = std::min(least, Norm(a + (s / double{kCuts}) * (b - a) - (c + (t / double{kCuts}) * (d - c))));
    }
    const double distance = DistanceOfSegments(a, b, c, d);
    EXPECT_LE(distance, least + 1e-12);
    EXPECT_GE(distance, least - 0.02);
  }
}

TEST(SelfCollision, ACapsuleHoldsAllPointsAndIsNotMuchTooLarge) {
  Rng rng(2, 1);
  std::vector<Vector3> points;
  const Transform at{FromRollPitchYaw({1, 0.5, 0.2}), {0.3, 0.2, 0.1}};
  for (int i = 0; i < 4000; ++i) {  // a capsule of radius 0.1 and length 0.6
    const Vector3 inside = SomePoint(rng);
    if (Norm(inside) <= 1.0) points.push_back(at * (0.1 * inside + Vector3{rng.Between(-0.3, 0.3), 0, 0}));
  }
  const Capsule capsule = CapsuleAround(points);
  for (const Vector3& point : points)
    EXPECT_LE(DistanceOfSegments(capsule.from, capsule.to, point, point), capsule.radius + 1e-9);
  EXPECT_LT(capsule.radius, 0.115);
  EXPECT_LT(Norm(capsule.to - capsule.from), 0.65);
  EXPECT_EQ(CapsuleAround({}).radius, 0.0);
  const Vector3 one[] = {{1, 2, 3}};
  EXPECT_EQ(CapsuleAround(one).radius, 0.0);
  EXPECT_LT(Norm(CapsuleAround(one).from - one[0]), 1e-12);
}

TEST(SelfCollision, NeighboursAndAllowedPairsAreNotLookedAt) {
  Robot robot = MustMake(SmallArm());
  for (std::int32_t link = 0; link < 7; ++link) robot.capsules.push_back({link, {0, 0, 0}, {0.1, 0, 0}, 0.03});
  const auto looks_at = [&](std::int32_t a, std::int32_t b) {
    const SelfCollision collision(robot);
    return std::any_of(collision.pairs().begin(), collision.pairs().end(),
                       [&](const auto& pair) { return pair == std::pair(a, b); });
  };
  EXPECT_FALSE(looks_at(0, 1)) << "a joint between them";
  EXPECT_TRUE(looks_at(0, 2));
  EXPECT_FALSE(looks_at(3, 4)) << "slide and tool are one body";
  EXPECT_FALSE(looks_at(2, 4)) << "the tool is a part of the slide, next to the arm";
  EXPECT_TRUE(looks_at(5, 6)) << "two fingers";
  robot.allowed_collisions = {{6, 5}};
  EXPECT_FALSE(looks_at(5, 6));
}

TEST(SelfCollision, TheNearestPairIsFoundAndOverlapIsNegative) {
  Robot robot = MustMake(SmallArm());
  robot.capsules = {{0, {0, 0, 0}, {0, 0, 0.1}, 0.05}, {4, {0, 0, 0}, {0, 0, 0}, 0.02}};
  Kinematics kinematics(robot);
  const SelfCollision collision(robot);
  const SelfCollision::Nearest nearest = collision.Find(kinematics.links());
  const Vector3 tool = kinematics.links()[4].position;
  EXPECT_NEAR(nearest.distance, DistanceOfSegments({0, 0, 0}, {0, 0, 0.1}, tool, tool) - 0.07, 1e-12);
  robot.capsules[1].radius = 2.0;
  EXPECT_LT(SelfCollision(robot).Find(kinematics.links()).distance, 0.0);
  robot.capsules.clear();
  EXPECT_EQ(SelfCollision(robot).Find(kinematics.links()).first, -1);
}

}  // namespace
}  // namespace consac::robot
