#pragma once
// A link's inertia along its principal axes, as USD writes it. Private to twin.

#include "consac/robot/robot.h"

namespace consac::twin {

/// The moments about the principal axes, kg m^2, and the rotation that turns x, y and z into these.
struct PrincipalInertia {
  robot::Vector3 moments;
  robot::Quaternion axes;
};
/// Those of an inertia: xx, xy, xz, yy, yz, zz. Source: Jacobi's rotations; Golub and Van Loan, 8.5.
PrincipalInertia PrincipalOf(const std::array<double, 6>& inertia);

}  // namespace consac::twin
