#pragma once
// MuJoCo as what moves a robot's joints, in worlds whose kinematic motion is then what motors are told. Optional: it is
// compiled where MuJoCo's header is found (Debian's libmujoco-dev, or the user's own: docs/twin.md), and its library is
// loaded when a world asks for it; where one is not there, that is said.

#include <memory>
#include <string>

#include "consac/base/status.h"
#include "worlds/robot_reach/robot_reach.h"

namespace consac::worlds {

/// The version of MuJoCo that is there, "2.2.2"; "" without.
std::string MujocoVersion();

/// The robot of the MJCF at `path`, which `consac twin import` wrote beside the joint table of `robot`. Motors hold a
/// position as a servo's do: critically damped, at 50 rad/s for the inertia that MuJoCo knows, up to the effort of the
/// joint; gravity and the like are taken off them, as robots' own controllers do. Errors in one sentence: a build
/// without MuJoCo, what MuJoCo says of the file, a file of another robot.
Result<std::shared_ptr<const ReachDynamics>> LoadMujoco(const std::string& path, const robot::Robot& robot);

}  // namespace consac::worlds
