#pragma once
// A URDF laid over a CAD file: its joints' names, limits and senses for axes that were found there. Private to twin.

#include <string>
#include <vector>

#include "consac/twin/cad_joints.h"

namespace consac::twin {

/// Turns and shifts the robot, at its zero pose, so that its axes fall on candidates of `found` (to 1 mm and half a
/// degree), and adds a hint for each that does and that no hint is about. `said` gets a line for each that does not.
/// kInvalidArgument where two axes that are not parallel do not fit.
Status LayOver(const robot::Robot& known, const CadRobot& found, JointHints* hints, std::vector<std::string>* said);

}  // namespace consac::twin
