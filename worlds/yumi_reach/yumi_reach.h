#pragma once
// yumi-reach-v0 and its variants: arms of ABB's YuMi bring their tools to points; goals as in FetchReach. What they
// share with other robots is worlds/robot_reach. See README.md.

#include "worlds/robot_reach/robot_reach.h"
#include "worlds/yumi_reach/yumi_arm.h"

namespace consac::worlds {

/// What there is of it.
enum class YumiReach : std::uint8_t {
  kPlain,    ///< yumi-reach-v0: the right tool goes somewhere; 5 cm is near
  kDense,    ///< paid by the distance
  kJoints,   ///< by seven joints
  kPrecise,  ///< 1 cm is near
  kDual,     ///< both arms, two goals; where they touch they stop
};

/// The task of a variant.
std::shared_ptr<const ReachTask> YumiReachTask(YumiReach variant);

/// A row's `create` in the table of worlds.
template <YumiReach variant>
std::unique_ptr<VectorEnv> MakeYumiReach(std::int32_t copies) {
  return RobotReach::Make(YumiReachTask(variant), copies);
}

}  // namespace consac::worlds
