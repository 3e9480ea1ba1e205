#pragma once
// twin-reach-v0: the robot of any twin that `consac twin import` made brings its tool to points; twin-reach-mujoco-v0
// is the same task of a robot with masses and motors. What a person does not say about the task is worked out from the
// joint table. See README.md.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "worlds/robot_reach/robot_reach.h"

namespace consac::worlds {

/// What a person says about the task of a robot; the rest is worked out.
struct TwinReachChoice {
  struct Box {
    std::array<double, 3> low{}, high{};  ///< m, in the base's frame
  };
  std::string tool;                                   ///< link; "": the last of the longest chain
  std::optional<robot::Vector3> tool_point;           ///< in that link's frame, m; the far end of its capsule
  std::vector<std::pair<std::string, double>> ready;  ///< positions of joints by name; of none: all are worked out
  std::optional<Box> goals;                           ///< a cube of at most 0.3 m that the tool reaches all of
  std::optional<double> threshold;                    ///< m; a sixth of the box's longest edge
};

/// What moves the robot.
enum class TwinReachPhysics : std::uint8_t {
  kKinematic,  ///< twin-reach-v0
  kMujoco,     ///< twin-reach-mujoco-v0: MuJoCo, by the twin.xml beside the twin's table
};

/// The task "twin-reach-v0:ARGUMENT": `argument` is a twin's folder, its twin.json, or a JSON file that names a twin
/// and says what README.md lists. The error says in one sentence what is missing or wrong, and what to do.
Result<std::shared_ptr<const ReachTask>> ReadTwinReach(std::string_view argument,
                                                       TwinReachPhysics physics = TwinReachPhysics::kKinematic);
/// The task for a robot; `id` is the world's. kInvalidArgument names the link, joint or number that cannot be used, or
/// says that no cube of goals was found. Takes some 0.1 s; the same for the same robot.
Result<std::shared_ptr<const ReachTask>> TwinReachTask(robot::Robot robot, const TwinReachChoice& choice,
                                                       std::string id);

/// Everything about such a task as the JSON file that ReadTwinReach takes, with `twin` as the twin it names.
std::string TwinReachText(const ReachTask& task, std::string_view twin);

/// The rows' `create_of` in the table of worlds.
template <TwinReachPhysics kPhysics>
Result<std::unique_ptr<VectorEnv>> MakeTwinReach(std::string_view argument, std::int32_t copies) {
  Result<std::shared_ptr<const ReachTask>> task = ReadTwinReach(argument, kPhysics);
  if (!task.ok()) return task.status();
  return RobotReach::Make(std::move(*task), copies);
}

}  // namespace consac::worlds
