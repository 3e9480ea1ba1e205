#pragma once
// What pairs of groups say by the axes that they share. Private to twin.

#include <vector>

#include "cad_axes.h"
#include "cad_groups.h"

namespace consac::twin {

/// Every pair that shares an axis, judged (cad_joints.h), best first. Marks groups that only connect others.
std::vector<JointCandidate> JudgePairs(const std::vector<AxisLine>& lines, Groups* groups);

}  // namespace consac::twin
