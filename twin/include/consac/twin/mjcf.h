#pragma once
// MJCF in: the part of MuJoCo's format that says what a robot is. For files that are not to be trusted. Source:
// mujoco.readthedocs.io, XMLreference.
//
// Read: compiler (angle, eulerseq, meshdir), defaults and classes, meshes and materials, bodies and frames, hinges and
// slides (several in a body become a chain of links), inertials, geoms, excluded contacts, joint equalities. Not read,
// and said: free and ball joints, ellipsoids, height fields, tendons. Actuators, sensors and options are left out.
// Refused: <include>, <replicate>, <attach>: let MuJoCo save the model as one file first.

#include <string_view>

#include "consac/base/status.h"
#include "consac/twin/model.h"

namespace consac::twin {

/// The robot that `text` describes; its base is the link "world". Errors as ReadUrdf.
Result<Model> ReadMjcf(std::string_view text);

}  // namespace consac::twin
