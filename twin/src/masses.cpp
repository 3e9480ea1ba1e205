#include "masses.h"

namespace consac::twin {
namespace {

using robot::Vector3;

// What a mass of 1 at `at` adds to the inertia about the origin. Source: the parallel axis theorem of Steiner.
std::array<double, 6> InertiaOfPoint(Vector3 at) {
  return {at.y * at.y + at.z * at.z, -at.x * at.y, -at.x * at.z,
          at.x * at.x + at.z * at.z, -at.y * at.z, at.x * at.x + at.y * at.y};
}

}  // namespace

void AddSolid(const robot::Inertial& solid, const robot::Transform& at, robot::Inertial* sum) {
  const Vector3 c = at * solid.centre;
  const std::array<double, 6> turned = robot::TurnedInertia(solid.inertia, Inverse(at.rotation));
  const double m = solid.mass;
  const std::array<double, 6> shift = InertiaOfPoint(c);
  for (std::size_t i = 0; i < 6; ++i) sum->inertia[i] += turned[i] + m * shift[i];
  sum->centre = sum->centre + m * c;
  sum->mass += m;
}

robot::Inertial WithDensity(const robot::Inertial& sum, double density) {
  robot::Inertial body{density * sum.mass, (1.0 / sum.mass) * sum.centre, {}};
  const std::array<double, 6> shift = InertiaOfPoint(body.centre);
  for (std::size_t i = 0; i < 6; ++i) body.inertia[i] = density * (sum.inertia[i] - sum.mass * shift[i]);
  return body;
}

}  // namespace consac::twin
