#pragma once
// Masses of links, from the solids that they are made of. Private to twin.

#include "consac/robot/robot.h"
#include "consac/robot/transform.h"

namespace consac::twin {

/// Adds a body of density 1 (SolidOf) that stands at `at` of its link to `sum`: mass (m^3), first moments in `centre`
/// (m^4), second moments about the link's origin in `inertia` (m^5).
void AddSolid(const robot::Inertial& solid, const robot::Transform& at, robot::Inertial* sum);
/// What such a sum with some mass weighs at `density` (kg/m^3): its mass, centre and inertia about that, kg, m, kg m^2.
robot::Inertial WithDensity(const robot::Inertial& sum, double density);

}  // namespace consac::twin
